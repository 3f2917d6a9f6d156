// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The holders of a recording's images: files, a film, a bag, a container, or the queue of a live camera.
#include <array>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

/// Thread-safe.
class ImageSource {
 public:
  ImageSource() = default;
  virtual ~ImageSource() = default;
  ImageSource(const ImageSource&) = delete;
  ImageSource& operator=(const ImageSource&) = delete;

  /// The image as it is stored. Error (kInput): names it and the fault.
  [[nodiscard]] virtual core::Result<cv::Mat> read(ImageId id) = 0;
  /// The same, with the bytes of its file where it is stored as those.
  [[nodiscard]] virtual core::Result<StoredImage> stored(ImageId id);
  /// Name of an image in messages: "office/rgb/12.png", "office.mcap:/camera/color/image_raw#12".
  [[nodiscard]] virtual std::string describe(ImageId id) const = 0;
  /// The file of an image or of its film; empty: all images are in one file, or in none.
  [[nodiscard]] virtual std::filesystem::path file(ImageId /*id*/) const { return {}; }
  /// The same images for another reader, where each should go through them in order; null: they may share
  /// this.
  [[nodiscard]] virtual std::shared_ptr<ImageSource> opened_again() const { return nullptr; }
};

/// Images that have a file each.
class FileImages : public ImageSource {
 public:
  /// Adds a file to the end of a list. Before the first image is read.
  ImageId add(ImageList list, std::string file);
  [[nodiscard]] core::Result<cv::Mat> read(ImageId id) override;
  [[nodiscard]] core::Result<StoredImage> stored(ImageId id) override;
  [[nodiscard]] std::string describe(ImageId id) const override { return name_of(id); }
  [[nodiscard]] std::filesystem::path file(ImageId id) const override { return name_of(id); }

 protected:
  [[nodiscard]] const std::string& name_of(ImageId id) const {
    return files_.at(static_cast<std::size_t>(id.list)).at(id.number);
  }
  std::array<std::vector<std::string>, 2> files_;  ///< by list, with their folder in front
};

/// A file's bytes and pixels. Error (kInput): cannot be read, or is no image.
core::Result<StoredImage> stored_file(const std::string& file);

}  // namespace plumbline::dataset
