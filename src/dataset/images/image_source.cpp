// SPDX-License-Identifier: BSD-3-Clause
#include "images/image_source.hpp"

#include <utility>

#include "plumbline/dataset/image_io.hpp"

namespace plumbline::dataset {

core::Result<StoredImage> ImageSource::stored(ImageId id) {
  auto pixels = read(id);
  if (!pixels) return tl::unexpected(pixels.error());
  StoredImage image;
  image.pixels = std::move(*pixels);
  return image;
}

ImageId FileImages::add(ImageList list, std::string file) {
  std::vector<std::string>& files = files_.at(static_cast<std::size_t>(list));
  files.push_back(std::move(file));
  return {list, files.size() - 1};
}

core::Result<cv::Mat> FileImages::read(ImageId id) { return read_image(name_of(id)); }

core::Result<StoredImage> FileImages::stored(ImageId id) { return stored_file(name_of(id)); }

}  // namespace plumbline::dataset
