// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Systematic faults of depth cameras.
#include "render/render.hpp"
#include "scene/faults.hpp"

namespace plumbline::synth {

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
