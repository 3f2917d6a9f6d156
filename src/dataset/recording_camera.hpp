// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The camera that took a recording: named, found in its folder, or guessed by the size of its images.
#include <filesystem>
#include <optional>
#include <string>

#include "layout.hpp"
#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::dataset {

struct ChosenCamera {
  sensor::CameraReading reading;
  std::string file;        ///< the folder, if the layout has the camera
  bool of_layout = false;  ///< Layout::camera
};

/// OpenOptions::camera, or a camera file in the folder (not of a bag); none when there is neither.
/// Errors are those of the file, or several files that differ.
core::Result<std::optional<ChosenCamera>> choose_camera(const std::filesystem::path& folder,
                                                        const OpenOptions& options, core::Log& log);

/// Completes the camera from the images and the layout where the file leaves something open. Layout::camera
/// is used if nothing else is chosen; otherwise Layout::frame_cameras is dropped. With neither, the camera is
/// a guess (a warning). One calibration for images of two sizes is scaled to both. If depth has another size,
/// colour is reduced by a whole factor, to at most 960 pixels across. Logs how another program's file was
/// understood. Error (kUsage): numbers that do not fit the images' size; or no file, and images of a size
/// that no common device takes.
core::Result<sensor::Camera> complete_camera(const std::filesystem::path& folder,
                                             const std::optional<ChosenCamera>& chosen, Layout& layout,
                                             core::Log& log);

/// Whole factor by which the stored colour images are larger than the camera's on both sides, for a camera
/// with a separate depth camera; 1 if there is no whole factor.
int stored_reduction(const Layout& layout, const sensor::Camera& camera);

}  // namespace plumbline::dataset
