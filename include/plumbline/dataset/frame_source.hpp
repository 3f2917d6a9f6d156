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

/// Where an image is: its place in one of the lists of what holds the images, in the order of that.
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

/// Counts of a live source's images.
struct LiveReport {
  std::size_t taken = 0;       ///< frames
  std::size_t dropped = 0;     ///< frames that arrived while too many waited
  std::size_t backwards = 0;   ///< frames whose stamp was not later than the last one's
  std::size_t unpaired = 0;    ///< images of either kind without one of the other near them
  std::size_t lost = 0;        ///< messages that the network reported as lost
  std::size_t kept = 0;        ///< frames whose images were kept, to be read once more
  std::size_t kept_bytes = 0;  ///< of these, packed
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
  /// Number of frames that the recording lists and that are not among size(): their files do not exist.
  [[nodiscard]] virtual std::size_t missing() const { return 0; }
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
  /// True if frames arrive while others are read: size() grows, and the final number of frames is not known.
  [[nodiscard]] virtual bool live() const { return false; }
  /// For a live source: waits, at most so long, until decided(index).
  virtual void wait_for(std::size_t /*index*/, std::chrono::milliseconds /*most*/) const {}
  /// For a live source: true if frame `index` can be read, or if it is known that no such frame will come.
  [[nodiscard]] virtual bool decided(std::size_t /*index*/) const { return true; }
  /// For a live source: keeps frame `index`, one of the latest 256 or so, so that it can be read again;
  /// others are released.
  virtual void keep(std::size_t /*index*/) const {}
  /// For a live source: frame `index` is no longer needed; it can be read again only if it was kept.
  virtual void release(std::size_t /*index*/) const {}
  /// True if frame `index`, which has been read, is the last one. A live source may wait until that is known,
  /// or until `stop`: then it is false.
  [[nodiscard]] virtual bool is_last(std::size_t index, const core::StopToken& /*stop*/) const {
    return index + 1 == size();
  }
  /// For a live source: true if the result is not needed any more.
  [[nodiscard]] virtual bool given_up() const { return false; }
  /// For a live source: ends it and the files that it writes itself. Error (kOutput): the record.
  [[nodiscard]] virtual core::Result<void> finish() const { return {}; }
  /// Report of a live source that has ended.
  [[nodiscard]] virtual LiveReport report() const { return {}; }
  /// Reason to doubt any map of this recording, such as depth in an unlikely unit; "" if there is none.
  [[nodiscard]] virtual std::string doubt() const { return ""; }
  /// Truth that comes with the recording, if any.
  [[nodiscard]] virtual std::optional<geometry::Trajectory> truth() const = 0;
  /// True if truth() is the path from the recorder's own odometry.
  [[nodiscard]] virtual bool truth_is_odometry() const { return false; }
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
  std::size_t most_waiting_bytes = std::size_t{1024} << 20U;  ///< total size of waiting messages
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
