// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Two maps over one another.
#include <optional>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/viewer/scene.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// Where a second map lies in the frame of a first one, by cameras of the same robot and stamp. Empty: fewer
/// than three have a partner.
std::optional<geometry::Rigid3> first_from_second(const std::vector<ExportPose>& first,
                                                  const std::vector<ExportPose>& second);

void move(viewer::Points& points, const geometry::Rigid3& target_from_source);

/// Gives both clouds a layer "distance": to the nearest point of the other one.
void add_distances(viewer::Points& first, viewer::Points& second, const core::Executor& executor);

}  // namespace plumbline::exports
