#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
precision highp float;
layout(location=0) in vec3 a_from;
layout(location=1) in vec3 a_to;
layout(location=2) in vec4 a_color;
uniform mat4 u_view;
uniform vec3 u_window;
uniform vec3 u_low, u_high;
out vec4 v_color;
void main() {
  vec4 a = u_view * vec4(a_from, 1.), b = u_view * vec4(a_to, 1.);
  if (a.w < .02) a = mix(a, b, clamp((.02 - a.w) / (b.w - a.w), 0., 1.));
  if (b.w < .02) b = mix(b, a, clamp((.02 - b.w) / (a.w - b.w), 0., 1.));
  vec2 along = (b.xy / b.w - a.xy / a.w) * u_window.xy;
  vec2 side = normalize(vec2(-along.y, along.x) + 1e-9) * u_window.z / u_window.xy;
  vec4 at = (gl_VertexID & 1) == 0 ? a : b;
  at.xy += side * ((gl_VertexID & 2) == 0 ? 1. : -1.) * at.w;
  vec3 mid = (a_from + a_to) * .5;
  if (any(lessThan(mid, u_low)) || any(greaterThan(mid, u_high))) at = vec4(2., 2., 2., 1.);
  gl_Position = at;
  v_color = a_color;
}
