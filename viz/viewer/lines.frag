#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
precision highp float;
in vec4 v_color;
uniform highp sampler2D u_depth;
uniform vec2 u_scale;
out vec4 o_color;
void main() {
  float d = texelFetch(u_depth, ivec2(gl_FragCoord.xy * u_scale), 0).r;
  o_color = vec4(v_color.rgb, gl_FragCoord.z > d + 1e-5 ? v_color.a * .35 : v_color.a);
}
