// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Images that are messages, of a bag or of a network.
#include "bags/messages.hpp"
#include "images/image_source.hpp"

namespace plumbline::dataset {

class MessageImages : public ImageSource {
 public:
  [[nodiscard]] core::Result<cv::Mat> read(ImageId id) override;
  [[nodiscard]] core::Result<StoredImage> stored(ImageId id) override;

 protected:
  struct Message {
    bool raw = true;  ///< sensor_msgs/Image, else CompressedImage
    const MessageDecoder* decoder = nullptr;
    Bytes bytes;
  };
  /// Error (kInput): there is no such message, or it cannot be read.
  [[nodiscard]] virtual core::Result<Message> message_of(ImageId id) const = 0;
};

}  // namespace plumbline::dataset
