// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A ROS bag as a list of messages, independent of its file format. MessageDecoders (messages.hpp) read the
// content of messages.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::dataset {

using Bytes = std::vector<std::uint8_t>;

/// Size above which a message is assumed to have a damaged length.
constexpr std::uint64_t kMostMessageBytes = std::uint64_t{1} << 28;
/// Bytes of each message that are available while a bag is scanned: a stamp and the beginning of the rest.
constexpr std::size_t kHeadBytes = 64;

struct BagTopic {
  std::string name;
  std::string type;      ///< "sensor_msgs/Image", without "/msg"
  std::string encoding;  ///< encoding of the messages: "cdr", "ros1", "json", "protobuf" ...
};

/// Location of a message in its file; only the file's reader can interpret the numbers.
struct MessagePlace {
  std::uint64_t at = 0;
  std::uint64_t offset = 0;
  std::uint32_t size = 0;  ///< stored bytes
  std::uint32_t file = 0;  ///< number of the file, in a bag of several files
};

/// A message found by a scan.
struct BagEntry {
  std::size_t topic = 0;  ///< position in topics()
  std::int64_t log_ns = 0;
  MessagePlace place;
  const std::uint8_t* head = nullptr;  ///< its first bytes, at most kHeadBytes; valid only during the visit
  std::size_t head_size = 0;
};

/// One bag. read() is thread-safe; scan() is called once, before it.
class BagFile {
 public:
  using Visit = std::function<void(const BagEntry&)>;

  virtual ~BagFile() = default;
  /// Visits every message in the order of the file. Damaged or missing parts are left out and reported by
  /// notes(). Error (kInput): nothing can be read.
  virtual core::Result<void> scan(const Visit& visit) = 0;
  /// A whole message. Errors (kInput) name the file and the place in it.
  [[nodiscard]] virtual core::Result<Bytes> read(const MessagePlace& place) const = 0;
  /// All topics that the scan found.
  [[nodiscard]] virtual const std::vector<BagTopic>& topics() const = 0;
  /// Remarks for the user, such as damaged parts; one sentence each.
  [[nodiscard]] virtual const std::vector<std::string>& notes() const = 0;
  /// The camera.yaml that `plumbline convert` stores with the messages; "" if there is none.
  [[nodiscard]] virtual std::string camera_yaml() const { return ""; }
};

using OpenedBag = core::Result<std::unique_ptr<BagFile>>;

}  // namespace plumbline::dataset
