// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Survey of a bag: its topics, their message counts and times, and the topics that hold images.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bags/messages.hpp"
#include "plumbline/dataset/bag.hpp"

namespace plumbline::dataset {

/// An image message, by its header.
struct ImageEntry {
  std::int64_t stamp_ns = 0;
  std::int64_t log_ns = 0;
  MessagePlace place;
};

constexpr std::size_t kFewMessages = 512;

struct SurveyedTopic {
  BagTopic topic;
  const MessageDecoder* decoder = nullptr;  ///< null: messages in an encoding that is not read
  std::size_t count = 0;
  std::int64_t first_ns = 0;  ///< when messages were logged
  std::int64_t last_ns = 0;
  std::vector<ImageEntry> images;    ///< all messages of an image topic, in the order of the bag
  std::vector<MessagePlace> others;  ///< the first few of other messages; all of those that tell of the body

  [[nodiscard]] bool is(const char* type) const { return topic.type == type; }
  [[nodiscard]] bool has_images() const {
    return is("sensor_msgs/Image") || is("sensor_msgs/CompressedImage");
  }
  /// Messages a second; 0 when there are fewer than two.
  [[nodiscard]] double rate() const;
};

struct BagSurvey {
  std::string path;  ///< as it was given
  std::string kind;  ///< "mcap", "db3", "bag"
  std::vector<std::shared_ptr<const BagFile>> files;
  std::vector<SurveyedTopic> topics;  ///< by name
  std::vector<std::string> notes;
  std::string camera_yaml;  ///< camera file that `plumbline convert` stored there; "": none

  [[nodiscard]] const SurveyedTopic* find(const std::string& name) const;
  /// The first message of a topic; errors name bag and topic.
  template <typename Message>
  core::Result<Message> first(const SurveyedTopic& topic,
                              DecodedMessage<Message> (*MessageDecoder::*decode)(const Bytes&)) const {
    const auto& places = topic.others;
    if (places.empty() && topic.images.empty())
      return core::input_error(path + ": " + topic.topic.name + ": has no message");
    return read(topic, places.empty() ? topic.images.front().place : places.front(), decode);
  }
  /// A decoded message; the error names its topic.
  template <typename Message>
  core::Result<Message> read(const SurveyedTopic& topic, const MessagePlace& place,
                             DecodedMessage<Message> (*MessageDecoder::*decode)(const Bytes&)) const {
    const auto bytes = files.at(place.file)->read(place);
    if (!bytes) return tl::unexpected(bytes.error());
    if (topic.decoder == nullptr)
      return core::input_error(path + ": " + topic.topic.name + ": messages in " + topic.topic.encoding);
    auto message = (topic.decoder->*decode)(*bytes);
    if (message) return std::move(*message);
    return core::input_error(path + ": a message of " + topic.topic.name + " " + message.error());
  }
};

/// Opens the bag and goes through it once; images themselves are not read. Error (kInput): cannot be read, or
/// holds no message.
core::Result<BagSurvey> survey_bag(const std::filesystem::path& path);

}  // namespace plumbline::dataset
