// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The camera from its own recordings: what focal length, readout, depth slope, depth delay, centre and
// distortion explain best what the keyframes of finished maps saw. A value is used only if it also
// explains parts of the runs that it was not estimated from.
#include <optional>
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
  std::string name;    ///< key in camera.yaml
  double given = 0.0;  ///< by the camera's file
  double found = 0.0;
  double sigma = 0.0;  ///< standard deviation of `found`
  double wrong = 0.0;  ///< probability that the file is wrong here, 0 to 1
  bool used = false;   ///< the camera differs from the file here by more than a standard deviation
};

/// Prior of the camera's numbers: `right` is the standard deviation where the file is right, `wrong` where it
/// is not.
struct NumberPrior {
  double right;
  double wrong;
};

struct CalibrationOptions {
  int views = 200;  ///< keyframes and frames between them of all runs, at most
  /// The camera as its file has it, which the prior is about; none: the one that the maps were made with.
  std::optional<sensor::Camera> file;
  NumberPrior focal{0.001, 0.02};  ///< share
  NumberPrior centre_px{1.0, 10.0};
  NumberPrior distortion{0.003, 0.1};  ///< of k1 and of k2
  NumberPrior slope{0.001, 0.02};      ///< 1/m
  NumberPrior delay_s{0.001, 0.02};
  NumberPrior readout_s{0.0002, 0.02};
  double wrong = 0.3;  ///< probability that a group of numbers is wrong, before anything is seen
};

/// CameraCalibration::news from which a file that seemed right is wrong.
constexpr double kFileIsWrong = 2.5;

struct CameraCalibration {
  sensor::Camera camera;
  sensor::CameraSigma sigma;        ///< its standard deviations
  optimize::CameraPosterior known;  ///< `camera` as a change of the one that the maps were made with
  std::vector<CameraFinding> findings;
  int views = 0;
  int observations = 0;
  double gain = 0.0;  ///< relative reduction of the cost against the file
  /// Largest difference of a number from the camera that the maps were made with, in standard deviations.
  double news = 0.0;
};

/// `given`: the camera that the runs' features were read with. The same for any number of threads. Errors
/// (kInput): the runs have too few keyframes, or too few points seen by several.
core::Result<CameraCalibration> calibrate_camera(const std::vector<CalibrationRun>& runs,
                                                 const sensor::Camera& given,
                                                 const CalibrationOptions& options,
                                                 const core::Executor& executor);

/// Knowledge of each number of `found`, given its file. The mean of `known` does not matter.
std::vector<CameraFinding> findings_of(const sensor::Camera& file, const sensor::Camera& found,
                                       const optimize::CameraPosterior& known);

}  // namespace plumbline::mapping
