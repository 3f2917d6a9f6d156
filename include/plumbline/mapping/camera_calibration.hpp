// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The camera from its own recordings: what focal length, readout, depth slope, depth delay, centre and
// distortion explain best what the keyframes of finished maps saw. A value is used only if it also
// explains parts of the runs that it was not estimated from.
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/camera_calibration.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

/// A map of one recording, made with the given camera. All must outlive the call.
struct CalibrationRun {
  const maps::Map* map = nullptr;
  /// Every frame: the camera's motion and observations.
  const std::vector<maps::FramePose>* frames = nullptr;
  sensor::Pinhole image;  ///< camera of the images that the features lie in
};

/// One number of the camera.
struct CameraFinding {
  std::string name;  ///< key in camera.yaml
  double given = 0.0;
  double found = 0.0;
  double sigma = 0.0;  ///< standard deviation by leaving parts of the runs out, one at a time (jackknife)
  double gain = 0.0;   ///< relative reduction of the cost on held-out parts
  bool used = false;   ///< it is in `camera`
};

struct CalibrationOptions {
  int views = 200;            ///< keyframes and frames between them of all runs, at most
  double least_gain = 0.002;  ///< smallest relative reduction of the cost on held-out parts
  double least_sigmas = 3.0;  ///< smallest difference from the given value, in standard deviations
  double focal_prior = 0.02;  ///< standard deviation of the given focal length, share
  double centre_prior_px = 10.0;
  double readout_prior_s = 0.02;
  double slope_prior = 0.02;      ///< 1/m
  double distortion_prior = 0.1;  ///< of k1 and of k2
  double delay_prior_s = 0.02;
  std::vector<CameraFinding> earlier;  ///< of a map made with another camera: first all are tried together
  double earlier_least_gain = 0.002;   ///< like least_gain, for those together
};

struct CameraCalibration {
  sensor::Camera camera;  ///< the given one with the accepted changes
  std::vector<CameraFinding> findings;
  int views = 0;
  int observations = 0;
  double gain = 0.0;  ///< relative reduction of the cost on held-out parts by all together
};

/// `given`: the camera that the runs' features were read with. The same for any number of threads. Errors
/// (kInput): the runs have too few keyframes, or too few points seen by several.
core::Result<CameraCalibration> calibrate_camera(const std::vector<CalibrationRun>& runs,
                                                 const sensor::Camera& given,
                                                 const CalibrationOptions& options,
                                                 const core::Executor& executor);

/// Differences of `found` from `given`; marked as used where they differ. Standard deviations and gains are
/// not known.
std::vector<CameraFinding> findings_between(const sensor::Camera& given, const sensor::Camera& found);

}  // namespace plumbline::mapping
