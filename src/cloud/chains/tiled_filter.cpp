// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/filters/tiled_filter.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <optional>

#include "chains/ply_tiles.hpp"
#include "io/cloud_table.hpp"
#include "plumbline/cloud/columns.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::cloud {
namespace {

namespace fs = std::filesystem;

/// A folder next to the output, removed together with this object.
class TileFolder {
 public:
  explicit TileFolder(const fs::path& output)
      : path_(output.parent_path() / ("." + output.filename().string() + ".tiles")) {}
  TileFolder(const TileFolder&) = delete;
  TileFolder& operator=(const TileFolder&) = delete;
  ~TileFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  core::Result<void> make() const {
    std::error_code ignored;
    fs::remove_all(path_, ignored);  // of a run that was killed
    return core::make_folder(path_);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// The filtered points of a tile that are its own, not those of its margin.
void keep_own(Cloud& cloud, CloudColumns& columns, const Eigen::Vector3d& shift, const TileKey& key,
              double tile_m) {
  std::vector<std::size_t> own;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d position = cloud[i].getVector3fMap().cast<double>() + shift;
    if (position.allFinite() && tile_of(position, tile_m) == key) own.push_back(i);
  }

  columns = pick_columns(columns, own);
  for (std::size_t i = 0; i < own.size(); ++i) cloud.points[i] = cloud.points[own[i]];
  cloud.points.resize(own.size());
  cloud.width = static_cast<std::uint32_t>(own.size());
  cloud.height = 1;
}

/// Reads up to and including the end of a header; the text.
std::string header_text(ByteReader& reader) {
  std::string text;
  std::string line;
  while (reader.line(line, 4096)) {
    text += line + "\n";
    if (line == "end_header") break;
  }
  return text;
}

/// One file of the points of all pieces, which have the same properties.
core::Result<void> join(const std::vector<fs::path>& pieces, std::size_t points, const fs::path& output) {
  core::OutputFile out(output);
  std::string properties;
  for (const fs::path& piece : pieces) {
    ByteReader reader(piece);
    const std::string header = header_text(reader);
    const std::size_t count = header.find("element vertex ");
    const std::size_t behind = header.find('\n', count);

    // The first piece's header, with the points of all
    if (properties.empty()) {
      properties = header.substr(behind);
      out.write(header.substr(0, count) + fmt::format("element vertex {}", points) + properties);
    } else if (header.substr(behind) != properties) {
      return core::usage_error("the chain gives tiles different properties; run it without --tiles");
    }

    // The points follow unchanged, block by block
    constexpr std::uint64_t kBlock = 1 << 18;
    while (reader.remaining() > 0) {
      const auto size = static_cast<std::size_t>(std::min(kBlock, reader.remaining()));
      const std::uint8_t* bytes = reader.take(size);
      if (bytes == nullptr) return core::input_error(piece.string() + ": cannot be read back");
      out.write(bytes, size);
    }
  }

  return out.commit();
}

/// Radius around a tile whose points decide about its own, metres.
core::Result<double> margin_of(const FilterChain& chain, double tile_m) {
  const auto reach = chain.reach_m();
  if (!reach) return tl::unexpected(reach.error());

  // Small tiles would be mostly margin
  constexpr double kRounding_m = 0.001;
  const double margin_m = *reach + kRounding_m;
  if (tile_m < 4.0 * margin_m) {
    return core::usage_error(fmt::format(
        "tiles of {:g} m are too small for chain {}, whose filters look {:g} m far; use {:g} m or more",
        tile_m, chain.name(), *reach, 4.0 * margin_m));
  }
  return margin_m;
}

/// Every point into the files of its tiles.
core::Result<void> cut_into_tiles(const std::vector<fs::path>& inputs, PlyTiles& tiles) {
  for (const fs::path& input : inputs) {
    if (core::ending_of(input) != ".ply")
      return core::input_error(input.string() + ": tiles are cut from binary PLY files");
    if (auto added = tiles.add(input); !added) return tl::unexpected(added.error());
  }
  return tiles.finish();
}

struct FilteredTile {
  CloudPtr cloud;
  CloudColumns columns;
};

/// The chain on a tile with its margin, of which the tile is kept. Removes the tile's file.
core::Result<FilteredTile> filter_tile(const FilterChain& chain, const fs::path& file, const TileKey& key,
                                       double tile_m, FilterContext context) {
  auto tile = read_cloud(file, LargeCoordinates::kShifted);
  if (!tile) return tl::unexpected(tile.error());
  change_shift(*tile->cloud, tile->shift, context.shift);

  // Points made by filters get columns of their own
  FilteredTile made;
  context.columns = &tile->columns;
  context.made_columns = &made.columns;
  auto filtered = chain.apply(std::move(tile->cloud), context);
  if (!filtered) return tl::unexpected(filtered.error());
  made.cloud = std::move(*filtered);
  keep_own(*made.cloud, made.columns, context.shift, key, tile_m);

  // The disk holds a tile only once
  std::error_code ignored;
  fs::remove(file, ignored);
  return made;
}

}  // namespace

CloudFrame frame_of_ply(const fs::path& file) {
  ByteReader reader(file);
  const auto header = read_ply_header(reader);
  return header ? frame_in(header->comments) : CloudFrame();
}

core::Result<TiledReport> filter_in_tiles(const FilterChain& chain, const TiledFiles& files, double tile_m,
                                          CloudFrame& frame, const core::Executor* executor,
                                          const std::function<void(std::size_t, std::size_t)>& progress) {
  const auto margin_m = margin_of(chain, tile_m);
  if (!margin_m) return tl::unexpected(margin_m.error());
  const TileFolder folder(files.output);
  if (auto made = folder.make(); !made) return tl::unexpected(made.error());
  PlyTiles tiles(folder.path(), tile_m, *margin_m);
  if (auto made = cut_into_tiles(files.inputs, tiles); !made) return tl::unexpected(made.error());

  // All tiles refer to one shift
  TiledReport report;
  report.points_in = tiles.points();
  const std::vector<TileKey> keys = tiles.keys();
  report.tiles = keys.size();
  FilterContext context;
  context.shift = tiles.shift();
  context.executor = executor;
  context.frame = &frame;

  // Tile by tile, so that memory holds one at a time
  std::vector<fs::path> pieces;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (progress) progress(i, keys.size());
    report.fullest = std::max(report.fullest, tiles.points_of(keys[i]));
    const auto tile = filter_tile(chain, tiles.file_of(keys[i]), keys[i], tile_m, context);
    if (!tile) return tl::unexpected(tile.error());

    // Empty tiles have no file
    if (tile->cloud->empty()) continue;
    report.points_out += tile->cloud->size();
    pieces.push_back(folder.path() / fmt::format("piece{}.ply", i));
    if (auto written = write_ply(pieces.back(), *tile->cloud, tile->columns, context.shift, frame.comments());
        !written)
      return tl::unexpected(written.error());
  }

  if (progress) progress(keys.size(), keys.size());
  const auto written = pieces.empty() ? write_ply(files.output, Cloud(), {}, context.shift, frame.comments())
                                      : join(pieces, report.points_out, files.output);
  if (!written) return tl::unexpected(written.error());
  return report;
}

}  // namespace plumbline::cloud
