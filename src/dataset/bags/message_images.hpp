// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Images that are messages, of a bag or of a network.
#include <string>

#include "bags/messages.hpp"
#include "layout.hpp"

namespace plumbline::dataset {

class MessageImages : public ImageStore {
 public:
  [[nodiscard]] core::Result<cv::Mat> image(const std::string& name) const override;
  [[nodiscard]] core::Result<StoredImage> stored(const std::string& name) const override;

 protected:
  struct Place {
    bool raw = true;  ///< sensor_msgs/Image, else CompressedImage
    const MessageDecoder* decoder = nullptr;
    Bytes bytes;
  };
  /// The message of that name. Error (kInput): there is none, or it cannot be read.
  [[nodiscard]] virtual core::Result<Place> place_of(const std::string& name) const = 0;
};

}  // namespace plumbline::dataset
