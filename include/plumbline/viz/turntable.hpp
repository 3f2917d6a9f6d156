// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A scene from all sides.
#include <filesystem>
#include <functional>

#include "plumbline/core/error.hpp"
#include "plumbline/viz/snapshot.hpp"

namespace plumbline::viz {

/// Pictures drawn so far, pictures in all.
using TurntableProgress = std::function<void(int, int)>;

/// Draws `pictures` views from evenly spaced directions all round, looking down at 35 degrees, all of one
/// scale: folder/0000.png, 0001.png ... `options.view` is not used. `progress` may be empty. Errors as
/// render_snapshot's, and kUsage for fewer than 2 pictures.
core::Result<void> render_turntable(const Scene& scene, const SnapshotOptions& options, int pictures,
                                    const std::filesystem::path& folder,
                                    const TurntableProgress& progress = {});

}  // namespace plumbline::viz
