// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Finds the pairs of a recording on disk, with one function per layout. A bag's Layout is made by read_bag
// (bags/bag_recording.hpp).
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "images/image_source.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/body_readings.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::dataset {

struct Layout {
  std::string format;
  std::vector<PairInfo> pairs{};          ///< sorted by colour stamp
  std::shared_ptr<ImageSource> images{};  ///< where the images are
  std::optional<geometry::Trajectory> truth{};
  /// Folder of masks named as the depth images, 0 where there is no measurement; "": none.
  std::string confidence{};
  int color_reduction = 1;  ///< colour images are made smaller by this factor while reading
  /// Camera from the recording's own description, for when no camera file is named or found.
  std::optional<sensor::CameraReading> camera{};
  /// The pinhole of each pair (PairInfo::camera) for its stored colour image, where they differ.
  std::vector<sensor::Pinhole> frame_cameras{};
  bool truth_is_odometry = false;              ///< the recorder's own poses, known while recording
  bool gives_odometry = false;                 ///< frames have them
  std::shared_ptr<const BodyReadings> body{};  ///< of wheels and inertial sensor; null: none
  std::filesystem::path folder{};              ///< the recording's, as it was given
  std::size_t missing = 0;                     ///< frames of the part that is read whose files do not exist
};

struct LayoutOptions {
  double max_pair_gap_s = 0.02;
  double fps = 30.0;  ///< for layouts without stamps
  double depth_delay_s = 0.0;
  bool body = false;  ///< read what wheels and an inertial sensor measured
};

/// Seconds nearest to whole nanoseconds, which is what stamps of messages are.
inline double seconds_of(std::int64_t nanoseconds) {
  return static_cast<double>(static_cast<long double>(nanoseconds) / 1e9L);
}

/// A stamped file of a list, with its place for messages; images that are no files have stamps alone.
struct StampedFile {
  double stamp = 0.0;
  std::string file;
  int line = 0;
};

/// The FrameSource of every recording on disk, bags included.
std::unique_ptr<FrameSource> make_folder_source(std::string name, Layout layout, sensor::Camera camera,
                                                std::string doubt = "");

/// One layout: src/dataset/layouts has a source for each. Of some a recording is a file.
struct LayoutFormat {
  const char* name;        ///< value of --format
  const char* program;     ///< program that writes it, for messages
  const char* looked_for;  ///< for messages
  /// Files and folders of a whole recording, for messages and for what must not be written over; '|'
  /// separates alternatives, of which one suffices. A name that ends in '/' is a folder. `recognises` decides
  /// by itself.
  std::vector<std::string> parts;
  bool (*recognises)(const std::filesystem::path& folder);
  core::Result<Layout> (*read)(const std::filesystem::path& folder, const LayoutOptions& options,
                               core::Log& log);
};

const LayoutFormat& tum_layout();
const LayoutFormat& seven_scenes_layout();
const LayoutFormat& replica_layout();
const LayoutFormat& scannet_layout();
const LayoutFormat& stray_layout();
const LayoutFormat& polycam_layout();
const LayoutFormat& record3d_layout();
const LayoutFormat& tartanair_layout();
const LayoutFormat& redwood_layout();
const LayoutFormat& azure_kinect_layout();

/// All layouts, in the order in which they are tried.
const std::vector<const LayoutFormat*>& layout_formats();

/// The first that recognises the folder; null when none does.
const LayoutFormat* layout_of(const std::filesystem::path& folder);

/// Message for a folder that is not a recording: its content, and the layout that is nearest.
std::string not_a_recording(const std::filesystem::path& folder);
/// Message for a file that is not a recording: its kind if that is known, and what to do instead.
std::string not_a_recording_file(const std::filesystem::path& file);

/// True if the path is a folder (a file); false if that cannot be determined.
bool is_folder(const std::filesystem::path& path);
bool is_file(const std::filesystem::path& path);

/// The number under that key; none if it is missing, not a number or not finite.
std::optional<double> json_number(const nlohmann::ordered_json& object, const char* key);

/// world_from_camera from the camera's transform of Apple's ARKit, in which y points up and -z forward, for
/// the world as for the camera. Here the world's z points up.
geometry::Rigid3 from_arkit(const geometry::Rigid3& transform);

/// The groups of digits of a name, left to right.
std::vector<long long> numbers_of(const std::string& name);
/// 4x4 world_from_camera in a separate file; none where tracking was lost (NaN or infinity) or it is
/// unusable.
std::optional<geometry::Rigid3> read_pose_file(const std::string& file);
/// Images of a folder whose names have a number, by the first number after the prefix; a number seen twice
/// keeps the first name, so colour and depth in one folder need different prefixes.
using NumberedFiles = std::vector<std::pair<long long, std::string>>;
NumberedFiles numbered_images(const std::filesystem::path& folder, const std::string& prefix = "");
/// Pairs of images with one number, stamps number / fps.
Layout numbered_layout(const char* format, const NumberedFiles& color, const NumberedFiles& depth,
                       double fps);

/// Time between two images, microseconds, the resolution of stamps in seconds since 1970; pairs are chosen
/// by it. `depth_delay_s`: depth was taken so long after its stamp.
long long stamp_gap_us(double color_stamp, double depth_stamp, double depth_delay_s);

/// The images of two lists, by their places in these.
std::shared_ptr<ImageSource> images_of(const std::vector<StampedFile>& color,
                                       const std::vector<StampedFile>& depth);

/// Pairs by when images were taken, depth `depth_delay_s` after its stamps: smallest difference first, each
/// file used once; both lists sorted by stamp. The result has the lists' stamps and places and is sorted by
/// the stamp of colour.
std::vector<PairInfo> pair_by_stamp(const std::vector<StampedFile>& color,
                                    const std::vector<StampedFile>& depth, double max_gap_s,
                                    double depth_delay_s = 0.0);

/// Message for when pair_by_stamp finds nothing: the smallest gap, both ranges of time, and what to do.
std::string no_common_time(const std::string& color_name, const std::vector<StampedFile>& color,
                           const std::string& depth_name, const std::vector<StampedFile>& depth,
                           double max_gap_s);

/// All of a list's files missing is an error that names the first one.
core::Result<void> check_files(const std::string& list, const std::vector<StampedFile>& files);

}  // namespace plumbline::dataset
