// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "plumbline/maps/line_export.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// The map's 3D lines in the frame of all exports, from the store or the result folder. Errors (kInput): no
/// lines, or damaged ones.
core::Result<std::vector<maps::LineSegment3>> lines_of(const MapSource& source);

}  // namespace plumbline::exports
