// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Columns of a cloud after its points were chosen from.
#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/cloud/types.hpp"

namespace plumbline::cloud {

/// The columns of `before` for the points of `after`, found by their coordinates. Empty columns when `after`
/// has a point that `before` has not: filters that move points make the columns meaningless.
CloudColumns carry_columns(const Cloud& before, const CloudColumns& columns, const Cloud& after);

}  // namespace plumbline::cloud
