// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A recording, whatever its layout: an indexed list of RGB-D pairs.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::dataset {

struct PairInfo {
  double stamp = 0.0;        ///< of colour, seconds
  double depth_stamp = 0.0;  ///< seconds; the camera's depth_delay_s is in it
  std::string color_file;    ///< for messages; empty when there is no file
  std::string depth_file;
  int camera = -1;  ///< position among Layout::frame_cameras; -1: the recording's camera
};

/// An image as a recording has it: the bytes of a file, or pixels.
struct StoredImage {
  std::string ending;               ///< of a file with such bytes: ".png", ".jpg" ...; "": there are pixels
  std::vector<std::uint8_t> bytes;  ///< of the file
  cv::Mat pixels;                   ///< as read_image gives them
};

struct StoredPair {
  StoredImage color;
  StoredImage depth;
};

/// Read access to one recording. All const methods are thread-safe: frames may be decoded side by side.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  [[nodiscard]] virtual const std::string& name() const = 0;  ///< short, e.g. the folder's name
  [[nodiscard]] virtual const std::string& format()
      const = 0;  ///< one of layout_names(), "mcap", "db3", "bag" or "synth"
  [[nodiscard]] virtual const sensor::Camera& camera() const = 0;
  [[nodiscard]] virtual std::size_t size() const = 0;
  [[nodiscard]] virtual PairInfo info(std::size_t index) const = 0;
  /// Decoded, rectified, depth in metres, gray filled in. An error is about this frame only: skip it.
  [[nodiscard]] virtual core::Result<sensor::RgbdFrame> read(std::size_t index) const = 0;
  /// The images of a frame before anything was done to them, for copies of the recording: with camera() they
  /// make the same frame. Error (kInput): about this frame only; or that the source has none.
  [[nodiscard]] virtual core::Result<StoredPair> stored(std::size_t /*index*/) const {
    return core::input_error(name() + ": has no stored images");
  }
  /// The same frames as taken by `better` in the place of camera(), rectified into images of camera().color
  /// all the same; null when the source cannot.
  [[nodiscard]] virtual std::unique_ptr<FrameSource> taken_by(const sensor::Camera& /*better*/) const {
    return nullptr;
  }
  /// What makes a map of it doubtful whatever comes out, such as depth in an unlikely unit; "" if nothing.
  [[nodiscard]] virtual std::string doubt() const { return ""; }
  /// Truth that comes with the recording, if any.
  [[nodiscard]] virtual std::optional<geometry::Trajectory> truth() const = 0;
  /// Whether truth() is what the recorder's own odometry said.
  [[nodiscard]] virtual bool truth_is_odometry() const { return false; }
};

/// What poses are used for that come with a recording.
enum class PoseUse {
  kPrior,   ///< frames have those of the recorder's own odometry (a phone's): RgbdFrame::odometry
  kGiven,   ///< they are taken as they are: the pipeline has no tracking
  kIgnore,  ///< for nothing but comparison: truth() has them all the same
};

/// Topics of a bag; "" is found by itself.
struct TopicNames {
  std::string color;
  std::string depth;
  std::string info;        ///< sensor_msgs/CameraInfo of colour
  std::string depth_info;  ///< of depth, where that has a camera of its own
  [[nodiscard]] bool any() const {
    return !(color.empty() && depth.empty() && info.empty() && depth_info.empty());
  }
};

struct OpenOptions {
  std::string format = "auto";  ///< one of layout_names()
  std::string camera;           ///< shipped name or file; "" = camera.yaml in the folder
  std::filesystem::path cameras_folder;
  double max_pair_gap_s = 0.02;  ///< colour and depth further apart are no pair
  double from_s = 0.0;           ///< seconds after the first pair
  double to_s = 1e300;           ///< seconds after the first pair
  int every = 1;                 ///< every n-th pair
  PoseUse poses = PoseUse::kPrior;
  TopicNames topics;  ///< of bags
};

/// "auto", and the layouts that open_recording knows.
std::vector<std::string> layout_names();

/// Opens a folder or a bag (MCAP, rosbag2's database, ROS 1). Without a camera file, or a CameraInfo in a
/// bag, the camera is a guess by the size of the images (Camera::guess; a warning), kUsage when no common
/// device takes such. Checks camera, lists and the depth scale (median depth of some frames outside 0.35-20
/// m: error; outside 0.7-7 m, or a tenth of the depths beyond the 10 m that depth cameras reach: warning;
/// both name the depth_scale that would fit).
core::Result<std::unique_ptr<FrameSource>> open_recording(const std::filesystem::path& folder,
                                                          const OpenOptions& options, core::Log& log);

}  // namespace plumbline::dataset
