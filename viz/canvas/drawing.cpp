// SPDX-License-Identifier: BSD-3-Clause
// Hands on to the part that draws, which has functions of the same names, and stands in for GLX.
#include "canvas/drawing.hpp"

#include <cstring>

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

}  // namespace plumbline::viz

// GLEW's four calls to GLX (offscreen.cpp). They are here and not in the part because OpenCV loads libGLX
// together with the program: only the program itself comes before that.
extern "C" {

using GlFunction = plumbline::viz::Drawing::GlFunction;

__attribute__((visibility("default"))) void* glXGetCurrentDisplay() {
  static char any;  // GLEW only asks whether there is one
  return &any;
}

__attribute__((visibility("default"))) int glXQueryVersion(void* /*display*/, int* major, int* minor) {
  if (major != nullptr) *major = 1;
  if (minor != nullptr) *minor = 4;
  return 1;
}

__attribute__((visibility("default"))) const char* glXGetClientString(void* /*display*/, int /*name*/) {
  return "";
}

__attribute__((visibility("default"))) GlFunction glXGetProcAddressARB(const unsigned char* name) {
  const char* text = reinterpret_cast<const char*>(name);
  if (std::strcmp(text, "glXGetCurrentDisplay") == 0) {
    return reinterpret_cast<GlFunction>(&glXGetCurrentDisplay);
  }
  if (std::strncmp(text, "glX", 3) == 0) return nullptr;
  const auto& drawing = plumbline::core::part<plumbline::viz::Drawing>();
  return drawing ? (*drawing)->gl_function(text) : nullptr;
}

}  // extern "C"
