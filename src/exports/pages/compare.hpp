// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Two maps over one another.
#include "plumbline/core/executor.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/viewer/scene.hpp"

namespace plumbline::exports {

void move(viewer::Points& points, const geometry::Rigid3& target_from_source);

/// Gives both clouds a layer "distance": to the nearest point of the other one.
void add_distances(viewer::Points& first, viewer::Points& second, const core::Executor& executor);

}  // namespace plumbline::exports
