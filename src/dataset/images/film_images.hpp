// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Colour in a film, depth in files.
#include <string>

#include "images/image_source.hpp"
#include "images/video_frames.hpp"

namespace plumbline::dataset {

/// The number of a colour image is that of its frame in the film.
class FilmImages final : public FileImages {
 public:
  explicit FilmImages(std::string film) : film_(std::move(film)), video_(film_) {}

  [[nodiscard]] core::Result<cv::Mat> read(ImageId id) override {
    return filmed(id) ? video_.read(static_cast<std::int64_t>(id.number)) : FileImages::read(id);
  }
  [[nodiscard]] core::Result<StoredImage> stored(ImageId id) override {
    return filmed(id) ? ImageSource::stored(id) : FileImages::stored(id);
  }
  [[nodiscard]] std::string describe(ImageId id) const override {
    return filmed(id) ? film_ + "#" + std::to_string(id.number) : name_of(id);
  }
  [[nodiscard]] std::filesystem::path file(ImageId id) const override {
    return filmed(id) ? film_ : name_of(id);
  }
  [[nodiscard]] std::shared_ptr<ImageSource> opened_again() const override {
    auto again = std::make_shared<FilmImages>(film_);
    again->files_ = files_;
    return again;
  }

 private:
  static bool filmed(ImageId id) { return id.list == ImageList::kColor; }

  std::string film_;
  VideoFrames video_;
};

}  // namespace plumbline::dataset
