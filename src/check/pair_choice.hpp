// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which frames are aligned with which.
#include <array>
#include <optional>
#include <vector>

#include "view.hpp"

namespace plumbline::check {

/// A kept frame that has poses.
struct PosedFrame {
  KeptFrame frame;
  FramePoses poses;
};

/// Pairs of one anchor.
struct Partners {
  std::optional<std::size_t> next;                     ///< a posed frame
  std::array<std::vector<std::size_t>, kGaps> by_gap;  ///< numbers of anchors
};

/// A sample of an anchor's surface, to look for revisits.
struct Outline {
  std::vector<Eigen::Vector3d> points, normals;  ///< in the world, a sample
  double share = 0.0;                            ///< of the picture that has surface
  double distance_m = 0.0;                       ///< median depth; 0: none
};
Outline outline_of(const View& view);

/// `frames` are by way, in order of their stamps; `anchors` are places among them, `outlines` theirs.
std::vector<Partners> choose_pairs(const std::vector<PosedFrame>& frames,
                                   const std::vector<std::size_t>& anchors,
                                   const std::vector<Outline>& outlines,
                                   const std::vector<SmallCamera>& cameras);

}  // namespace plumbline::check
