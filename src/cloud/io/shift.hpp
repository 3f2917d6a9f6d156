// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Coordinates that are too large for the 32-bit floats of a cloud, such as UTM's: the shift that is
// subtracted while reading, and added while writing.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "io/cloud_table.hpp"
#include "io/scalar.hpp"

namespace plumbline::cloud {

/// True if values of this type can hold more digits than a 32-bit float.
bool exceeds_float(ScalarType type);

/// Offset to subtract from the values of one axis so that floats hold the rest: whole units near their
/// median; 0 where it is below 1000.
double axis_shift(const std::vector<double>& values);

/// Stands for x, y or z: 0, 1, 2; none for other columns.
std::optional<int> axis_of_column(Meaning meaning);

/// The original coordinate, before `shift` was subtracted. The float stands for the shortest decimal number
/// that reads as it, so that 0.56F and 701362 give 701362.56.
double with_shift(float value, double shift);

}  // namespace plumbline::cloud
