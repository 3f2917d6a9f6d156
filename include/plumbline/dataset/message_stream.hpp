// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// ROS messages received and sent over a network of any kind: plumbline::net implements ROS 2's.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::dataset {

struct StreamTopic {
  std::string name;       ///< "/camera/color/image_raw"
  std::string type;       ///< "sensor_msgs/Image", without "/msg"
  bool supported = true;  ///< messages of the type can be received
};

struct StreamMessage {
  std::string topic;
  std::int64_t received_ns = 0;     ///< since 1970
  std::vector<std::uint8_t> bytes;  ///< CDR with the four bytes in front that name its kind
};

/// Published messages. Used by one thread at a time.
class MessageStream {
 public:
  virtual ~MessageStream() = default;
  /// All that is published and seen so far, by name.
  virtual std::vector<StreamTopic> topics() = 0;
  /// Makes next() return messages of the topic from now on. Error (kInput): it is not published in a known
  /// type.
  virtual core::Result<void> subscribe(const std::string& topic) = 0;
  virtual void unsubscribe(const std::string& topic) = 0;
  /// The next message of any topic; none if none arrives in time.
  virtual std::optional<StreamMessage> next(std::chrono::milliseconds most) = 0;
  /// Number of messages that arrived too fast for next(), or that the network reported as lost.
  [[nodiscard]] virtual std::size_t lost() const = 0;
};

enum class Retention {
  kPassing,  ///< for present subscribers
  kLatest,   ///< late subscribers get the latest one, too
};

/// Receiver of messages. Used by one thread at a time.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  /// Says that messages of the topic will come, so that listeners find it. `type`: "sensor_msgs/Image".
  /// Error (kUsage): the network refuses it.
  virtual core::Result<void> announce(const std::string& topic, const std::string& type,
                                      Retention retention) = 0;
  /// Sends a message of an announced topic. Waits for slow listeners, two seconds at most.
  virtual core::Result<void> send(const std::string& topic, const std::vector<std::uint8_t>& bytes) = 0;
  /// Number of current listeners to the topic.
  virtual std::size_t listeners(const std::string& topic) = 0;
  /// Waits until subscribers have all sent messages, at most this long.
  virtual void flush(std::chrono::milliseconds most) = 0;
};

}  // namespace plumbline::dataset
