// SPDX-License-Identifier: BSD-3-Clause
#include "bags/bag_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bags/bag_camera.hpp"
#include "bags/body_messages.hpp"
#include "bags/message_images.hpp"
#include "bags/topics.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::dataset {
namespace {

/// One image topic, its messages by stamp.
struct TopicImages {
  BagTopic topic;
  const MessageDecoder* decoder = nullptr;
  std::vector<ImageEntry> images;
};

class BagImages final : public MessageImages {
 public:
  BagImages(const BagSurvey& survey, TopicImages color, TopicImages depth)
      : path_(survey.path), files_(survey.files), color_(std::move(color)), depth_(std::move(depth)) {}

  [[nodiscard]] std::string describe(ImageId id) const override {
    return fmt::format("{}:{}#{}", path_, list_of(id).topic.name, id.number);
  }

 private:
  [[nodiscard]] const TopicImages& list_of(ImageId id) const {
    return id.list == ImageList::kColor ? color_ : depth_;
  }
  [[nodiscard]] core::Result<Message> message_of(ImageId id) const override {
    const TopicImages& list = list_of(id);
    const MessagePlace& place = list.images.at(id.number).place;
    auto bytes = files_.at(place.file)->read(place);
    if (!bytes) return tl::unexpected(bytes.error());
    return Message{list.topic.type == "sensor_msgs/Image", list.decoder, std::move(*bytes)};
  }

  std::string path_;
  std::vector<std::shared_ptr<const BagFile>> files_;
  TopicImages color_;
  TopicImages depth_;
};

/// Drops images whose stamp is far from the time at which they were logged, unlike all others, if the message
/// itself cannot be read: the stamp is damaged, as a chunk's checksum confirms.
std::size_t drop_damaged(const BagSurvey& survey, std::vector<ImageEntry>& images) {
  constexpr double kSuspicious_ns = 60e9;
  if (images.empty()) return 0;
  std::vector<double> delays;
  delays.reserve(images.size());
  const auto delay = [](const ImageEntry& entry) {
    return static_cast<double>(entry.log_ns) - static_cast<double>(entry.stamp_ns);
  };
  for (const ImageEntry& entry : images) delays.push_back(delay(entry));
  const double usual = core::median(std::move(delays));
  const auto damaged = [&](const ImageEntry& entry) {
    if (std::abs(delay(entry) - usual) < kSuspicious_ns) return false;
    return !survey.files.at(entry.place.file)->read(entry.place);
  };
  const auto end = std::remove_if(images.begin(), images.end(), damaged);
  const auto dropped = static_cast<std::size_t>(images.end() - end);
  images.erase(end, images.end());
  return dropped;
}

TopicImages images_in(const BagSurvey& survey, const SurveyedTopic& topic, core::Log& log) {
  TopicImages list;
  list.topic = topic.topic;
  list.decoder = topic.decoder;
  list.images = topic.images;

  // Without stamps the times of recording count
  const bool stamped = std::any_of(list.images.begin(), list.images.end(),
                                   [](const ImageEntry& entry) { return entry.stamp_ns != 0; });
  if (!stamped) {
    log.warning(
        fmt::format("{}: {} has no stamps; the times of recording are taken", survey.path, topic.topic.name));
    for (ImageEntry& entry : list.images) entry.stamp_ns = entry.log_ns;
  }

  // Damaged images are not paired
  if (const std::size_t dropped = drop_damaged(survey, list.images); dropped > 0)
    log.warning(
        fmt::format("{}: {} images of {} are damaged and left out", survey.path, dropped, topic.topic.name));

  // Bags are ordered by arrival, not by stamp
  std::stable_sort(list.images.begin(), list.images.end(),
                   [](const ImageEntry& a, const ImageEntry& b) { return a.stamp_ns < b.stamp_ns; });
  return list;
}

std::vector<StampedFile> stamps_of(const TopicImages& list) {
  std::vector<StampedFile> stamps;
  stamps.reserve(list.images.size());
  for (const ImageEntry& entry : list.images) stamps.push_back({seconds_of(entry.stamp_ns), "", 0});
  return stamps;
}

core::Result<std::optional<sensor::CameraReading>> camera_of_bag(const BagSurvey& survey,
                                                                 const ChosenTopics& topics, core::Log& log) {
  // Plumbline's own bags hold the camera file
  if (survey.camera_yaml.empty()) return bag_camera(survey, topics, log);
  auto camera = sensor::parse_camera(survey.camera_yaml, survey.path);
  if (!camera) return tl::unexpected(camera.error());
  sensor::CameraReading reading;
  reading.camera = std::move(*camera);
  return reading;
}

}  // namespace

/// Pairs a second by the median step; 30 if no step is known.
double usual_fps(const std::vector<PairInfo>& pairs) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    const double step = pairs[i].stamp - pairs[i - 1].stamp;
    if (step > 0.0) steps.push_back(step);
  }
  if (steps.empty()) return 30.0;
  return std::clamp(std::round(100.0 / core::median(std::move(steps))) / 100.0, 0.01, 1000.0);
}

core::Result<Layout> read_bag(const std::filesystem::path& path, const TopicNames& names,
                              const LayoutOptions& options, core::Log& log) {
  const auto survey = survey_bag(path);
  if (!survey) return tl::unexpected(survey.error());
  for (const std::string& note : survey->notes) log.warning(note);
  const auto topics = choose_topics(*survey, names);
  if (!topics) return tl::unexpected(topics.error());
  log.info(fmt::format("{}: colour from {}, depth from {}", survey->path, topics->color.topic->topic.name,
                       topics->depth.topic->topic.name));

  // Pairing needs the camera's delay of depth
  auto camera = camera_of_bag(*survey, *topics, log);
  if (!camera) return tl::unexpected(camera.error());
  Layout layout;
  layout.format = survey->kind;
  layout.camera = std::move(*camera);

  // Both topics, in the order of stamps
  TopicImages color = images_in(*survey, *topics->color.topic, log);
  TopicImages depth = images_in(*survey, *topics->depth.topic, log);
  const auto color_stamps = stamps_of(color);
  const auto depth_stamps = stamps_of(depth);

  // The option replaces the camera's delay
  const double own_delay_s = layout.camera ? layout.camera->camera.depth_delay_s : 0.0;
  const double delay_s = options.depth_delay_s != 0.0 ? options.depth_delay_s : own_delay_s;
  layout.pairs = pair_by_stamp(color_stamps, depth_stamps, options.max_pair_gap_s, delay_s);

  // The two topics may not overlap in time
  if (layout.pairs.empty()) {
    if (color_stamps.empty() || depth_stamps.empty())
      return core::input_error(survey->path + ": no image of colour or depth can be read");
    return core::input_error(survey->path + ": " +
                             no_common_time(color.topic.name, color_stamps, depth.topic.name, depth_stamps,
                                            options.max_pair_gap_s));
  }

  // ROS's calibration does not tell the rate
  if (layout.camera && survey->camera_yaml.empty()) layout.camera->camera.fps = usual_fps(layout.pairs);
  if (options.body) layout.body = read_bag_body(*survey, *topics, log);
  layout.images = std::make_shared<BagImages>(*survey, std::move(color), std::move(depth));
  return layout;
}

}  // namespace plumbline::dataset
