// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Systematic faults of depth cameras.
#include "render/render.hpp"

namespace plumbline::synth {

/// SynthOptions::depth_faults; 0: none of it.
struct DepthFaults {
  double offset = 0.0;  ///< 1/m, added to 1/z
  double scale = 0.0;   ///< share of z
  double radial = 0.0;  ///< share of z in the corners, with the square of the distance from the middle
  double drift = 0.0;   ///< share of z when the camera is warm, 1 - exp(-t / 60 s) of it at t
  double ray = 0.0;     ///< 1: distance along the ray instead of z
  double holes = 0.0;   ///< cosine of incidence below which nothing is measured, nor on dark and shiny things
  double multipath = 0.0;  ///< m that surfaces are too far where others are all around within half a metre
  double flying = 0.0;     ///< share of pixels at borders that lie between the surfaces
  double stripes = 0.0;    ///< share of z, of bands of another camera's light that wander
  double mirrors = 0.0;    ///< reflectance from which a surface shows what it mirrors instead of itself

  [[nodiscard]] bool any() const;
};

/// Errors (kUsage) name the key.
core::Result<DepthFaults> depth_faults(const std::string& text);

/// Cosine between a pixel's ray and the normal of a face.
inline float incidence(const View& view, int face, int x, int y) {
  const FaceView& f = view.faces[static_cast<std::size_t>(face)];
  const auto px = static_cast<float>(x), py = static_cast<float>(y);
  // 1/z = c.p with c = M^T n / h, so the cosine of incidence follows from n = M^-T c h.
  const auto fx = static_cast<float>(view.camera.fx), fy = static_cast<float>(view.camera.fy);
  const auto cx = static_cast<float>(view.camera.cx), cy = static_cast<float>(view.camera.cy);
  const float nx = f.c[0] * fx, ny = f.c[1] * fy, nz = f.c[2] + f.c[0] * cx + f.c[1] * cy;
  const float dx = (px - cx) / fx, dy = (py - cy) / fy;
  return std::abs(nx * dx + ny * dy + nz) /
         std::sqrt((nx * nx + ny * ny + nz * nz) * (dx * dx + dy * dy + 1.0F));
}

struct FaultyDepth {
  cv::Mat1f depth;   ///< metres, before noise; 0 = no measurement
  cv::Mat1b mirror;  ///< 1 where a mirror image is seen; empty: nowhere
};
/// `bits`: of the frame.
FaultyDepth faulty_depth(const World& world, const View& view, const DepthFaults& faults, std::uint64_t bits);

}  // namespace plumbline::synth
