// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Off-screen pictures of a map: VTK over OSMesa, no display, no window system.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/viz/scene.hpp"

namespace plumbline::viz {

/// Viewpoint of a picture. All but iso and explicit are orthographic; top is a plan, front looks along the
/// first camera's horizontal viewing direction, iso looks down at 35 degrees.
enum class View { kIso, kTop, kBottom, kFront, kBack, kLeft, kRight, kExplicit };

enum class ColorMode { kRgb, kHeight, kNormal, kRobot, kError, kConfidence, kSigma };

/// "iso", "top" ...; the names that options and file names use.
std::string view_name(View view);
std::string color_mode_name(ColorMode mode);

/// For View::kExplicit; scene frame, metres.
struct Viewpoint {
  Eigen::Vector3d eye{0.0, 0.0, -5.0};
  Eigen::Vector3d target{0.0, 0.0, 0.0};
  Eigen::Vector3d up{0.0, -1.0, 0.0};
  double field_of_view_deg = 45.0;  ///< vertical, (1, 170)
};

struct SnapshotOptions {
  View view = View::kIso;
  ColorMode color = ColorMode::kRgb;
  int width_px = 1600;
  int height_px = 1200;
  double point_size_px = 0.0;         ///< 0 = from the points' spacing, so that surfaces close
  bool cull_back_faces = true;        ///< leave out points that face away: opens rooms to the viewer
  bool shading = true;                ///< mild, by normal, so that structure shows on white walls
  bool annotations = true;            ///< title, legend, scale bar, axes, colour bar
  Viewpoint viewpoint;                ///< used by View::kExplicit only
  std::optional<Eigen::Vector3d> up;  ///< scene's up direction; none = estimated by estimate_up()
  /// Range of the colour bar; none: 2nd to 98th percentile.
  std::optional<std::pair<double, double>> scalar_range;

  void declare(core::OptionTable& table);
};

/// Mean of the cameras' up directions (-y of each camera), unit; -y if nothing is known.
Eigen::Vector3d mean_camera_up(const std::vector<geometry::Trajectory>& paths);

/// Up direction of a scene: that of the floor (cloud::find_floor, about the cameras' mean up), or the mean
/// itself if no floor is seen. Unit length.
Eigen::Vector3d estimate_up(const Scene& scene);

/// Draws the scene and writes a PNG; same scene and options give the same bytes on the same machine. An
/// empty scene gives a picture that says so. Errors: kUsage (picture size, scalars missing or of the wrong
/// length, degenerate viewpoint), kOutput (file cannot be written; the message names it), kInternal (no
/// OpenGL context).
core::Result<void> render_snapshot(const Scene& scene, const SnapshotOptions& options,
                                   const std::filesystem::path& file);

/// A picture and where it goes.
struct Snapshot {
  SnapshotOptions options;
  std::filesystem::path file;
};
/// Several pictures of one scene, each as by render_snapshot, in less time than one by one.
core::Result<void> render_snapshots(const Scene& scene, const std::vector<Snapshot>& snapshots,
                                    const core::Executor& executor);

}  // namespace plumbline::viz
