// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Functions that need VTK, OSMesa or Graphviz: a separate part (core/part.hpp). They are those of the
// public headers.
#include "plumbline/core/part.hpp"
#include "plumbline/viz/graph_picture.hpp"
#include "plumbline/viz/snapshot.hpp"

namespace plumbline::viz {

struct Drawing {
  static constexpr const char* kPart = "viz";
  static constexpr std::uint64_t layout() {
    return core::layout_of<Drawing, Scene, CameraPath, geometry::Trajectory, Segment, Snapshot,
                           core::Executor, std::filesystem::path>();
  }
  using GlFunction = void (*)();

  core::Result<void> (*render_snapshots)(const Scene& scene, const std::vector<Snapshot>& snapshots,
                                         const core::Executor& executor);
  core::Result<void> (*draw_graph)(const std::string& dot, const std::filesystem::path& file);
  /// OSMesa's function of that name.
  GlFunction (*gl_function)(const char* name);
};

/// OSMesa's function of that name; null: there is none. In the program it comes from the part.
Drawing::GlFunction offscreen_function(const char* name);

}  // namespace plumbline::viz
