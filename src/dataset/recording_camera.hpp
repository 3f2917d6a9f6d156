// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which camera took a recording: named, found in its folder, or guessed by the size of its images.
#include <filesystem>
#include <optional>
#include <string>

#include "layout.hpp"
#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::dataset {

struct ChosenCamera {
  sensor::CameraReading reading;
  std::string file;        ///< the folder, when its layout says it
  bool of_layout = false;  ///< Layout::camera
};

/// OpenOptions::camera, or a camera file in the folder (not of a bag); none when there is neither.
/// Errors are those of the file, or several files that differ.
core::Result<std::optional<ChosenCamera>> choose_camera(const std::filesystem::path& folder,
                                                        const OpenOptions& options, core::Log& log);

/// What the file leaves open is taken from the images and the layout (of which Layout::camera is used where
/// nothing else is chosen, and Layout::frame_cameras forgotten otherwise); without either the camera is a
/// guess (a warning). One calibration for images of two sizes is scaled to both. Where depth has another
/// size, colour is made smaller by a whole factor, to at most 960 pixels across. Says what was understood of
/// another program's file. Error (kUsage): numbers that do not fit the
/// images' size; no file, and images that no common device takes.
core::Result<sensor::Camera> complete_camera(const std::filesystem::path& folder,
                                             const std::optional<ChosenCamera>& chosen, Layout& layout,
                                             core::Log& log);

/// How many times larger than the camera's the colour images are on both sides, of a camera with a depth
/// camera of its own; 1 where that is no whole number.
int stored_reduction(const Layout& layout, const sensor::Camera& camera);

}  // namespace plumbline::dataset
