// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Files of a comparison. Private to the module.
#include <filesystem>
#include <string>

#include "plumbline/changes/compare.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/viewer/scene.hpp"

namespace plumbline::changes {

/// Further contents of the files.
struct Shown {
  std::string before, after;  ///< names
  std::string placing;
  geometry::Rigid3 before_from_after;
  bool free_space_before = false, free_space_after = false;  ///< known
  bool swapped = false;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< of all coordinates of the comparison
  cloud::CloudFrame frame;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

/// "moved by 0.31 m, turned by 12 degrees", "shifted by 20.1 mm (limit 3.2 mm)", ...
std::string text_of(const Change& change);

/// changes.ply, changes.csv and summary.json.
core::Result<void> write_tables(const std::filesystem::path& folder, const Comparison& comparison,
                                const Shown& shown);
/// top.png, iso.png, distance.png: places by kind from above and aslant, and by the way that surfaces went.
core::Result<void> write_pictures(const std::filesystem::path& folder, const Comparison& comparison,
                                  const Shown& shown, const core::Executor& executor);
/// changes.html: both maps to walk through, and the list of changes beside them. Adds layers to the scene's
/// clouds.
core::Result<void> write_page(const std::filesystem::path& folder, const Comparison& comparison,
                              const Shown& shown, viewer::Scene& scene, const core::Executor& executor);

}  // namespace plumbline::changes
