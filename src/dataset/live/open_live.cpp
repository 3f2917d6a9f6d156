// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cctype>
#include <utility>

#include "bags/bag_camera.hpp"
#include "bags/bag_recording.hpp"
#include "bags/message_images.hpp"
#include "depth_check.hpp"
#include "frame_images.hpp"
#include "live/live_source.hpp"
#include "plumbline/dataset/live.hpp"
#include "recording_camera.hpp"

namespace plumbline::dataset {
namespace {

constexpr const char* kScheme = "ros2://";

/// Images of the queue are messages.
class LiveImages final : public MessageImages {
 public:
  LiveImages(std::string address, LiveTopic color, LiveTopic depth, std::shared_ptr<LiveQueue> queue)
      : address_(std::move(address)),
        color_(std::move(color)),
        depth_(std::move(depth)),
        queue_(std::move(queue)) {}

  [[nodiscard]] std::string describe(ImageId id) const override {
    return fmt::format("{}:{}#{}", address_, topic_of(id).topic.name, id.number);
  }

 private:
  [[nodiscard]] const LiveTopic& topic_of(ImageId id) const {
    return id.list == ImageList::kColor ? color_ : depth_;
  }
  [[nodiscard]] core::Result<Message> message_of(ImageId id) const override {
    const SharedBytes bytes = queue_->image(id);
    if (!bytes) return core::input_error(describe(id) + ": does not exist any more");
    const LiveTopic& topic = topic_of(id);
    return Message{topic.topic.type == "sensor_msgs/Image", topic.decoder, *bytes};
  }

  std::string address_;
  LiveTopic color_;
  LiveTopic depth_;
  std::shared_ptr<LiveQueue> queue_;
};

core::Result<void> fits_live(const std::string& address, const OpenOptions& options) {
  const char* wrong = options.from_s > 0.0 || options.to_s < 1e299          ? "--from and --to"
                      : options.every != 1                                  ? "--every"
                      : options.format != "auto" && !options.format.empty() ? "--format"
                      : options.poses == PoseUse::kGiven                    ? "--poses given"
                                                                            : nullptr;

  // The file to record is checked before the run
  if (wrong == nullptr)
    return options.live.record.empty() ? core::Result<void>()
                                       : LiveRecord::check(options.live.record, options.live.replace);
  return core::usage_error(
      fmt::format("{}: is live; {} is about recordings (--for S ends the run)", address, wrong));
}

/// The messages with the calibrations of both cameras.
LiveRecord::Infos infos_of(const BagSurvey& survey, const ChosenTopics& topics) {
  LiveRecord::Infos infos;
  const auto first = [&](const ChosenTopic& chosen) -> std::optional<CameraInfoMessage> {
    if (chosen.topic == nullptr) return std::nullopt;
    auto message = survey.first(*chosen.topic, &MessageDecoder::camera_info);
    return message ? std::optional<CameraInfoMessage>(std::move(*message)) : std::nullopt;
  };
  infos.color = first(topics.info);
  if (topics.depth_info.topic != topics.info.topic) infos.depth = first(topics.depth_info);
  return infos;
}

LiveRecord::Topics topics_of(const ChosenTopics& topics) {
  const auto name = [](const ChosenTopic& chosen) {
    return chosen.topic == nullptr ? "" : chosen.topic->topic.name;
  };
  return {topics.color.topic->topic, topics.depth.topic->topic, name(topics.info), name(topics.depth_info)};
}

/// The camera of the first frames, as open_recording finds that of a recording.
core::Result<sensor::Camera> complete_live_camera(const std::string& address, const OpenOptions& options,
                                                  const std::optional<ChosenCamera>& chosen,
                                                  const LiveSurvey& found, const ChosenTopics& topics,
                                                  Layout& layout, core::Log& log) {
  auto camera = bag_camera(found.survey, topics, log);
  if (!camera && options.camera.empty()) return tl::unexpected(camera.error());
  if (camera) layout.camera = std::move(*camera);
  if (layout.camera) layout.camera->camera.fps = usual_fps(layout.pairs);
  auto complete = complete_camera(address, chosen, layout, log);
  if (!complete) return tl::unexpected(complete.error());
  layout.color_reduction = stored_reduction(layout, *complete);
  if (auto kinds = check_image_kinds(layout, *complete, log); !kinds) return tl::unexpected(kinds.error());
  return complete;
}

/// A queue, what fills it, and its images.
std::shared_ptr<LiveCamera> connect(const std::string& address, std::unique_ptr<MessageStream> stream,
                                    const ChosenTopics& topics, const std::vector<BagTopic>& body,
                                    const std::optional<ChosenCamera>& chosen, const OpenOptions& options,
                                    core::Log& log) {
  // Rules by which messages become frames.
  LiveStream::Options how;
  how.address = address;
  how.max_pair_gap_s = options.max_pair_gap_s;
  if (chosen) how.depth_delay_s = chosen->reading.camera.depth_delay_s;
  how.for_s = options.live.for_s;
  how.body = body;
  how.stop = options.live.stop;
  how.most_waiting_bytes = options.live.most_waiting_bytes;

  // The queue between the stream's thread and the run.
  auto live = std::make_shared<LiveCamera>();
  const auto topic = [](const ChosenTopic& of) { return LiveTopic{of.topic->topic, of.topic->decoder}; };
  const LiveTopic color = topic(topics.color);
  const LiveTopic depth = topic(topics.depth);
  live->lag = 1;  // so that readings of wheels and inertial sensor have come
  live->queue = std::make_shared<LiveQueue>(how.most_waiting_bytes);
  live->layout.format = "ros2";
  live->layout.images = std::make_shared<LiveImages>(address, color, depth, live->queue);
  live->stream = std::make_shared<LiveStream>(std::move(stream), color, depth, live->queue, how, log);

  log.info(fmt::format("{}: up to {} MB of frames wait to be mapped; what comes beyond is dropped", address,
                       how.most_waiting_bytes >> 20U));
  return live;
}

/// Makes the first frames from the images of the survey. Error (kInput): none can be made.
core::Result<void> begin(const std::string& address, const LiveSurvey& found, const ChosenTopics& topics,
                         const OpenOptions& options, LiveCamera& live) {
  for (const LiveMessage& message : found.images) live.stream->add(message);
  if (!live.stream->wait_for_first(options.live.patience)) {
    return core::input_error(fmt::format(
        "{}: images of {} and {} come, but none of the two within {:g} s of each other; name "
        "topics of one camera with ?color=/TOPIC&depth=/TOPIC",
        address, topics.color.topic->topic.name, topics.depth.topic->topic.name, options.max_pair_gap_s));
  }
  for (std::size_t i = 0; i < live.queue->size(); ++i) live.layout.pairs.push_back(live.queue->info(i));
  return {};
}

/// Null where nothing is to be recorded.
core::Result<std::unique_ptr<LiveRecord>> make_record(const LiveOptions& options, const BagSurvey& survey,
                                                      const ChosenTopics& topics,
                                                      const sensor::Camera& camera) {
  if (options.record.empty()) return nullptr;
  return LiveRecord::create(options.record, topics_of(topics), infos_of(survey, topics), camera);
}

/// Name of the source: "ros2_0" for "ros2://0?color=..."; a recorded source has its record's name.
std::string name_of_address(const std::string& address) {
  std::string name;
  for (const char c : address.substr(0, address.find('?'))) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
    if (c == '/' && !name.empty() && name.back() != '_') name += '_';
  }
  return name;
}

}  // namespace

