// SPDX-License-Identifier: BSD-3-Clause
#include <GL/osmesa.h>

#include "canvas/drawing.hpp"

namespace plumbline::viz {
Drawing::GlFunction offscreen_function(const char* name) { return OSMesaGetProcAddress(name); }
}  // namespace plumbline::viz

PLUMBLINE_PART(plumbline::viz::Drawing, &plumbline::viz::render_snapshots, &plumbline::viz::draw_graph,
               &OSMesaGetProcAddress)

#include "canvas/glx_stand_ins.hpp"
