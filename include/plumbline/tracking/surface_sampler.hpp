// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Chooses the pieces of a depth image that a later frame is aligned to.
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::tracking {

struct SurfaceSamplerOptions {
  int samples = 1600;
  double min_depth_m = 0.3;
  double max_depth_m = 6.0;
  double max_incidence_rad = 1.25;  ///< between normal and viewing ray
  void declare(core::OptionTable& table);
};

/// Samples of `depth` (CV_32FC1, metres, 0 = none), half of them spread evenly over the image, half evenly
/// over the directions of the normals (normal-space sampling, Rusinkiewicz & Levoy 2001), so that all six
/// degrees of freedom are constrained wherever the scene allows. Normals have the wide base that
/// structured-light depth needs. Deterministic.
std::vector<maps::SurfaceSample> sample_surface(const cv::Mat& depth, const sensor::Pinhole& camera,
                                                const SurfaceSamplerOptions& options);

/// The samples in another camera's frame.
std::vector<maps::SurfaceSample> transformed(std::vector<maps::SurfaceSample> samples,
                                             const geometry::Rigid3& to_from_here);

}  // namespace plumbline::tracking
