// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A recording, whatever its layout: an indexed list of RGB-D pairs.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::dataset {

class MessageStream;

enum class ImageList : std::uint8_t { kColor, kDepth };

/// The place of an image in one of the two lists of a recording, in the order of the file that has them.
struct ImageId {
  ImageList list = ImageList::kColor;
  std::size_t number = 0;
};

struct PairInfo {
  double stamp = 0.0;        ///< stamp of colour, seconds
  double depth_stamp = 0.0;  ///< seconds; the camera's depth_delay_s is in it
  ImageId color;
  ImageId depth{ImageList::kDepth};
  int camera = -1;  ///< position among Layout::frame_cameras; -1: the recording's camera
};

/// An image as a recording has it: its pixels, and the bytes of its file where it has one.
struct StoredImage {
  std::string ending;  ///< extension of a file with these bytes: ".png", ".jpg" ...; "": only pixels
  std::vector<std::uint8_t> bytes;  ///< bytes of the file
  cv::Mat pixels;                   ///< as read_image gives them
  bool linked_out = false;          ///< a link in the recording's folder leads out of it to the file
  std::string name{};               ///< for messages
};

struct StoredPair {
  StoredImage color;
  StoredImage depth;
};

/// Remarks on a recording besides its frames.
struct RecordingNotes {
  std::size_t missing = 0;         ///< frames that it lists and that are not among size(): no files
  std::string doubt{};             ///< reason to doubt any map of it, such as depth in an unlikely unit; ""
  bool truth_is_odometry = false;  ///< truth() is the path from the recorder's own odometry
};

/// Read access to one recording. All const methods are thread-safe: frames may be decoded in parallel.
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
  /// The unprocessed images of a frame, for copies of the recording: with camera() they make the same frame.
  /// Both have pixels, of the camera's size. Errors (kInput) are about this frame only, as those of read(),
  /// or say that the source has no stored images.
  [[nodiscard]] virtual core::Result<StoredPair> stored(std::size_t /*index*/) const {
    return core::input_error(name() + ": has no stored images");
  }
  /// The same frames as taken by `better` instead of camera(), but still rectified into images of
  /// camera().color; null if the source cannot do that.
  [[nodiscard]] virtual std::unique_ptr<FrameSource> taken_by(const sensor::Camera& /*better*/) const {
    return nullptr;
  }
  /// Truth that comes with the recording, if any.
  [[nodiscard]] virtual std::optional<geometry::Trajectory> truth() const = 0;
  [[nodiscard]] virtual RecordingNotes notes() const { return {}; }

  [[nodiscard]] std::size_t missing() const { return notes().missing; }
  [[nodiscard]] std::string doubt() const { return notes().doubt; }
  [[nodiscard]] bool truth_is_odometry() const { return notes().truth_is_odometry; }
};

/// Use of the poses that come with a recording.
enum class PoseUse {
  kPrior,   ///< poses of the recorder's own odometry (a phone's) go to RgbdFrame::odometry
  kGiven,   ///< poses are used unchanged: the pipeline has no tracking
  kIgnore,  ///< poses are used for comparison only: truth() still has them
};

/// Topics of a bag; "" is found automatically.
struct TopicNames {
  std::string color;
  std::string depth;
  std::string info;        ///< sensor_msgs/CameraInfo of colour
  std::string depth_info;  ///< sensor_msgs/CameraInfo of a separate depth camera
  [[nodiscard]] bool any() const {
    return !(color.empty() && depth.empty() && info.empty() && depth_info.empty());
  }
};

/// Total size of the frames that may wait to be mapped, by default; what comes beyond is dropped.
inline constexpr std::size_t kMostWaitingBytes = std::size_t{1} << 30U;

/// Options of live sources.
struct LiveOptions {
  /// Opens the stream of an address, and sets the topics that the address names; empty: live sources are
  /// refused.
  std::function<core::Result<std::unique_ptr<MessageStream>>(const std::string& address, TopicNames& topics)>
      open;
  core::StopToken stop;                      ///< ends the source; numbered frames are still read
  double for_s = 1e300;                      ///< seconds after which it ends
  std::filesystem::path record;              ///< an MCAP file of the frames that were taken; "": none
  bool replace = false;                      ///< replace an existing file
  std::chrono::milliseconds patience{5000};  ///< time within which the first image must arrive
  std::size_t most_waiting_bytes = kMostWaitingBytes;
};

struct OpenOptions {
  std::string format = "auto";  ///< one of layout_names()
  std::string camera;           ///< shipped name or file; "" = camera.yaml in the folder
  std::filesystem::path cameras_folder;
  double max_pair_gap_s = 0.02;  ///< largest gap between colour and depth of a pair
  double from_s = 0.0;           ///< seconds after the first pair
  double to_s = 1e300;           ///< seconds after the first pair
  int every = 1;                 ///< every n-th pair
  PoseUse poses = PoseUse::kPrior;
  TopicNames topics;  ///< topics of a bag
  LiveOptions live;
};

/// "auto", and the layouts that open_recording knows.
std::vector<std::string> layout_names();

/// Opens a folder or a bag (MCAP, rosbag2's database, ROS 1). Without a camera file, or a CameraInfo in a
/// bag, the camera is a guess by the size of the images (Camera::guess; a warning), kUsage when no common
/// device takes such. Checks camera, lists and the depth scale (median depth of some frames outside 0.07-40
/// m: error; one sign that the scale is wrong: warning; two: FrameSource::doubt(); all name the depth_scale
/// that would fit).
core::Result<std::unique_ptr<FrameSource>> open_recording(const std::filesystem::path& folder,
                                                          const OpenOptions& options, core::Log& log);

}  // namespace plumbline::dataset
