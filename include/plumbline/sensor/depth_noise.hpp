// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Depth noise of a structured-light sensor (docs/method/features.md).
namespace plumbline::sensor {

/// Standard deviation of a depth measurement, metres: sigma_z(z) = 0.0012 + 0.0019 (z - 0.4)^2.
inline double depth_sigma(double z) { return 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4); }

}  // namespace plumbline::sensor
