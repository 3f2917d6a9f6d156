// SPDX-License-Identifier: BSD-3-Clause
// Forwards to the functions of the same names in the part "viz", and replaces GLX.
#include "canvas/drawing.hpp"

namespace plumbline::viz {
namespace {

template <typename Function, typename... Arguments>
core::Result<void> hand_on(Function Drawing::*function, const Arguments&... arguments) {
  const auto& drawing = core::part<Drawing>();
  if (!drawing) return tl::unexpected<core::Error>(drawing.error());
  return ((*drawing)->*function)(arguments...);
}

}  // namespace

core::Result<void> render_snapshot(const Scene& scene, const SnapshotOptions& options,
                                   const std::filesystem::path& file) {
  return render_snapshots(scene, {{options, file}}, core::Executor(1));
}

core::Result<void> render_snapshots(const Scene& scene, const std::vector<Snapshot>& snapshots,
                                    const core::Executor& executor) {
  return hand_on(&Drawing::render_snapshots, scene, snapshots, executor);
}

core::Result<void> draw_graph(const std::string& dot, const std::filesystem::path& file) {
  return hand_on(&Drawing::draw_graph, dot, file);
}

Drawing::GlFunction offscreen_function(const char* name) {
  const auto& drawing = core::part<Drawing>();
  return drawing ? (*drawing)->gl_function(name) : nullptr;
}

}  // namespace plumbline::viz

#include "canvas/glx_stand_ins.hpp"
