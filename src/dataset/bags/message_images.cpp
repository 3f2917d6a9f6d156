// SPDX-License-Identifier: BSD-3-Clause
#include "bags/message_images.hpp"

#include <utility>

#include "bags/images.hpp"
#include "images/image_decoders.hpp"

namespace plumbline::dataset {

core::Result<cv::Mat> MessageImages::read(ImageId id) {
  const auto found = message_of(id);
  if (!found) return tl::unexpected(found.error());
  MessageImage image = tl::unexpected<std::string>("");

  // Raw and compressed images are different messages
  if (found->raw) {
    const auto message = found->decoder->image(found->bytes);
    image = message ? image_of(*message) : tl::unexpected(message.error());
  } else {
    const auto message = found->decoder->compressed_image(found->bytes);
    image = message ? image_of(*message) : tl::unexpected(message.error());
  }
  if (image) return std::move(*image);
  return core::input_error(describe(id) + ": " + image.error());
}

core::Result<StoredImage> MessageImages::stored(ImageId id) {
  const auto found = message_of(id);
  if (!found) return tl::unexpected(found.error());
  StoredImage stored;

  // Files of PNG and JPEG are copied unchanged
  if (!found->raw) {
    const auto message = found->decoder->compressed_image(found->bytes);
    const bool file = message && !is_compressed_depth(message->format);
    if (file && (is_png(message->data) || is_jpeg(message->data))) {
      stored.ending = is_png(message->data) ? ".png" : ".jpg";
      stored.bytes = message->data;
    }
  }

  // All others are stored as pixels
  auto pixels = stored.bytes.empty() ? read(id) : decode_image(describe(id), stored.bytes);
  if (!pixels) return tl::unexpected(pixels.error());
  stored.pixels = std::move(*pixels);
  return stored;
}

}  // namespace plumbline::dataset
