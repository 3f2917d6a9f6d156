// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The columns of a cloud while its points are chosen, moved, replaced and put together.
#include <cstddef>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/types.hpp"

namespace plumbline::cloud {

/// The columns of the points `indices`, in this order.
CloudColumns pick_columns(const CloudColumns& columns, const std::vector<std::size_t>& indices);

/// Appends `more`, the columns of `added` points, to `columns` of `size` points. A column that only one of
/// the two has is 0 for the points of the other.
void append_columns(CloudColumns& columns, std::size_t size, const CloudColumns& more, std::size_t added);

/// The columns of `before` for the points of `after`, which some filter made of it. Points are found again by
/// their coordinates; when all have moved but none is missing, by their order; otherwise every point takes
/// the values of the one nearest to it.
CloudColumns carry_columns(const Cloud& before, const CloudColumns& columns, const Cloud& after);

}  // namespace plumbline::cloud
