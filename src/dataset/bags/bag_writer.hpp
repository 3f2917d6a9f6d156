// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A new bag, written message by message.
#include <string>
#include <vector>

#include "bags/messages.hpp"

namespace plumbline::dataset {

/// Writes a bag. The file appears whole, with finish(), or not at all; errors (kOutput) are returned there.
/// Memory does not grow with the number of messages.
class BagWriter {
 public:
  virtual ~BagWriter() = default;
  /// Logged at the message's own stamp.
  virtual void write(const std::string& topic, const ImageMessage& message) = 0;
  virtual void write(const std::string& topic, const CompressedImageMessage& message) = 0;
  virtual void write(const std::string& topic, const CameraInfoMessage& message) = 0;
  virtual void write(const std::string& topic, const std::vector<TransformMessage>& transforms,
                     std::int64_t stamp_ns) = 0;
  /// Writes a message of one of these types unchanged; `type`: "sensor_msgs/msg/Image".
  virtual void write_bytes(const std::string& topic, const std::string& type, std::int64_t log_ns,
                           const Bytes& cdr) = 0;
  /// Stores the camera file with the messages, for what these cannot express.
  virtual void write_camera_yaml(const std::string& text) = 0;
  virtual core::Result<void> finish() = 0;
};

}  // namespace plumbline::dataset
