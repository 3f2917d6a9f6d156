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

#include "films/container.hpp"
#include "images/image_decoders.hpp"
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
class AzureKinectFile {
 public:
  /// Error (kInput): no recording of an Azure Kinect, or one without colour or depth; names the file.
  static core::Result<std::unique_ptr<AzureKinectFile>> open(const std::string& file);
  ~AzureKinectFile();
  AzureKinectFile(const AzureKinectFile&) = delete;
  AzureKinectFile& operator=(const AzureKinectFile&) = delete;

  [[nodiscard]] const sensor::Camera& camera() const { return camera_; }
  [[nodiscard]] const std::string& depth_mode() const { return depth_mode_; }
  [[nodiscard]] const std::string& color_mode() const { return color_mode_; }
  /// Stamps, microseconds, of all images of colour and of depth, in the order of the file.
  struct Stamps {
    std::vector<std::int64_t> color;
    std::vector<std::int64_t> depth;
  };
  /// Goes through the file once.
  [[nodiscard]] Stamps stamps();
  /// The image with a stamp: CV_8UC3 in BGR, or CV_16UC1. Error (kInput): it is not there or damaged.
  core::Result<cv::Mat> color(std::int64_t stamp_us);
  core::Result<cv::Mat> depth(std::int64_t stamp_us);

  /// "FILE.mkv#depth@33333": the name of an image, used in pairs instead of a file.
  [[nodiscard]] std::string name_of(bool depth, std::int64_t stamp_us) const;
  /// The image of such a name; none for names of another kind.
  std::optional<core::Result<cv::Mat>> read(const std::string& name);

 private:
  struct Track {
    int number = -1;
    ContainerTrack info;
  };
  AzureKinectFile(std::string file, const Demuxer& demuxer) : file_(std::move(file)), demuxer_(demuxer) {}
  core::Result<void> understand(const ContainerContents& contents);
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
