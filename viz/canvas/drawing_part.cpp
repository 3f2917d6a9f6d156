// SPDX-License-Identifier: BSD-3-Clause
#include <GL/osmesa.h>

#include "canvas/drawing.hpp"

PLUMBLINE_PART(plumbline::viz::Drawing, &plumbline::viz::render_snapshots, &plumbline::viz::draw_graph,
               &OSMesaGetProcAddress)
