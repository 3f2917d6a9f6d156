// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/graph_picture.hpp"

#include <fmt/format.h>
#include <graphviz/gvc.h>

#include <memory>

#include "plumbline/core/output_file.hpp"

namespace plumbline::viz {
namespace {

int keep_quiet(char* /*message*/) { return 0; }

struct Context {
  GVC_t* gvc = gvContext();
  Agraph_t* graph = nullptr;
  bool laid_out = false;

  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context() {
    if (laid_out) gvFreeLayout(gvc, graph);
    if (graph != nullptr) agclose(graph);
    gvFreeContext(gvc);
  }
};

}  // namespace

core::Result<void> draw_graph(const std::string& dot, const std::filesystem::path& file) {
  // Graphviz chooses its renderer by the ending.
  const std::string ending = file.extension().string();
  if (ending != ".png" && ending != ".svg" && ending != ".pdf") {
    return core::usage_error(fmt::format("{}: graphs are drawn as .png, .svg or .pdf", file.string()));
  }

  agseterrf(keep_quiet);  // libraries do not print
  Context context;
  context.graph = agmemread(dot.c_str());
  if (context.graph == nullptr) return core::usage_error("the graph is not in the DOT language");

  // Positions of nodes, then the drawing.
  context.laid_out = gvLayout(context.gvc, context.graph, "dot") == 0;
  char* bytes = nullptr;
  unsigned int length = 0;

  if (!context.laid_out ||
      gvRenderData(context.gvc, context.graph, ending.c_str() + 1, &bytes, &length) != 0 ||
      bytes == nullptr) {
    return core::failure(core::ErrorKind::kInternal, "Graphviz could not draw the graph");
  }

  // Memory of Graphviz is freed by Graphviz.
  const std::unique_ptr<char, void (*)(char*)> owner(bytes, gvFreeRenderData);
  return core::write_file(file, {bytes, length});
}

}  // namespace plumbline::viz
