// SPDX-License-Identifier: BSD-3-Clause
// Bags of all kinds: MCAP, databases of rosbag2, ROS 1. What is in them is read and decoded as a recording
// would.
#include <algorithm>

#include "bag_part/cdr.hpp"
#include "bag_part/open_bag.hpp"
#include "bag_part/ros1_messages.hpp"
#include "bags/images.hpp"
#include "fuzz_target.hpp"

using namespace plumbline;
using namespace plumbline::dataset;

namespace {

constexpr std::size_t kMostMemory = std::size_t{1}
                                    << 30;  // a chunk that is packed well may be of half of this
constexpr std::size_t kMostMessages = 64;

void decode(const BagTopic& topic, const Bytes& bytes) {
  const MessageDecoder& decoder = topic.encoding == "ros1" ? ros1_decoder() : cdr_decoder();
  if (topic.type == "sensor_msgs/Image") {
    if (const auto message = decoder.image(bytes)) (void)image_of(*message);
  } else if (topic.type == "sensor_msgs/CompressedImage") {
    if (const auto message = decoder.compressed_image(bytes)) (void)image_of(*message);
  } else if (topic.type == "sensor_msgs/CameraInfo") {
    (void)decoder.camera_info(bytes);
  } else if (topic.type == "tf2_msgs/TFMessage") {
    (void)decoder.transforms(bytes);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::InputFile file(data, size, ".bag");
  const fuzz::MemoryWatch watch;
  const std::string name = file.path().filename().string();
  const auto bag = open_bag_file(file.path());
  if (!bag) {
    fuzz::require_message(bag.error().message, name);
    return 0;
  }
  std::vector<std::pair<std::size_t, MessagePlace>> places;
  const auto scanned = (*bag)->scan([&places](const BagEntry& entry) {
    fuzz::require(entry.head_size <= kHeadBytes, "no more than the head of a message is shown");
    (void)cdr_decoder().stamp(entry.head, entry.head_size);
    if (places.size() < kMostMessages) places.emplace_back(entry.topic, entry.place);
  });
  if (!scanned) fuzz::require_message(scanned.error().message, name);
  for (const auto& [topic, place] : places) {
    fuzz::require(topic < (*bag)->topics().size(), "messages are of a topic");
    const auto bytes = (*bag)->read(place);
    if (bytes) {
      decode((*bag)->topics()[topic], *bytes);
    } else {
      fuzz::require_message(bytes.error().message, name);
    }
  }
  fuzz::require(watch.peak() < kMostMemory, "memory is bounded");
  return 0;
}
