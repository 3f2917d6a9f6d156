// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/tracking/photometric_alignment.hpp"

namespace plumbline::tracking {

/// Like associate_photometric(), but without gain, noise and weights, which photometric_correlation() does
/// not need.
std::optional<optimize::PhotometricFamily> photometric_in_view(const features::PhotometricSamples& samples,
                                                               std::size_t level, const PhotometricView& view,
                                                               const geometry::Rigid3& reference_from_world,
                                                               const geometry::Rigid3& camera_from_world);

}  // namespace plumbline::tracking
