// SPDX-License-Identifier: BSD-3-Clause
// OctoMap (Hornung et al. 2013): cells that are occupied, free, or not in the tree, for planning.
#include <fmt/format.h>

#include "formats.hpp"
#include "grids/octree.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::exports {
namespace {

/// Writes an octree; the part "octomap" makes it.
core::Result<ExportSummary> write_octomap(MapSource& source, const std::filesystem::path& output) {
  constexpr double kDefault_m = 0.05;
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  const auto& octomap = core::part<OctreeFunctions>();
  if (!octomap) return tl::unexpected(octomap.error());

  // The ending decides between colours and the binary tree
  OctreeWork work;
  work.resolution_m = source.options().resolution_m > 0.0 ? source.options().resolution_m : kDefault_m;
  work.color = core::ending_of(output) == ".ot";
  work.frame = source.frame_text();
  work.cloud = *cloud;
  work.box = source.selected();
  work.views = [&](const auto& take) { return for_each_view(source, take); };

  // The file appears only when it is whole
  const auto bytes = (*octomap)->make(work);
  if (!bytes) return tl::unexpected(bytes.error());
  if (auto written = core::write_file(output, *bytes); !written) return tl::unexpected(written.error());

  ExportSummary summary;
  summary.written = {output};
  return summary;
}

}  // namespace

Format octomap_format() {
  return {"octomap",
          {".bt", ".ot"},
          {Content::kCloud},
          "map.db",
          "OctoMap for planning",
          "Written by liboctomap. Cells with points of the cloud are occupied, those that cameras saw "
          "through are free, all others are not in the tree. `.bt` is the binary tree that octomap_server "
          "loads, `.ot` a ColorOcTree with probabilities and colours.",
          {"resolution", "voxel"},
          &write_octomap};
}

}  // namespace plumbline::exports
