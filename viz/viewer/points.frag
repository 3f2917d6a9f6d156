#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
precision mediump float;
in vec3 v_color;
out vec4 o_color;
uniform float u_round;
void main() {
  vec2 d = gl_PointCoord - .5;
  if (u_round > .5 && dot(d, d) > .25) discard;
  o_color = vec4(v_color, 1.);
}
