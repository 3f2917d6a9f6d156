#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
precision highp float;
uniform highp sampler2D u_color, u_depth;
uniform vec4 u_lens;
uniform vec3 u_ground;
uniform vec2 u_scale;
out vec4 o_color;
float away(ivec2 at) {
  float d = texelFetch(u_depth, clamp(at, ivec2(0), textureSize(u_depth, 0) - 1), 0).r;
  if (d >= 1.) return -1.;
  float near = u_lens.x, far = u_lens.y;
  return log2(u_lens.z > .5 ? near + d * (far - near) : near * far / (far - d * (far - near)));
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy * u_scale);
  float here = away(at);
  if (here == -1.) { o_color = vec4(u_ground, 1.); return; }
  float sum = 0.;
  int r = int(u_lens.w);
  for (int k = 0; k < 4; ++k) {
    float there = away(at + ivec2(k == 0 ? r : k == 1 ? -r : 0, k == 2 ? r : k == 3 ? -r : 0));
    sum += there == -1. ? .02 : clamp(here - there, 0., .08);
  }
  o_color = vec4(texelFetch(u_color, at, 0).rgb * exp(-9. * sum), 1.);
}
