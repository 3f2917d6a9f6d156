// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Recordings of k4arecorder (Azure Kinect): a Matroska file with a colour track, a depth track of 16 bits in
// millimetres, and the factory's calibration as an attachment.
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "images/container.hpp"
#include "images/image_decoders.hpp"
#include "images/image_source.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::dataset {

/// The camera of an Azure Kinect from its calibration (JSON), for a depth mode ("NFOV_UNBINNED" ...) and the
/// height of the colour images (720 ... 3072). Pixel (0, 0) is the centre of the top-left pixel. Errors
/// (kInput) say what is missing, or which mode or model is not known; they do not name the file.
core::Result<sensor::Camera> azure_kinect_camera(const std::string& calibration,
                                                 const std::string& depth_mode, int color_height);

/// The size of depth images of a mode; none when the mode is not known or has no depth.
std::optional<std::pair<int, int>> azure_depth_size(const std::string& depth_mode);

/// One open recording. Read best in order, or nearly so. Thread-safe.
class AzureKinectFile final : public ImageSource {
 public:
  /// Error (kInput): no recording of an Azure Kinect, or one without colour or depth; names the file.
  static core::Result<std::unique_ptr<AzureKinectFile>> open(const std::string& file);
  ~AzureKinectFile() override;

  [[nodiscard]] const sensor::Camera& camera() const { return camera_; }
  [[nodiscard]] const std::string& depth_mode() const { return depth_mode_; }
  [[nodiscard]] const std::string& color_mode() const { return color_mode_; }
  /// Stamps of a list's images, microseconds, in order.
  [[nodiscard]] const std::vector<std::int64_t>& stamps(ImageList list) const {
    return track_of({list}).stamps;
  }

  /// CV_8UC3 in BGR, or CV_16UC1.
  [[nodiscard]] core::Result<cv::Mat> read(ImageId id) override;
  [[nodiscard]] std::string describe(ImageId id) const override;

 private:
  struct Track {
    int number = -1;
    ContainerTrack info;
    std::vector<std::int64_t> stamps{};
  };
  AzureKinectFile(std::string file, const Demuxer& demuxer) : file_(std::move(file)), demuxer_(demuxer) {}
  [[nodiscard]] const Track& track_of(ImageId id) const {
    return id.list == ImageList::kColor ? color_ : depth_;
  }
  core::Result<void> understand(const ContainerContents& contents);
  /// Goes through the file once.
  void list_stamps();
  core::Result<Bytes> packet_of(const Track& track, std::int64_t stamp_us);
  [[nodiscard]] const ContainerPacket* passed(int track, std::int64_t stamp_us) const;
  void remember(ContainerPacket packet);

  std::string file_;
  const Demuxer& demuxer_;
  std::mutex mutex_;
  void* container_ = nullptr;
  Track color_;
  Track depth_;
  std::string color_mode_;
  std::string depth_mode_;
  sensor::Camera camera_;
  std::deque<ContainerPacket> recent_;  ///< packets of both tracks, because images are requested out of order
  std::int64_t at_us_ = -1;             ///< stamp of the last packet that was read; -1: none
};

}  // namespace plumbline::dataset
