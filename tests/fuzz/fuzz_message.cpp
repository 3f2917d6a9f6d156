// SPDX-License-Identifier: BSD-3-Clause
// Messages of bags: the first byte chooses the type and how it is serialized; or RVL, whose size is in two
// bytes more.
#include "bag_part/cdr.hpp"
#include "bag_part/ros1_messages.hpp"
#include "bags/images.hpp"
#include "bags/rvl.hpp"
#include "fuzz_target.hpp"

using namespace plumbline;
using namespace plumbline::dataset;

namespace {

constexpr std::size_t kMostMemory = std::size_t{1} << 29;  // an image of 134 megapixels, decoded

template <typename Message>
void check(const DecodedMessage<Message>& message) {
  fuzz::require(message.has_value() || !message.error().empty(), "what is refused is told");
}

template <typename Message>
void check_image(const DecodedMessage<Message>& message) {
  check(message);
  if (!message) return;
  const auto image = image_of(*message);
  fuzz::require(image.has_value() ? !image->empty() : !image.error().empty(),
                "an image, or why there is none");
}

void check_rvl(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return;
  const std::size_t pixels = std::size_t{data[0]} * data[1];
  const auto depths = decode_rvl(data + 2, size - 2, pixels);
  fuzz::require(!depths || depths->size() == pixels, "all pixels or none");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const fuzz::MemoryWatch watch;
  const MessageDecoder& decoder = (data[0] & 16U) != 0 ? ros1_decoder() : cdr_decoder();
  const Bytes bytes(data + 1, data + size);
  switch (data[0] & 7U) {
    case 0:
      check_image(decoder.image(bytes));
      break;
    case 1:
      check_image(decoder.compressed_image(bytes));
      break;
    case 2:
      check(decoder.camera_info(bytes));
      break;
    case 3:
      check(decoder.transforms(bytes));
      break;
    case 4:
      check(decoder.transform(bytes));
      break;
    case 5:
      check(decoder.number(bytes));
      break;
    default:
      check_rvl(data + 1, size - 1);
  }
  fuzz::require(watch.peak() < kMostMemory, "memory is bounded");
  return 0;
}
