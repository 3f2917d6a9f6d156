// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A scene from all sides.
#include <filesystem>
#include <functional>

#include "plumbline/core/error.hpp"
#include "plumbline/viz/snapshot.hpp"

namespace plumbline::viz {

/// Draws `pictures` views from evenly spaced directions all round, looking down at 35 degrees, all of one
/// scale: folder/0000.png, 0001.png ... `options.view` is not used. `progress` gets the pictures drawn so far
/// and in all, and may be empty. Errors as render_snapshot's, and kUsage for fewer than 2 pictures.
core::Result<void> render_turntable(const Scene& scene, const SnapshotOptions& options, int pictures,
                                    const std::filesystem::path& folder,
                                    const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace plumbline::viz
