// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/fusion_tiles.hpp"

#include <algorithm>

#include "plumbline/cloud/fusion/cell_map.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::size_t kTiles = 4;
constexpr std::size_t kFewestCells = 300;  // of a tile that is worth its margin

using Cells = std::vector<Eigen::Vector3i>;

/// `space`: all cells that are this side of the cuts so far.
void cut(const Cells::iterator& begin, const Cells::iterator& end, const Eigen::AlignedBox3i& space,
         std::size_t most_cells, std::vector<FusionTile>& tiles) {
  Eigen::AlignedBox3i box;
  for (auto cell = begin; cell != end; ++cell) box.extend(*cell);
  const auto count = static_cast<std::size_t>(end - begin);
  int axis = 0;
  const Eigen::Vector3i size = box.sizes();
  size.maxCoeff(&axis);

  // Few enough cells: a tile, with the cells around
  if (count <= most_cells || size[axis] == 0) {
    const Eigen::AlignedBox3i around(box.min() - Eigen::Vector3i::Ones(),
                                     box.max() + Eigen::Vector3i::Ones());
    tiles.push_back({around.intersection(space), count, {}});
    return;
  }

  const auto by_axis = [axis](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    return a[axis] < b[axis];
  };

  const auto middle = begin + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(begin, middle, end, by_axis);

  // Neither side may be empty: the cut is below the median, unless that is the lowest plane.
  const int at = std::max((*middle)[axis], box.min()[axis] + 1);
  const auto border =
      std::partition(begin, end, [axis, at](const Eigen::Vector3i& cell) { return cell[axis] < at; });
  Eigen::AlignedBox3i low = space;
  Eigen::AlignedBox3i high = space;

  low.max()[axis] = at - 1;
  high.min()[axis] = at;
  cut(begin, border, low, most_cells, tiles);
  cut(border, end, high, most_cells, tiles);
}

}  // namespace

std::vector<FusionTile> plan_tiles(const std::vector<std::vector<ColorCell>>& views, std::size_t most_cells) {
  std::size_t count = 0;
  for (const auto& view : views) count += view.size();
  std::vector<std::uint64_t> keys;
  keys.reserve(count);
  for (const auto& view : views) {
    for (const ColorCell& cell : view) keys.push_back(cell.cell);
  }

  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<FusionTile> tiles;
  if (keys.empty()) return tiles;

  Cells cells;
  cells.reserve(keys.size());
  for (const std::uint64_t key : keys) cells.push_back(unpack_cell(key));

  // Several tiles even if one would suffice, because they are processed in parallel.
  const std::size_t share = std::max(kFewestCells, cells.size() / kTiles + 1);
  const Eigen::Vector3i most = Eigen::Vector3i::Constant(1 << 21);
  const Eigen::AlignedBox3i space(-most, most);
  cut(cells.begin(), cells.end(), space, std::max<std::size_t>(1, std::min(most_cells, share)), tiles);

  // Views with points in the tile or its margin
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (FusionTile& tile : tiles) {
      const Eigen::AlignedBox3i with_margin(tile.cells.min() - Eigen::Vector3i::Ones(),
                                            tile.cells.max() + Eigen::Vector3i::Ones());
      const bool reaches = std::any_of(views[v].begin(), views[v].end(), [&](const ColorCell& cell) {
        return with_margin.contains(unpack_cell(cell.cell));
      });
      if (reaches) tile.views.push_back(static_cast<std::uint32_t>(v));
    }
  }

  return tiles;
}

}  // namespace plumbline::cloud
