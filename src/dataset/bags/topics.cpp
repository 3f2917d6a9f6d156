// SPDX-License-Identifier: BSD-3-Clause
#include "bags/topics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <tuple>

#include "bags/images.hpp"

namespace plumbline::dataset {
namespace {

std::string last_of(const std::string& name) { return name.substr(name.rfind('/') + 1); }

std::string parent_of(const std::string& name) {
  const std::size_t slash = name.rfind('/');
  return slash == std::string::npos ? "" : name.substr(0, slash);
}

/// Without the transport at its end: /camera/image and /camera/image/compressed are one image.
std::string image_name(const std::string& topic) {
  constexpr std::array<const char*, 5> kTransports = {"compressed", "compressedDepth", "zstd", "theora",
                                                      "data"};
  const std::string last = last_of(topic);
  const bool transported = std::any_of(kTransports.begin(), kTransports.end(),
                                       [&last](const char* transport) { return last == transport; });
  return transported ? parent_of(topic) : topic;
}

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

bool is_infrared(const std::string& topic) {
  return contains(topic, "infra") || contains(topic, "/ir/") || contains(topic, "/ir_") ||
         contains(topic, "_ir/") || contains(topic, "Infrared");
}

/// True if the name says that the driver registered depth to the colour camera.
bool named_aligned(const std::string& topic) {
  return contains(topic, "aligned_depth") || contains(topic, "registered") ||
         contains(topic, "depth_to_color") || contains(topic, "depth_to_rgb");
}

/// Number of leading parts that two topic names have in common.
std::size_t common_parts(const std::string& a, const std::string& b) {
  std::size_t parts = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()) && a[i] == b[i]; ++i) parts += a[i] == '/' ? 1 : 0;
  return parts;
}

struct Candidate {
  const SurveyedTopic* topic = nullptr;
  std::string encoding;
  bool depth = false;
};

std::string names_of(const std::vector<Candidate>& candidates) {
  std::string names;
  for (const Candidate& candidate : candidates)
    names += (names.empty() ? "" : ", ") + candidate.topic->topic.name;
  return names;
}

/// The encoding of an image topic's first message that can be read; "" when none can.
std::string encoding_of_topic(const BagSurvey& survey, const SurveyedTopic& topic) {
  constexpr std::size_t kTries = 5;
  for (std::size_t i = 0; i < std::min(kTries, topic.images.size()); ++i) {
    const MessagePlace& place = topic.images[i].place;
    if (topic.is("sensor_msgs/Image")) {
      if (const auto message = survey.read(topic, place, &MessageDecoder::image)) return message->encoding;
    } else if (const auto message = survey.read(topic, place, &MessageDecoder::compressed_image)) {
      return message->format.empty() ? "unnamed" : message->format;
    }
  }
  return "";
}

/// All topics with images of a known encoding.
std::vector<Candidate> image_topics(const BagSurvey& survey) {
  std::vector<Candidate> candidates;
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.images.empty()) continue;
    const std::string encoding = encoding_of_topic(survey, topic);
    if (encoding.empty()) continue;
    const bool depth = is_depth_encoding(encoding) || is_compressed_depth(encoding);
    candidates.push_back({&topic, encoding, depth});
  }
  return candidates;
}

/// Keeps one transport of each image: the first raw one, or else the one with most messages.
std::vector<Candidate> one_of_each_image(const std::vector<Candidate>& candidates) {
  std::vector<Candidate> kept;
  for (const Candidate& candidate : candidates) {
    const auto same = std::find_if(kept.begin(), kept.end(), [&candidate](const Candidate& other) {
      return image_name(other.topic->topic.name) == image_name(candidate.topic->topic.name);
    });
    const auto better = [](const Candidate& a, const Candidate& b) {
      const bool a_raw = a.topic->is("sensor_msgs/Image");
      const bool b_raw = b.topic->is("sensor_msgs/Image");
      return std::tie(a_raw, a.topic->count) > std::tie(b_raw, b.topic->count);
    };
    if (same == kept.end()) {
      kept.push_back(candidate);
    } else if (better(candidate, *same)) {
      *same = candidate;
    }
  }
  return kept;
}

