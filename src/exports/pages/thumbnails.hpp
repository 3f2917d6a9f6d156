// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Small pictures of keyframes.
#include "plumbline/exports/view.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// Gives the scene's keyframes pictures of 160 pixels' width, 5 kB at most each: the map's, or those of the
/// recording as far as it can be opened. A note tells of none.
void add_thumbnails(const MapSource& source, const std::vector<ExportPose>& poses, MapView& view);

}  // namespace plumbline::exports
