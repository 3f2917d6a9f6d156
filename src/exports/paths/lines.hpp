// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "plumbline/maps/line_export.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// The map's 3D lines, wherever they lie, in the frame of everything that is exported. Errors (kInput): there
/// are none, or they are damaged.
core::Result<std::vector<maps::LineSegment3>> lines_of(const MapSource& source);

}  // namespace plumbline::exports
