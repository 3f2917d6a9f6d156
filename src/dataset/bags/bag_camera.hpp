// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The camera of a bag, from its CameraInfo and its transforms.
#include <optional>

#include "bags/topics.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::dataset {

/// None when there is no CameraInfo of colour, or one of a camera that was never calibrated; a warning says
/// which. Regions of interest and binning are applied (REP 104). Where depth has another camera,
/// color_from_depth comes from /tf_static, /tf, or RealSense's own transforms. Errors (kUsage): colour and
/// depth are of different cameras and nothing says how they sit: both are named, and the option; (kInput):
/// numbers that make no camera.
core::Result<std::optional<sensor::CameraReading>> bag_camera(const BagSurvey& survey,
                                                              const ChosenTopics& topics, core::Log& log);

/// Pose of the camera in a frame of the robot by the transforms of the bag; none if they do not contain it.
std::optional<geometry::Rigid3> body_from_camera(const BagSurvey& survey, const ChosenTopics& topics,
                                                 const std::string& body);

}  // namespace plumbline::dataset
