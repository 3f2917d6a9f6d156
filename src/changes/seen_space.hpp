// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Space that a stored map's cameras looked through. Private to the module.
#include <filesystem>
#include <optional>
#include <vector>

#include "plumbline/changes/changes.hpp"
#include "plumbline/cloud/fusion/free_space.hpp"
#include "plumbline/core/error.hpp"

namespace plumbline::changes {

class SeenSpace {
 public:
  /// The space of the map at `input`; `world_from_map`: into the frame of the points that are asked for.
  /// None: it has no store, or no clouds in it. Errors (kInput): damaged.
  static core::Result<std::optional<SeenSpace>> open(const std::filesystem::path& input,
                                                     const geometry::Rigid3& world_from_map,
                                                     const core::Executor& executor);

  /// 1: views look through the point, and no more than twice as many see a surface there; none if it is one
  /// view.
  [[nodiscard]] std::vector<std::uint8_t> looked_through(const std::vector<Eigen::Vector3f>& points,
                                                         const core::Executor& executor) const;
  [[nodiscard]] double first_stamp_s() const { return first_stamp_s_; }
  [[nodiscard]] double last_stamp_s() const { return last_stamp_s_; }

 private:
  std::vector<cloud::DepthRaster> rasters_;
  std::vector<geometry::Rigid3> camera_from_world_;
  double first_stamp_s_ = 0.0, last_stamp_s_ = 0.0;
};

}  // namespace plumbline::changes
