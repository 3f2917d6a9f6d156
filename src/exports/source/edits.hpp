// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// edits.yaml: what a person takes out of a map, without a change to the map (docs/guide/control.md).
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/exports/edits.hpp"

namespace plumbline::exports {

/// In the frame of results, metres.
class Edits {
 public:
  /// The file `named`, or edits.yaml in `folder` if there is one. Errors (kUsage): file, line, what is wrong.
  static core::Result<Edits> of(const std::string& named, const std::filesystem::path& folder);
  static core::Result<Edits> parse(const std::filesystem::path& file);
  /// Ceilings go: what the edits call so, and what faces down more than 1.8 m over the floor below it.
  void take_ceilings(std::vector<double> floors);
  [[nodiscard]] bool removes(const Eigen::Vector3d& p, float normal_z) const;

 private:
  struct Piece {
    Eigen::AlignedBox3d box;               ///< around all of it
    std::vector<Eigen::Vector2d> polygon;  ///< as seen from above; empty: the whole box
    bool ceiling = false;                  ///< goes with the ceilings only
    [[nodiscard]] bool contains(const Eigen::Vector3d& p) const;
  };
  std::vector<Piece> pieces_;
  std::vector<double> floors_;
  bool no_ceilings_ = false;
};

}  // namespace plumbline::exports