std::vector<Candidate> those(const std::vector<Candidate>& of,
                             const std::function<bool(const Candidate&)>& that) {
  std::vector<Candidate> kept;
  std::copy_if(of.begin(), of.end(), std::back_inserter(kept), that);
  return kept;
}

core::Result<ChosenTopic> named_image(const BagSurvey& survey, const std::string& name, const char* option) {
  const SurveyedTopic* topic = survey.find(name);

  // The error lists the existing topics
  if (topic == nullptr) {
    std::string list;
    for (const SurveyedTopic& each : survey.topics) list += (list.empty() ? "" : ", ") + each.topic.name;
    return core::usage_error(
        fmt::format("--topic {}={}: {} has no such topic (it has: {})", option, name, survey.path, list));
  }
  if (!topic->has_images() || topic->decoder == nullptr) {
    return core::usage_error(
        fmt::format("--topic {}={}: is of {} in {}; sensor_msgs/Image or CompressedImage is needed", option,
                    name, topic->topic.type, topic->topic.encoding));
  }
  return ChosenTopic{topic, "named by --topic", encoding_of_topic(survey, *topic)};
}

/// Reason why there is no image of that kind.
std::string none_of(const BagSurvey& survey, const char* what) {
  for (const SurveyedTopic& topic : survey.topics) {
    const bool image = contains(topic.topic.type, "Image");
    if (image && topic.decoder == nullptr && topic.count > 0) {
      return fmt::format(
          "{}: {} is in {}, which is not read (read: cdr, ros1); record it with ROS, or write the images to "
          "a folder as docs/guide/inputs.md says",
          survey.path, topic.topic.name, topic.topic.encoding);
    }
  }
  std::string list;
  for (const SurveyedTopic& topic : survey.topics)
    list += fmt::format("{}{} ({}, {} messages)", list.empty() ? "" : ", ", topic.topic.name,
                        topic.topic.type, topic.count);
  return fmt::format("{}: holds no {} image (sensor_msgs/Image or CompressedImage); it has: {}", survey.path,
                     what, list);
}

core::Result<ChosenTopic> choose_depth(const BagSurvey& survey, const std::vector<Candidate>& images) {
  const auto depths = one_of_each_image(
      those(images, [](const Candidate& c) { return c.depth && !is_infrared(c.topic->topic.name); }));
  if (depths.empty()) return core::input_error(none_of(survey, "depth"));
  if (depths.size() == 1)
    return ChosenTopic{depths.front().topic, "the only depth image", depths.front().encoding};

  // Cameras may publish raw and aligned depth
  const auto aligned = those(depths, [](const Candidate& c) { return named_aligned(c.topic->topic.name); });
  if (aligned.size() == 1) {
    return ChosenTopic{aligned.front().topic, "the only depth image that is aligned to colour by its name",
                       aligned.front().encoding};
  }
  return core::usage_error(fmt::format("{}: has {} depth images: {}; name one with --topic depth={}",
                                       survey.path, depths.size(), names_of(depths),
                                       depths.front().topic->topic.name));
}

