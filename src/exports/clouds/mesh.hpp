// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/cloud/io/ply.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// The selected cloud as a mesh with vertex colours. Errors: kInput, and those of cloud::make_mesh.
core::Result<cloud::PlyData> mesh_of(MapSource& source);

}  // namespace plumbline::exports
