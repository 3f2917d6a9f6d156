// SPDX-License-Identifier: BSD-3-Clause
// Polycam's raw data (a phone with LiDAR): keyframes/images/TIME.jpg, depth/TIME.png in millimetres,
// confidence/TIME.png, cameras/TIME.json with intrinsics and the transform of ARKit, TIME in microseconds;
// corrected_images/ and corrected_cameras/ hold the images without distortion and poses after optimisation.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "layout.hpp"
#include "plumbline/core/json.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

/// The folder of the images: that was given, or keyframes/ in it.
fs::path keyframes_folder(const fs::path& folder) {
  return is_folder(folder / "keyframes") ? folder / "keyframes" : folder;
}

bool looks_like_polycam(const fs::path& folder) {
  const fs::path keyframes = keyframes_folder(folder);
  return is_folder(keyframes / "images") && is_folder(keyframes / "depth") &&
         is_folder(keyframes / "cameras");
}

struct PolycamFrame {
  sensor::Pinhole pinhole;
  geometry::Rigid3 world_from_camera;
};

/// Errors (kInput): no JSON, a number is missing, or the transform is not rigid.
core::Result<PolycamFrame> read_polycam_camera(const fs::path& file) {
  const auto camera_file = core::read_json(file);
  if (!camera_file) return tl::unexpected(camera_file.error());
  bool whole = true;
  const auto number = [&](const char* key) {
    const auto value = json_number(*camera_file, key);
    whole = whole && value.has_value();
    return value.value_or(0.0);
  };

  // The rows of world_from_camera in ARKit's axes
  Eigen::Matrix<double, 3, 4> t;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column)
      t(row, column) = number(fmt::format("t_{}{}", row, column).c_str());
  }

  PolycamFrame frame;
  frame.pinhole = {static_cast<int>(std::clamp(number("width"), 0.0, 1e5)),
                   static_cast<int>(std::clamp(number("height"), 0.0, 1e5)),
                   number("fx"),
                   number("fy"),
                   number("cx"),
                   number("cy")};

  // A pose is rigid up to rounding
  const Eigen::Matrix3d rotation = t.leftCols<3>();
  const double bent = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!whole) return core::input_error(file.string() + ": holds no camera: a number is missing");
  if (!(bent < 0.01))
    return core::input_error(file.string() + ": the transform is not a rotation and a shift");

  // Implausible intrinsics are reported, not used
  sensor::Camera camera;
  camera.color = frame.pinhole;
  if (const std::string wrong = sensor::camera_problem(camera); !wrong.empty())
    return core::input_error(fmt::format("{}: {}", file.string(), wrong));
  frame.world_from_camera = from_arkit(geometry::Rigid3(Eigen::Quaterniond(rotation), t.col(3)));
  return frame;
}

/// The camera of the whole recording: that of its first frame.
sensor::CameraReading polycam_camera(const sensor::Pinhole& first) {
  sensor::CameraReading reading;
  reading.program = "Polycam, that of the first frame; each frame is read with its own";
  reading.camera.name = "polycam";
  reading.camera.color = first;
  reading.camera.depth_scale = 1000.0;
  return reading;
}

core::Result<Layout> read_polycam(const fs::path& folder, const LayoutOptions& /*options*/, core::Log& log) {
  const fs::path keyframes = keyframes_folder(folder);
  const bool corrected =
      is_folder(keyframes / "corrected_images") && is_folder(keyframes / "corrected_cameras");
  const fs::path cameras = keyframes / (corrected ? "corrected_cameras" : "cameras");
  const auto color = numbered_images(keyframes / (corrected ? "corrected_images" : "images"));
  const auto depth = numbered_images(keyframes / "depth");
  constexpr double kMicroseconds = 1e6;

  Layout layout = numbered_layout("polycam", color, depth, kMicroseconds);
  geometry::Trajectory poses;
  std::size_t left_out = 0;
  std::string first_problem;

  // Frames whose own cameras can be read.
  for (const PairInfo& pair : std::exchange(layout.pairs, {})) {
    const fs::path image = layout.images->file(pair.color);
    const auto frame = read_polycam_camera(cameras / (image.stem().string() + ".json"));
    if (!frame) {
      if (left_out++ == 0) first_problem = "; the first of them: " + frame.error().message;
      continue;
    }

    layout.pairs.push_back(pair);
    layout.pairs.back().camera = static_cast<int>(layout.frame_cameras.size());
    layout.frame_cameras.push_back(frame->pinhole);
    poses.push_back({pair.stamp, frame->world_from_camera});
  }

  if (layout.pairs.empty()) {
    return core::input_error(
        fmt::format("{}: no number is in images/ ({} images), depth/ ({}) and {}/ at once, with a camera "
                    "that can be read ({} cannot){}",
                    keyframes.string(), color.size(), depth.size(), cameras.filename().string(), left_out,
                    first_problem));
  }

  if (left_out > 0) {
    log.warning(
        fmt::format("{}: {} frames are left out, for their camera files are missing or hold no camera{}",
                    cameras.string(), left_out, first_problem));
  }

  if (corrected) log.info("polycam: the corrected images and poses are used");
  const fs::path confidence = keyframes / "confidence";
  if (is_folder(confidence)) layout.confidence = confidence.string();
  layout.camera = polycam_camera(layout.frame_cameras.front());
  layout.truth = std::move(poses);
  layout.truth_is_odometry = true;
  return layout;
}

}  // namespace

const LayoutFormat& polycam_layout() {
  static const LayoutFormat format = {"polycam",
                                      "Polycam's raw data",
                                      "keyframes/images/, depth/ and cameras/",
                                      {"keyframes/images/|images/", "keyframes/depth/", "keyframes/cameras/"},
                                      &looks_like_polycam,
                                      &read_polycam};
  return format;
}

}  // namespace plumbline::dataset