core::Result<ChosenTopic> choose_color(const BagSurvey& survey, const std::vector<Candidate>& images,
                                       const std::string& depth) {
  auto colors = one_of_each_image(
      those(images, [](const Candidate& c) { return !c.depth && !is_infrared(c.topic->topic.name); }));
  if (colors.empty()) colors = one_of_each_image(those(images, [](const Candidate& c) { return !c.depth; }));
  if (colors.empty()) return core::input_error(none_of(survey, "colour"));
  if (colors.size() == 1)
    return ChosenTopic{colors.front().topic, "the only colour image", colors.front().encoding};

  // Colour before grey, depth's own camera before others, undistorted before distorted images
  const auto rank = [&depth](const Candidate& c) {
    const std::string& name = c.topic->topic.name;
    const bool colored = !contains(c.encoding, "mono") && c.encoding != "8UC1";
    const bool named = contains(name, "color") || contains(name, "rgb");
    return std::tuple(colored, named, common_parts(name, depth), contains(name, "rect"));
  };

  std::stable_sort(colors.begin(), colors.end(),
                   [&](const Candidate& a, const Candidate& b) { return rank(a) > rank(b); });
  if (rank(colors[0]) != rank(colors[1])) {
    return ChosenTopic{colors.front().topic,
                       "of several colour images the one of depth's camera, by its name",
                       colors.front().encoding};
  }

  return core::usage_error(fmt::format("{}: has {} colour images: {}; name one with --topic color={}",
                                       survey.path, colors.size(), names_of(colors),
                                       colors.front().topic->topic.name));
}

/// The CameraInfo of an image: the one in its namespace, or the one with the most similar name.
core::Result<ChosenTopic> choose_info(const BagSurvey& survey, const std::string& image,
                                      const std::string& named, const char* option) {
  // CameraInfo that can be decoded
  std::vector<const SurveyedTopic*> infos;
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.is("sensor_msgs/CameraInfo") && topic.count > 0 && topic.decoder != nullptr)
      infos.push_back(&topic);
  }

  // The user's choice comes first
  if (!named.empty()) {
    for (const SurveyedTopic* topic : infos) {
      if (topic->topic.name == named) return ChosenTopic{topic, "named by --topic", ""};
    }
    return core::usage_error(fmt::format("--topic {}={}: {} has no such topic with sensor_msgs/CameraInfo",
                                         option, named, survey.path));
  }
  if (infos.empty()) return ChosenTopic{};

  // ROS's convention: camera_info in the image's namespace
  const std::string beside = parent_of(image_name(image)) + "/camera_info";
  for (const SurveyedTopic* topic : infos) {
    if (topic->topic.name == beside) return ChosenTopic{topic, "beside the image", ""};
  }

  if (infos.size() == 1) return ChosenTopic{infos.front(), "the only CameraInfo", ""};

  // The most similar name, if it is unique
  std::stable_sort(infos.begin(), infos.end(), [&image](const SurveyedTopic* a, const SurveyedTopic* b) {
    return common_parts(a->topic.name, image) > common_parts(b->topic.name, image);
  });
  if (common_parts(infos[0]->topic.name, image) > common_parts(infos[1]->topic.name, image))
    return ChosenTopic{infos.front(), "nearest to the image by its name", ""};
  return ChosenTopic{};
}

}  // namespace

core::Result<ChosenTopics> choose_topics(const BagSurvey& survey, const TopicNames& named) {
  const std::vector<Candidate> images = image_topics(survey);
  ChosenTopics chosen;

  // The depth topic decides which colour fits
  auto depth = named.depth.empty() ? choose_depth(survey, images) : named_image(survey, named.depth, "depth");
  if (!depth) return tl::unexpected(depth.error());
  chosen.depth = *depth;
  auto color = named.color.empty() ? choose_color(survey, images, chosen.depth.topic->topic.name)
                                   : named_image(survey, named.color, "color");
  if (!color) return tl::unexpected(color.error());
  chosen.color = *color;

  // Calibrations belong to the chosen images
  auto info = choose_info(survey, chosen.color.topic->topic.name, named.info, "info");
  if (!info) return tl::unexpected(info.error());
  chosen.info = *info;
  auto depth_info = choose_info(survey, chosen.depth.topic->topic.name, named.depth_info, "depth_info");
  if (!depth_info) return tl::unexpected(depth_info.error());
  chosen.depth_info = *depth_info;
  return chosen;
}

}  // namespace plumbline::dataset
