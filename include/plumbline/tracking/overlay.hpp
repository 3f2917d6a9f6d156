// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Drawing of the tracker's results onto the image: for people, not for estimation.
#include <opencv2/core/mat.hpp>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

/// Factor by which residuals are drawn longer than they are.
constexpr double kResidualZoom = 8.0;

/// CV_8UC3 BGR image of the frame's size with
///  * tracked points: measured (ring), predicted from the map (dot), residual as a stroke from the measured
///    position, kResidualZoom times its length, green at 0 px through yellow to red at 3 px and more;
///  * tracked lines: measured segment, projected map line, residual strokes at both measured ends;
///  * features that nothing in the map explains, faint; lines without depth (2D only) in another colour;
///  * state, inliers and rms of each family, weak directions, legend.
/// `features` and `track` must be of `frame`; landmarks that are no longer in `map` have no residual. A frame
/// without colour is drawn on its grey image, one without either on black. Same input, same bytes.
cv::Mat draw_overlay(const sensor::RgbdFrame& frame, const features::FrameFeatures& features,
                     const TrackResult& track, const maps::Map& map, const sensor::Pinhole& camera);

}  // namespace plumbline::tracking
