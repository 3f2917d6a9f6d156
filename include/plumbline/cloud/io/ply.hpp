// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// PLY files (Turk 1994) as plain columns: ascii, binary little endian and binary big endian in, binary little
// endian out. No PCL here: meant for clouds, meshes, reference surfaces and line sets alike.
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::cloud {

/// One named scalar per vertex. `uchar` properties stay bytes, every other type becomes float.
struct PlyColumn {
  std::string name;
  std::variant<std::vector<float>, std::vector<std::uint8_t>> values;
};

/// Vertices with named properties, and the elements that connect them.
struct PlyData {
  std::vector<PlyColumn> columns;  ///< all of length vertex_count, names unique, in file order
  std::size_t vertex_count = 0;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< polygons of a file arrive as fans
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::array<std::uint8_t, 3>> edge_colors;  ///< red, green, blue; empty or one per edge
  std::vector<std::string> comments;
  /// Added to the columns x, y and z, as doubles: the shift that read_ply subtracted, or that write_ply must
  /// add.
  std::array<double, 3> shift{};

  /// The column as floats or bytes; nullptr when there is none of this name and type.
  [[nodiscard]] const std::vector<float>* floats(std::string_view name) const;
  [[nodiscard]] const std::vector<std::uint8_t>* bytes(std::string_view name) const;
  /// Adds a column; the first one sets vertex_count.
  void add(std::string name, std::vector<float> values);
  void add(std::string name, std::vector<std::uint8_t> values);
};

/// Reads vertices, faces and edges; other elements and list properties are passed over. Every promise of the
/// header is checked against the file's size before memory is taken. Errors (kInput): not readable, not PLY,
/// truncated, text that is not a number, vertex index out of range. With `take_shift` x, y and z that have
/// more digits than a float are read less PlyData::shift; else they are rounded.
core::Result<PlyData> read_ply(const std::filesystem::path& file, bool take_shift = false);

/// Writes binary little endian: the columns in their order (float or uchar; x, y and z double where `shift`
/// is not zero), faces as `list uchar int vertex_indices`, edges as `int vertex1, int vertex2 [, uchar red,
/// green, blue]`. The file appears whole or not at all. Errors (kOutput).
core::Result<void> write_ply(const std::filesystem::path& file, const PlyData& data);

}  // namespace plumbline::cloud
