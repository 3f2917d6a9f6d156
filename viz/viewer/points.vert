#version 300 es
// SPDX-License-Identifier: BSD-3-Clause
precision highp float;
layout(location=0) in vec4 a_place;
layout(location=1) in vec4 a_color;
uniform mat4 u_view;
uniform vec3 u_origin, u_low, u_high, u_eye;
uniform vec4 u_size;
uniform vec4 u_look;
uniform vec3 u_tint;
uniform sampler2D u_palette;
out vec3 v_color;
vec3 unfold(vec2 f) {
  float z = 1. - abs(f.x) - abs(f.y);
  vec2 s = vec2(f.x < 0. ? -1. : 1., f.y < 0. ? -1. : 1.);
  return normalize(vec3(z >= 0. ? f : (1. - abs(f.yx)) * s, z));
}
void main() {
  vec3 p = u_origin + u_size.x * a_place.xyz;
  gl_Position = u_view * vec4(p, 1.);
  gl_PointSize = clamp(u_size.y / gl_Position.w, u_size.z, u_size.w);
  float a = floor(a_color.a * 255. + .5);
  bool away = u_look.z > .5 && a < 255. &&
      dot(unfold(vec2(mod(a, 16.), floor(a / 16.)) / 7. - 1.), u_look.z > 1.5 ? u_eye : u_eye - p) < 0.;
  if (away || any(lessThan(p, u_low)) || any(greaterThan(p, u_high))) gl_Position = vec4(2., 2., 2., 1.);
  v_color = a_color.rgb;
  if (u_look.x == 1.) v_color = texture(u_palette, vec2(clamp((p.z - u_look.y) * u_look.w, .002, .998), .5)).rgb;
  if (u_look.x == 2.) v_color = texture(u_palette, vec2((a_place.w + .5) / 256., .5)).rgb;
  if (u_look.x == 3.) {
    vec2 f = vec2(mod(a_place.w, 256.), floor(a_place.w / 256.));
    v_color = f.x < .5 ? vec3(.5) : unfold((f - 1.) / 15. - 1.) * .5 + .5;
  }
  v_color *= u_tint;
}
