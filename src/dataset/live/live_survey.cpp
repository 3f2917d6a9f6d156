// SPDX-License-Identifier: BSD-3-Clause
#include "live/live_survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "bags/bag_camera.hpp"
#include "bags/bag_parts.hpp"
#include "bags/body_messages.hpp"

namespace plumbline::dataset {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kListen(50);
constexpr std::chrono::milliseconds kLookEvery(100);
constexpr std::chrono::milliseconds kOthersMayCome(500);  // other topics, after the first image
constexpr std::chrono::milliseconds kCalibrationMayCome(2000);

/// The first messages of each topic, as a bag.
class MemoryBag final : public BagFile {
 public:
  core::Result<void> scan(const Visit& /*visit*/) override { return {}; }
  [[nodiscard]] core::Result<Bytes> read(const MessagePlace& place) const override {
    return *messages_.at(place.at);
  }
  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }
  [[nodiscard]] const std::vector<std::string>& notes() const override { return notes_; }

  MessagePlace add(SharedBytes bytes) {
    MessagePlace place;
    place.at = messages_.size();
    place.size = static_cast<std::uint32_t>(bytes->size());
    messages_.push_back(std::move(bytes));
    return place;
  }

 private:
  std::vector<SharedBytes> messages_;
  std::vector<BagTopic> topics_;
  std::vector<std::string> notes_;
};

bool is_image_type(const std::string& type) {
  return type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage";
}

class StreamSurveyor {
 public:
  StreamSurveyor(const std::string& address, MessageStream& stream, const TopicNames& named,
                 const BagReaders& readers)
      : stream_(stream), named_(named), readers_(readers), bag_(std::make_shared<MemoryBag>()) {
    // A stream is surveyed as a bag in memory
    found_.survey.path = address;
    found_.survey.kind = "ros2";
    found_.survey.files.push_back(bag_);
  }

  void listen() {
    // Cameras may start during the survey
    const auto now = Clock::now();
    if (now - looked_ > kLookEvery) {
      looked_ = now;
      subscribe_to_cameras();
    }
    auto message = stream_.next(kListen);
    if (!message) return;

    // Tracking begins with the messages of the survey
    LiveMessage kept{message->topic, message->received_ns,
                     std::make_shared<const Bytes>(std::move(message->bytes))};
    add(kept);
    if (!is_image_type(types_[kept.topic])) return;
    if (found_.images.empty()) first_image_ = now;
    found_.images.push_back(std::move(kept));
  }

  /// True if colour and depth are certain and their calibration has arrived; tested from time to time.
  bool complete() {
    const auto now = Clock::now();
    if (found_.images.empty() || now - first_image_ < kOthersMayCome || now - judged_ < kLookEvery)
      return false;
    judged_ = now;
    sort_topics();
    const auto chosen = choose_topics(found_.survey, named_);
    if (!chosen) return false;
    const bool enough = now - first_image_ > kCalibrationMayCome;
    const auto quiet = core::null_log();
    const auto camera = bag_camera(found_.survey, *chosen, *quiet);
    return (camera && (*camera || enough)) || (!camera && enough && chosen->depth_info.topic == nullptr);
  }

  [[nodiscard]] bool any_image() const { return !found_.images.empty(); }
  LiveSurvey take() {
    sort_topics();
    return std::move(found_);
  }
  /// Keeps messages of these topics only, and of those about the body, which it returns.
  std::vector<BagTopic> keep_only(const std::set<std::string>& topics, bool with_body) {
    std::vector<BagTopic> body;
    for (const auto& [topic, type] : types_) {
      const BagTopic told{topic, type, "cdr"};
      if (with_body && tells_of_body(told))
        body.push_back(told);
      else if (topics.count(topic) == 0)
        stream_.unsubscribe(topic);
    }
    return body;
  }

 private:
  [[nodiscard]] bool wanted(const StreamTopic& topic) const {
    if (!topic.supported) return false;
    if (topic.type == "tf2_msgs/TFMessage") return topic.name == "/tf_static" || topic.name == "/tf";
    if (topic.type == "sensor_msgs/CameraInfo" || tells_of_body({topic.name, topic.type, ""})) return true;

    // Named topics make all other images superfluous
    const bool all = named_.color.empty() || named_.depth.empty();
    return is_image_type(topic.type) && (all || topic.name == named_.color || topic.name == named_.depth);
  }

  void subscribe_to_cameras() {
    for (const StreamTopic& topic : stream_.topics()) {
      if (types_.count(topic.name) != 0 || !wanted(topic)) continue;
      if (stream_.subscribe(topic.name)) types_[topic.name] = topic.type;
    }
  }

