// SPDX-License-Identifier: BSD-3-Clause
// Octrees, by liboctomap.
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <sstream>

#include "grids/octree.hpp"

namespace plumbline::exports {
namespace {

octomap::point3d point3d_of(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// Marks the cells that one view saw through as free, each once, however many rays cross it.
template <typename Tree>
void add_free(const ViewRays& view, const Eigen::AlignedBox3d& box, Tree& tree) {
  const double margin_m = tree.getResolution();
  octomap::KeySet ends;
  octomap::KeySet free;
  octomap::KeyRay ray;
  octomap::OcTreeKey key;

  // Rays that end in the same cell count once
  for (const Eigen::Vector3f& end : view.ends) {
    const Eigen::Vector3d way = end.cast<double>() - view.origin;
    const double length_m = way.norm();
    if (length_m <= margin_m) continue;

    // Up to one cell before the surface
    const octomap::point3d last = point3d_of(view.origin + (1.0 - margin_m / length_m) * way);
    if (!tree.coordToKeyChecked(last, key) || !ends.insert(key).second) continue;
    if (!tree.computeRayKeys(point3d_of(view.origin), last, ray)) continue;
    free.insert(ray.begin(), ray.end());
    free.insert(key);
  }

  // Free cells in the selected box
  for (const octomap::OcTreeKey& cell : free) {
    const octomap::point3d at = tree.keyToCoord(cell);
    if (box.contains(Eigen::Vector3d(at.x(), at.y(), at.z()))) tree.updateNode(cell, false, true);
  }
}

/// The cloud's cells are occupied, whatever rays that grazed them say.
template <typename Tree, typename Color>
void add_occupied(const cloud::CloudFile& file, Tree& tree, const Color& color) {
  for (const cloud::Point& p : *file.cloud) {
    octomap::OcTreeKey key;
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>() + file.shift;
    if (!tree.coordToKeyChecked(point3d_of(at), key)) continue;
    tree.setNodeValue(key, tree.getClampingThresMaxLog(), true);
    color(tree, key, p);
  }
}

/// Free cells first: points then override rays that grazed their cells.
template <typename Tree, typename Color>
core::Result<void> fill(const OctreeWork& work, Tree& tree, const Color& color) {
  auto seen = work.views([&](const ViewRays& view) -> core::Result<void> {
    add_free(view, work.box, tree);
    return {};
  });
  if (!seen) return seen;

  // Inner nodes summarise their children
  add_occupied(*work.cloud, tree, color);
  tree.updateInnerOccupancy();
  tree.prune();
  return {};
}

/// The text before a tree's data; liboctomap's own writers print what they do.
template <typename Tree>
void put_head(const char* first_line, const OctreeWork& work, const Tree& tree, std::ostream& out) {
  out << first_line << "\n# (feel free to add / change comments, but leave the first line as it is!)\n# "
      << work.frame << "\nid " << tree.getTreeType() << "\nsize " << tree.size() << "\nres "
      << tree.getResolution() << "\ndata\n";
}

/// The bytes of an octree, with colours or as a binary tree.
core::Result<std::string> make_octree(const OctreeWork& work) {
  std::ostringstream bytes;
  if (work.color) {
    octomap::ColorOcTree tree(work.resolution_m);
    const auto paint = [](octomap::ColorOcTree& to, const octomap::OcTreeKey& key, const cloud::Point& p) {
      to.averageNodeColor(key, p.r, p.g, p.b);
    };
    if (auto filled = fill(work, tree, paint); !filled) return tl::unexpected(filled.error());

    // Colours need the full tree
    put_head("# Octomap OcTree file", work, tree, bytes);
    tree.writeData(bytes);
  } else {
    octomap::OcTree tree(work.resolution_m);
    const auto nothing = [](octomap::OcTree&, const octomap::OcTreeKey&, const cloud::Point&) {};
    if (auto filled = fill(work, tree, nothing); !filled) return tl::unexpected(filled.error());

    // The binary tree holds occupied and free only
    tree.toMaxLikelihood();
    tree.prune();
    put_head("# Octomap OcTree binary file", work, tree, bytes);
    tree.writeBinaryData(bytes);
  }

  return bytes.str();
}

}  // namespace
}  // namespace plumbline::exports

namespace px = plumbline::exports;
PLUMBLINE_PART(px::OctreeFunctions, &px::make_octree)
