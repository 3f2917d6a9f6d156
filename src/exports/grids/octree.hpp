// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "grids/rays.hpp"
#include "plumbline/core/part.hpp"

namespace plumbline::exports {

/// Input for making an OctoMap.
struct OctreeWork {
  double resolution_m = 0.05;
  bool color = false;  ///< true: ColorOcTree with probabilities (.ot); false: the binary OcTree (.bt)
  std::string frame;   ///< for the file's comment, one line
  const cloud::CloudFile* cloud = nullptr;
  Eigen::AlignedBox3d box;
  ForEachView views;
};

/// Functions of the part "octomap".
struct OctreeFunctions {
  static constexpr const char* kPart = "octomap";
  static constexpr std::uint64_t layout() { return core::layout_of<OctreeFunctions, OctreeWork, ViewRays>(); }
  /// The file's bytes.
  core::Result<std::string> (*make)(const OctreeWork& work);
};

}  // namespace plumbline::exports
