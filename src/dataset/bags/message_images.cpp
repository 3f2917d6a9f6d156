// SPDX-License-Identifier: BSD-3-Clause
#include "bags/message_images.hpp"

#include <utility>

#include "bags/images.hpp"
#include "images/image_decoders.hpp"

namespace plumbline::dataset {

core::Result<cv::Mat> MessageImages::image(const std::string& name) const {
  const auto place = place_of(name);
  if (!place) return tl::unexpected(place.error());
  MessageImage image = tl::unexpected<std::string>("");
  if (place->raw) {
    const auto message = place->decoder->image(place->bytes);
    image = message ? image_of(*message) : tl::unexpected(message.error());
  } else {
    const auto message = place->decoder->compressed_image(place->bytes);
    image = message ? image_of(*message) : tl::unexpected(message.error());
  }
  if (image) return std::move(*image);
  return core::input_error(name + ": " + image.error());
}

core::Result<StoredImage> MessageImages::stored(const std::string& name) const {
  const auto place = place_of(name);
  if (!place) return tl::unexpected(place.error());
  StoredImage stored;
  if (!place->raw) {
    const auto message = place->decoder->compressed_image(place->bytes);
    const bool file = message && !is_compressed_depth(message->format);
    if (file && (is_png(message->data) || is_jpeg(message->data))) {
      stored.ending = is_png(message->data) ? ".png" : ".jpg";
      stored.bytes = message->data;
    }
  }
  auto pixels = stored.bytes.empty() ? image(name) : decode_image(name, stored.bytes);
  if (!pixels) return tl::unexpected(pixels.error());
  stored.pixels = std::move(*pixels);
  return stored;
}

}  // namespace plumbline::dataset
