// SPDX-License-Identifier: BSD-3-Clause
// Vectors as arrays, 4 x 4 matrices by columns, as WebGL takes them.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const mul = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => mul(a, 1 / (length(a) || 1));
const clamp = (v, low, high) => Math.min(Math.max(v, low), high);

/** a x b */
function product(a, b) {
  const out = new Float64Array(16);
  for (let c = 0; c < 4; ++c) {
    for (let r = 0; r < 4; ++r) {
      for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
  }
  return out;
}

/** Projection in which an object `height` high at distance 1 (`flat`: at any distance) fills the picture. */
function projection(height, aspect, near, far, flat) {
  const y = 2 / height, x = y / aspect, m = new Float64Array(16);
  m[0] = x;
  m[5] = y;
  m[10] = flat ? -2 / (far - near) : -(far + near) / (far - near);
  m[14] = flat ? -(far + near) / (far - near) : -2 * far * near / (far - near);
  m[flat ? 15 : 11] = flat ? 1 : -1;
  return m;
}

/** View matrix of an eye with these axes. */
function viewing(eye, right, up, back) {
  return new Float64Array([right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1]);
}

/** Rotates v by a quaternion x y z w. */
function turned(q, v) {
  const t = mul(cross(q, v), 2);
  return add(add(v, mul(t, q[3])), cross(q, t));
}

/** Unit eigenvector of the smallest eigenvalue of a symmetric 3 x 3 matrix: powers of its adjugate. */
function flattest([xx, xy, xz, yy, yz, zz]) {
  const a = [xx, xy, xz], b = [xy, yy, yz], c = [xz, yz, zz], rows = [cross(b, c), cross(c, a), cross(a, b)];
  let v = [0.3, 0.5, 0.8];
  for (let i = 0; i < 80; ++i) v = unit(rows.map((r) => dot(r, v)));
  return v;
}
