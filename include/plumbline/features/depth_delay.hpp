// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Colour and depth images stamped apart: a camera that moves meanwhile sees its corners' depth elsewhere.
#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::features {

/// Reads the depth of points again at the position where the depth camera, `depth_from_camera` from the
/// colour camera, saw them, and moves it back: as if both images had been taken at once. `depth` (CV_32FC1,
/// metres) is an image of `camera`. Points without depth stay without; a point without depth at the new
/// position loses it.
void undo_point_depth_delay(FrameFeatures& features, const cv::Mat& depth, const sensor::Pinhole& camera,
                            const geometry::Rigid3& depth_from_camera);
/// The same for lines; it takes longer, and only keyframes need it.
void undo_line_depth_delay(FrameFeatures& features, const cv::Mat& depth, const sensor::Pinhole& camera,
                           const geometry::Rigid3& depth_from_camera, const LineDepthOptions& options = {});

}  // namespace plumbline::features
