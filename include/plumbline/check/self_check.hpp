// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Judges a path against its recording without knowing the truth: pairs of frames are aligned anew by depth
// planes and optical flow. Formulas: docs/method/trust.md.
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/check/frame_store.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/geometry/pose_samples.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::check {

/// A frame that was kept, and the path it lies on.
struct KeptFrame {
  std::size_t number = 0;  ///< for CheckInput::read
  std::size_t way = 0;     ///< its path among CheckInput::ways
  double stamp = 0.0;      ///< of colour, seconds
  double depth_stamp = 0.0;
  FrameChoice::Use use = FrameChoice::Use::kAnchor;
};

/// The final path of one camera; all ways of an input are in one frame of reference.
struct Way {
  sensor::Pinhole camera;  ///< of the whole rectified pictures
  double readout_s = 0.0;  ///< CameraFile's readout; 0: all rows at once
  geometry::Trajectory path;
};

/// Effect of an uncertain camera on the pose at a stamp: motions (t, w) of the camera in its own axes, metres
/// and radians, times independent numbers of variance 1, which are the same at all stamps.
struct CameraShift {
  std::size_t way = 0;
  double stamp = 0.0;  ///< seconds
  std::vector<geometry::Vector6d> motions;
};

struct CheckInput {
  std::vector<Way> ways;
  std::vector<KeptFrame> frames;                                     ///< by way, in order of their stamps
  std::function<core::Result<SmallFrame>(std::size_t number)> read;  ///< thread-safe
  double max_dt_s = 0.005;          ///< a frame has a pose if the path has one so near to its stamp
  std::vector<CameraShift> camera;  ///< by way, in order of their stamps; empty: not known
  double told_m = 0.0;  ///< standard deviation of positions that the estimate tells of itself; 0: unknown
};

/// Pairs of one kind.
enum Gap : std::size_t { kThird, kSecond, kThreeSeconds, kRevisit, kGaps };

/// Correction that the alignment of pairs asks for.
struct GapReport {
  std::size_t pairs = 0;
  double median_m = 0.0;  ///< length of the shift, less its own noise
  double p90_m = 0.0;
  /// The median of what is left without the motion of the cameras while the pictures were taken, less the
  /// standard error of a median of so many pairs.
  double unexplained_m = 0.0;
};

/// A place of the path.
struct BadPlace {
  double off_m = 0.0;
  double stamp = 0.0;  ///< seconds
  std::size_t way = 0;
};

/// Errors that the path may have at an anchor, in the axes of the world.
struct AnchorSamples {
  double stamp = 0.0;  ///< seconds
  std::size_t way = 0;
  geometry::PoseSamples world;
};

struct CheckReport {
  std::size_t anchors = 0;  ///< frames that pairs begin with
  std::size_t tried = 0;    ///< pairs of frames that should show the same surface
  std::size_t pairs = 0;    ///< those that could be aligned, or contradict the path
  std::array<GapReport, kGaps> align;
  double graph_m = 0.0;         ///< RMS of the shifts that all corrections together ask for, after SE(3)
  double refused = 0.0;         ///< share of pairs that contradict all others, or show no common surface
  double split_m = 0.0;         ///< depth against colour over one second, less its own noise
  double split_chi = 0.0;       ///< the same in standard deviations
  BadPlace local;               ///< where frames a second apart fit worst, if it stands out; off_m 0: nowhere
  std::vector<BadPlace> tears;  ///< steps that no camera makes, or that the pictures contradict
  std::vector<BadPlace> along;  ///< of each anchor: the shift that pairs around it and all together ask for
  std::vector<AnchorSamples>
      samples;            ///< by way, in order of their stamps: their RMS is expected_m; path_samples.hpp
  double untied_m = 0.0;  ///< length of path that lies between no two places seen twice
  double drift_m = 0.0;   ///< what that part may have drifted by
  std::array<double, 2> noise{};     ///< of depth: a + b z^2, metres
  double distance_m = 0.0;           ///< median depth
  double path_m = 0.0;               ///< length of all paths
  double size_m = 0.0;               ///< of what was recorded: the box around the anchors and twice the depth
  double camera_m = 0.0;             ///< RMS of what CheckInput::camera means for the path
  double told_m = 0.0;               ///< CheckInput::told_m
  double expected_m = 0.0;           ///< expected RMS error of positions after SE(3)
  double p95_m = 0.0;                ///< 95 % of such results have a smaller error
  double lengths = 0.0;              ///< expected relative error of distances, but for the scale
  std::vector<std::string> reasons;  ///< reasons not to trust the path; empty: there is none
  std::vector<std::string> unchecked;  ///< what nothing here could see, one sentence part each
  [[nodiscard]] bool checked() const { return pairs > 0; }
};

/// True if the path has a pose so near to the stamp.
bool has_pose(const geometry::Trajectory& path, double stamp, double max_dt_s);

/// Same result for any number of threads; nothing is checked of a path of fewer than two poses. Errors: those
/// of CheckInput::read.
core::Result<CheckReport> check_path(const CheckInput& input, const core::Executor& executor);

/// Numbers that are told of a path that is trusted.
struct Shape {
  double expected_m = 0.0;
  double p95_m = 0.0;
  double lengths = 0.0;  ///< share by which distances within the recording may be off
};
/// "Shape +- 8 mm (95 %: 15 mm), lengths 0.4 %; scale unchecked."; without numbers: "No reason to doubt ...".
/// `unchecked` are as CheckReport's.
std::string shape_sentence(const std::optional<Shape>& shape, const std::vector<std::string>& unchecked);
/// The same, or "Not trustworthy: ...".
std::string sentence(const CheckReport& report);
/// A table for people, several lines.
std::string to_text(const CheckReport& report);
/// One JSON object: sentence, expected_m, p95_m, trusted, reasons, unchecked, graph_m, align {third_s, one_s,
/// three_s, revisit}, refused, split_m, local, tears, noise ...
std::string to_json(const CheckReport& report);

}  // namespace plumbline::check
