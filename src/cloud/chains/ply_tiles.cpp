// SPDX-License-Identifier: BSD-3-Clause
#include "chains/ply_tiles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>

#include "io/shift.hpp"
#include "plumbline/core/release.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::size_t kMostWaiting = std::size_t{1} << 27;  // bytes in memory before they are written
constexpr std::size_t kMostTiles = 50000;

const char* name_of(ScalarType type) {
  constexpr std::array<const char*, 10> kNames{"char", "uchar", "short",  "ushort", "int",
                                               "uint", "int64", "uint64", "float",  "double"};
  return kNames[static_cast<std::size_t>(type)];
}

tl::unexpected<core::Error> cannot_write(const std::filesystem::path& file) {
  return core::output_error(file.string() + ": cannot be written; is the disk full?");
}

}  // namespace

core::Result<void> PlyTiles::take_layout(const std::filesystem::path& file, const PlyHeader& header) {
  const auto refused = [&file](const std::string& why) {
    return core::input_error(file.string() + ": " + why);
  };

  if (header.format == PlyFormat::kAscii)
    return refused(
        "is a text file; tiles need binary PLY: write it as one with a chain without filters first");

  // Only points, since tiles would cut a mesh
  if (header.elements.empty() || header.elements.front().name != "vertex")
    return refused("does not begin with points");
  for (std::size_t i = 1; i < header.elements.size(); ++i) {
    if (header.elements[i].count > 0) return refused("is a mesh, which tiles would cut; a cloud is needed");
  }

  const std::vector<PlyProperty>& properties = header.elements.front().properties;
  const auto same = [](const PlyProperty& a, const PlyProperty& b) {
    return a.name == b.name && a.type == b.type;
  };

  // Properties must be those of the first file
  if (record_size_ > 0) {
    const bool fits = header.format == format_ && std::equal(properties.begin(), properties.end(),
                                                             properties_.begin(), properties_.end(), same);
    return fits ? core::Result<void>()
                : refused("has other properties than the first cloud; filter it by itself");
  }

  // Offsets of x, y and z within a record.
  int found = 0;
  for (const PlyProperty& property : properties) {
    if (property.list)
      return refused(fmt::format("has lists ('{}') at its points; tiles need plain numbers", property.name));
    const std::size_t axis =
        property.name.size() == 1 ? std::string("xyz").find(property.name) : std::string::npos;

    if (axis != std::string::npos) {
      offset_[axis] = record_size_;
      position_type_[axis] = property.type;
      ++found;
    }
    record_size_ += size_of(property.type);
  }

  format_ = header.format;
  properties_ = properties;
  return found == 3 ? core::Result<void>() : refused("has no x, y and z; it is not a point cloud");
}

core::Result<void> PlyTiles::add(const std::filesystem::path& file) {
  ByteReader reader(file);
  if (!reader.open()) return core::input_error(file.string() + ": does not exist, or cannot be read");

  // All files must have the same properties
  const auto header = read_ply_header(reader);
  if (!header) return core::input_error(file.string() + ": " + header.error().message);
  if (auto fits = take_layout(file, *header); !fits) return fits;

  // A truncated file is refused before its points are read
  const std::uint64_t count = header->elements.front().count;
  if (count > reader.remaining() / record_size_) {
    return core::input_error(fmt::format("{}: is truncated: {} points are promised, {} are there",
                                         file.string(), count, reader.remaining() / record_size_));
  }

  // Every file's points, some of the first's as a sample
  const bool first = points_ == 0;
  const std::uint64_t sampled = std::max<std::uint64_t>(1, count / 1000);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint8_t* record = reader.take(record_size_);
    if (record == nullptr) return core::input_error(file.string() + ": cannot be read to its end");
    if (first && i % sampled == 0) sample(record);
    put(record);

    // Each tile is a file
    if (tiles_.size() > kMostTiles) {
      return core::usage_error(
          fmt::format("{}: more than {} tiles of {:g} m; use larger ones, or remove far points first",
                      file.string(), kMostTiles, tile_m_));
    }

    // Points wait in memory and are written together
    if (waiting_ < kMostWaiting) continue;
    if (auto written = write_waiting(); !written) return written;
  }

  return {};
}

double PlyTiles::coordinate(const std::uint8_t* record, std::size_t axis) const {
  return load(position_type_[axis], record + offset_[axis], format_ == PlyFormat::kBigEndian);
}

void PlyTiles::sample(const std::uint8_t* record) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (exceeds_float(position_type_[k])) sample_[k].push_back(coordinate(record, k));
  }
}

void PlyTiles::put(const std::uint8_t* record) {
  const Eigen::Vector3d position(coordinate(record, 0), coordinate(record, 1), coordinate(record, 2));
  if (!position.allFinite()) return;

  ++points_;

  // The tile of the point, and those to whose margin it belongs.
  const TileKey first = tile_of(position - Eigen::Vector3d::Constant(margin_m_), tile_m_);
  const TileKey last = tile_of(position + Eigen::Vector3d::Constant(margin_m_), tile_m_);

  for (std::int64_t x = first[0]; x <= last[0]; ++x) {
    for (std::int64_t y = first[1]; y <= last[1]; ++y) {
      for (std::int64_t z = first[2]; z <= last[2]; ++z) {
        Tile& tile = tiles_[{x, y, z}];
        tile.waiting.insert(tile.waiting.end(), record, record + record_size_);
        ++tile.points;
        waiting_ += record_size_;
      }
    }
  }
}

core::Result<void> PlyTiles::write_waiting() {
  for (auto& [key, tile] : tiles_) {
    if (tile.waiting.empty()) continue;

    // The header of a new tile is completed in the end
    const std::filesystem::path file = file_of(key);
    std::error_code error;
    const bool begun = std::filesystem::exists(file, error);
    std::ofstream out(file, std::ios::binary | std::ios::app);
    if (!begun) out << header(0);
    out.write(reinterpret_cast<const char*>(tile.waiting.data()),
              static_cast<std::streamsize>(tile.waiting.size()));
    out.close();
    if (!out) return cannot_write(file);
    core::release(tile.waiting);
  }
  waiting_ = 0;
  return {};
}

core::Result<void> PlyTiles::finish() {
  if (auto written = write_waiting(); !written) return written;

  // Only now are the numbers of points known
  for (const auto& [key, tile] : tiles_) {
    std::fstream out(file_of(key), std::ios::binary | std::ios::in | std::ios::out);
    out << header(tile.points);
    out.close();
    if (!out) return cannot_write(file_of(key));
  }
  return {};
}

/// The header has the same length for any number of points.
std::string PlyTiles::header(std::size_t points) const {
  std::string text = fmt::format("ply\nformat binary_{}_endian 1.0\nelement vertex {:012}\n",
                                 format_ == PlyFormat::kBigEndian ? "big" : "little", points);
  for (const PlyProperty& property : properties_)
    text += fmt::format("property {} {}\n", name_of(property.type), property.name);
  return text + "end_header\n";
}

std::vector<TileKey> PlyTiles::keys() const {
  std::vector<TileKey> keys;
  for (const auto& [key, tile] : tiles_) keys.push_back(key);
  return keys;
}

std::filesystem::path PlyTiles::file_of(const TileKey& key) const {
  return folder_ / fmt::format("{}_{}_{}.ply", key[0], key[1], key[2]);
}

Eigen::Vector3d PlyTiles::shift() const {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 3; ++k) shift[static_cast<Eigen::Index>(k)] = axis_shift(sample_[k]);
  return shift;
}

}  // namespace plumbline::cloud