  void sort_topics() {
    std::sort(found_.survey.topics.begin(), found_.survey.topics.end(),
              [](const SurveyedTopic& a, const SurveyedTopic& b) { return a.topic.name < b.topic.name; });
  }

  SurveyedTopic& topic_of(const std::string& name) {
    auto& topics = found_.survey.topics;
    const auto known = std::find_if(topics.begin(), topics.end(),
                                    [&](const SurveyedTopic& topic) { return topic.topic.name == name; });
    if (known != topics.end()) return *known;

    // ROS 2 sends all messages as CDR
    SurveyedTopic added;
    added.topic = {name, types_[name], "cdr"};
    added.decoder = &readers_.cdr();
    topics.push_back(std::move(added));
    return topics.back();
  }

  void add(const LiveMessage& message) {
    constexpr std::size_t kMostImages = 5;  // so many are tried for the encoding
    SurveyedTopic& topic = topic_of(message.topic);
    topic.first_ns = topic.count == 0 ? message.received_ns : topic.first_ns;
    topic.last_ns = message.received_ns;
    ++topic.count;

    // A few messages without images are enough
    if (!topic.has_images()) {
      if (topic.others.size() < kFewMessages) topic.others.push_back(bag_->add(message.bytes));
      return;
    }

    // The stamp is in the message's head
    const auto stamp =
        topic.decoder->stamp(message.bytes->data(), std::min(message.bytes->size(), kHeadBytes));
    if (stamp && topic.images.size() < kMostImages)
      topic.images.push_back({*stamp, message.received_ns, bag_->add(message.bytes)});
  }

  MessageStream& stream_;
  const TopicNames& named_;
  const BagReaders& readers_;
  std::shared_ptr<MemoryBag> bag_;
  LiveSurvey found_;
  std::map<std::string, std::string> types_;  ///< types of the subscribed topics
  Clock::time_point looked_;
  Clock::time_point judged_;
  Clock::time_point first_image_;
};

core::Result<LiveSurvey> no_camera(const std::string& address, const std::vector<StreamTopic>& topics,
                                   std::chrono::milliseconds patience) {
  const double seconds = std::chrono::duration<double>(patience).count();
  if (topics.empty()) {
    return core::input_error(
        fmt::format("{}: nothing at all is published there (looked for {:g} s); check the number of the "
                    "domain (ROS_DOMAIN_ID), the network (?interface=IF, ?peers=HOST), and that the camera's "
                    "node runs",
                    address, seconds));
  }

  // The user sees which topics exist
  std::string list;
  for (const StreamTopic& topic : topics)
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", topic.name, topic.type);
  return core::input_error(
      fmt::format("{}: no image (sensor_msgs/Image or CompressedImage) came within {:g} s; published are: "
                  "{}; start the camera's node, or name its topics with ?color=/TOPIC&depth=/TOPIC",
                  address, seconds, list));
}

}  // namespace

/// One line for each topic, as in the summary of a bag.
std::string published_text(const std::vector<StreamTopic>& topics) {
  std::string text;
  for (const StreamTopic& topic : topics) {
    text += fmt::format("topic: {} {}{}\n", topic.name, topic.type,
                        topic.supported ? "" : ", of a type that is not read");
  }
  return text;
}

core::Result<LiveSurvey> survey_stream(const std::string& address, MessageStream& stream,
                                       const TopicNames& named, std::chrono::milliseconds patience,
                                       const core::StopToken& stop, bool with_body) {
  const auto& readers = core::part<BagReaders>();
  if (!readers) return tl::unexpected(readers.error());

  // Messages until the camera's topics are certain
  StreamSurveyor surveyor(address, stream, named, **readers);
  const auto until = Clock::now() + patience;
  while (Clock::now() < until && !surveyor.complete()) {
    if (stop.stop_requested())
      return core::failure(core::ErrorKind::kStopped,
                           address + ": stopped before a camera was found; nothing is written");
    surveyor.listen();
  }

  // Only the chosen images are received from now on.
  if (!surveyor.any_image()) return no_camera(address, stream.topics(), patience);
  LiveSurvey found = surveyor.take();
  const auto chosen = choose_topics(found.survey, named);
  if (!chosen) return tl::unexpected(chosen.error());
  found.body =
      surveyor.keep_only({chosen->color.topic->topic.name, chosen->depth.topic->topic.name}, with_body);
  return found;
}

}  // namespace plumbline::dataset
