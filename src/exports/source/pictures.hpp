// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The pictures that a map was made of, from its recordings or its store.
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "plumbline/sensor/frame.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// One recording for each robot; of recordings that cannot be opened, the keyframes whose whole pictures the
/// map's store keeps, without depth. Frames are rectified with the map's latest version of the camera, into
/// the pinhole of RobotInfo::camera.
class Pictures {
 public:
  /// Opens the request's recordings, or else those the map was made from, or else the store's pictures, as
  /// long as the source lives. Errors (kInput): there are no pictures.
  static core::Result<Pictures> open(const MapSource& source);

  /// The recordings alone, as open() does. Errors (kInput): none is known, or one cannot be opened.
  static core::Result<Pictures> open_recordings(const MapSource& source);

  [[nodiscard]] std::vector<std::int32_t> robots() const;
  /// Pose of a robot's camera in its base, as its recording tells; none: it does not.
  [[nodiscard]] std::optional<geometry::Rigid3> body_from_camera(std::int32_t robot) const;
  /// Number of the frame with this stamp in the robot's recording; none: there is no such frame.
  [[nodiscard]] std::optional<std::size_t> find(std::int32_t robot, double stamp) const;
  /// The store's pictures have colour only. Errors (kInput): cannot be read.
  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::int32_t robot, std::size_t frame) const;
  /// True if the pictures are of the store: there is no depth.
  [[nodiscard]] bool stored() const { return reader_ != nullptr; }

 private:
  static Pictures open_stored(const maps::StoredRun& store);

  struct Recording {
    std::unique_ptr<dataset::FrameSource> given;
    std::unique_ptr<dataset::FrameSource> corrected;  ///< null: `given` is right
    std::vector<std::pair<double, std::size_t>> stamps;
  };
  std::map<std::int32_t, Recording> by_robot_;  ///< of stored pictures only the stamps are kept
  const maps::StoreReader* reader_ = nullptr;   ///< null: recordings are read
};

/// A picture of a model: its camera, pose and name.
struct Picture {
  ExportPose pose;
  std::string name;                  ///< "000001", several robots "r0_000001"
  std::optional<std::size_t> frame;  ///< in the recording; none: there is no picture
};

/// Which poses a model of pictures has: the keyframes; with --every tracked frames besides; with --sharpest
/// the sharpest frame near each keyframe. `pictures` may be null. In order, numbered from 1.
core::Result<std::vector<Picture>> pictures_of(const MapSource& source, const Pictures* pictures);

/// "17 pictures", or "17 poses, 3 pictures" where some have none.
std::string pictures_text(const std::vector<Picture>& pictures);

/// The recordings, or null with a note that says why.
std::unique_ptr<Pictures> open_pictures(const MapSource& source, ExportSummary& summary);

}  // namespace plumbline::exports
