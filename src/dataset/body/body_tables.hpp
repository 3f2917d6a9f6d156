// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tables of an inertial sensor and of wheels in a recording's folder.
#include <filesystem>
#include <memory>

#include "plumbline/core/log.hpp"
#include "plumbline/dataset/body_readings.hpp"

namespace plumbline::dataset {

/// imu.csv (plumbline synth, Stray Scanner) or EuRoC's imu0/data.csv, and odometry.csv. Null: there is none.
/// A table that cannot be used is left out with a warning that names the place.
std::shared_ptr<const BodyReadings> read_body_tables(const std::filesystem::path& folder, bool with_odometry,
                                                     core::Log& log);

}  // namespace plumbline::dataset
