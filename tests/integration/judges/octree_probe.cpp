// SPDX-License-Identifier: BSD-3-Clause
// octree_probe FILE.bt|.ot X Y Z X Y Z: a place that a camera was at must be free, one on a surface occupied,
// one far below the floor unknown. Knows liboctomap only.
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

namespace {

template <typename Tree>
const char* state(const Tree& tree, double x, double y, double z) {
  const auto* node = tree.search(x, y, z);
  if (node == nullptr) return "unknown";
  return tree.isNodeOccupied(node) ? "occupied" : "free";
}

template <typename Tree>
int probe(const Tree& tree, const double (&at)[6]) {
  const std::string free = state(tree, at[0], at[1], at[2]);
  const std::string wall = state(tree, at[3], at[4], at[5]);
  const std::string below = state(tree, at[0], at[1], -5.0);
  std::printf("%zu nodes, %.3f m: camera %s, wall %s, below the floor %s\n", tree.size(),
              tree.getResolution(), free.c_str(), wall.c_str(), below.c_str());
  return free == "free" && wall == "occupied" && below == "unknown" ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 8) return 2;
  double at[6];
  for (int i = 0; i < 6; ++i) at[i] = std::strtod(argv[i + 2], nullptr);
  const std::string file = argv[1];
  if (file.size() > 3 && file.substr(file.size() - 3) == ".bt") {
    const octomap::OcTree tree(file);
    return probe(tree, at);
  }
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(file));
  const auto* tree = dynamic_cast<const octomap::ColorOcTree*>(read.get());
  return tree == nullptr ? 3 : probe(*tree, at);
}
