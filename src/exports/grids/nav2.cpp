// SPDX-License-Identifier: BSD-3-Clause
// A grid for ROS' map_server (Nav2): NAME.yaml and NAME.pgm.
#include <fmt/format.h>

#include "formats.hpp"
#include "grids/grid.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/maps/output_check.hpp"

namespace plumbline::exports {
namespace {

/// Grey values that map_server reads back by the thresholds below.
constexpr std::uint8_t kNav2Free = 254;
constexpr std::uint8_t kNav2Occupied = 0;
constexpr std::uint8_t kNav2Unknown = 205;  // (255 - 205) / 255 = 0.19608: just above free_thresh

/// The grid as an image, whose first row is the northernmost.
core::Result<void> write_pgm(const std::filesystem::path& file, const Grid& grid, const std::string& frame) {
  core::OutputFile out(file);
  out.write(
      fmt::format("P5\n# {:g} m/pixel; {}\n{} {}\n255\n", grid.resolution_m, frame, grid.columns, grid.rows));
  for (int row = grid.rows - 1; row >= 0; --row) {
    for (int column = 0; column < grid.columns; ++column) {
      const GridCell cell = grid.at(column, row);
      out.put(cell == GridCell::kFree       ? kNav2Free
              : cell == GridCell::kOccupied ? kNav2Occupied
                                            : kNav2Unknown);
    }
  }
  return out.commit();
}

/// Writes the grid's image, and the YAML file that names it.
core::Result<ExportSummary> write_nav2(MapSource& source, const std::filesystem::path& output) {
  std::filesystem::path image = output;
  std::filesystem::path yaml = output;
  image.replace_extension(".pgm");
  yaml.replace_extension(".yaml");
  if (auto free = maps::check_output(yaml, {}); !free) return tl::unexpected(free.error());

  const auto grid = make_grid(source);
  if (!grid) return tl::unexpected(grid.error());
  if (auto written = write_pgm(image, *grid, source.frame_text()); !written)
    return tl::unexpected(written.error());

  // These thresholds keep unknown cells unknown
  const auto written = core::write_file(
      yaml, fmt::format("# {}\n# occupied: between {:g} and {:g} m over the floor\nimage: {}\nmode: trinary\n"
                        "resolution: {:g}\norigin: [{:.6f}, {:.6f}, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
                        "free_thresh: 0.196\n",
                        source.frame_text(), source.options().heights[0], source.options().heights[1],
                        image.filename().string(), grid->resolution_m, grid->origin.x(), grid->origin.y()));
  if (!written) return tl::unexpected(written.error());

  ExportSummary summary;
  summary.written = {yaml, image};
  return summary;
}

}  // namespace

Format grid_format() {
  return {
      "grid",
      {".yaml", ".pgm"},
      {Content::kCloud},
      "map.db",
      "Occupancy grid for Nav2",
      "`NAME.yaml` and `NAME.pgm` for ROS' map_server, trinary. Occupied are cells in which anything was "
      "measured between `--heights` over the floor, also where floor was seen below it, as under a table; "
      "neither floor nor ceiling is in it. Free are other cells whose floor was seen and, up to 1 m over it, "
      "the air (but for 5 cm at most, as a table top that cameras only looked along is not measured), cells "
      "where the air was seen at all of `--heights`, and those where whoever carried the camera had room to "
      "stand (at most 0.2 m around its path). The rest is unknown, also the inside of a cabinet over which "
      "cameras looked. "
      "Both `free_thresh: 0.196` and the grey value 205 are chosen so that unknown stays unknown: with "
      "map_server's usual 0.25 it would load as free. The origin is the lower left corner in the map's "
      "frame, without a turn.",
      {"resolution", "heights", "voxel"},
      &write_nav2};
}

}  // namespace plumbline::exports