bool is_live_address(const std::string& input) { return input.rfind(kScheme, 0) == 0; }

core::Result<std::unique_ptr<LiveFrameSource>> open_live(const std::string& address,
                                                         std::unique_ptr<MessageStream> stream,
                                                         const OpenOptions& options, core::Log& log) {
  const LiveOptions& how = options.live;
  if (auto fits = fits_live(address, options); !fits) return tl::unexpected(fits.error());
  const auto chosen = choose_camera(address, options, log);
  if (!chosen) return tl::unexpected(chosen.error());

  // Listen until it is clear what the camera is.
  const auto found = survey_stream(address, *stream, options.topics, how.patience, how.stop,
                                   options.poses == PoseUse::kPrior);
  if (!found) return tl::unexpected(found.error());
  const auto topics = choose_topics(found->survey, options.topics);
  if (!topics) return tl::unexpected(topics.error());
  log.info(fmt::format("{}: colour from {}, depth from {}", address, topics->color.topic->topic.name,
                       topics->depth.topic->topic.name));

  const auto live = connect(address, std::move(stream), *topics, found->body, *chosen, options, log);
  live->name = how.record.empty() ? name_of_address(address) : how.record.stem().string();
  for (const char* frame : {"base_link", "base_footprint"}) {
    if (const auto known = body_from_camera(found->survey, *topics, frame))
      live->body_from_camera[frame] = *known;
  }
  if (auto begun = begin(address, *found, *topics, options, *live); !begun)
    return tl::unexpected(begun.error());

  // The first frames complete and check the camera, as for recordings
  const auto camera = complete_live_camera(address, options, *chosen, *found, *topics, live->layout, log);
  if (!camera) return tl::unexpected(camera.error());
  if (auto likely = check_focal_lengths(*camera, address); !likely) return tl::unexpected(likely.error());
  auto source = make_live_source(live, *camera);
  const auto doubt = check_depth_scale(*source, address);
  if (!doubt) return tl::unexpected(doubt.error());
  if (!doubt->text.empty()) log.warning(doubt->text);
  if (doubt->doubted) live->doubt = doubt->text;

  auto record = make_record(how, found->survey, *topics, *camera);
  if (!record) return tl::unexpected(record.error());
  live->stream->start(std::move(*record));
  return source;
}

core::Result<std::string> live_to_text(const std::string& address, MessageStream& stream,
                                       const OpenOptions& options) {
  const auto found = survey_stream(address, stream, options.topics, options.live.patience, options.live.stop);
  std::string text = fmt::format("live: {}\n{}", address, published_text(stream.topics()));

  // Topics without images help to find the error
  if (!found) {
    if (stream.topics().empty()) return tl::unexpected(found.error());
    return text + "note: " + found.error().message + "\n";
  }
  const auto topics = choose_topics(found->survey, options.topics);
  if (topics) text += choice_text(*topics);
  return text;
}

}  // namespace plumbline::dataset
