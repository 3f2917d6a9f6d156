// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The header of a PLY file.
#include <cstdint>
#include <string>
#include <vector>

#include "io/byte_reader.hpp"
#include "io/scalar.hpp"
#include "plumbline/core/error.hpp"

namespace plumbline::cloud {

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::kFloat32;  ///< type of the value, or of a list's items
  bool list = false;
  ScalarType count_type = ScalarType::kUint8;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Bytes that one record needs at least.
  [[nodiscard]] std::size_t least_size(bool ascii) const {
    std::size_t size = 0;
    for (const auto& p : properties) size += ascii ? 2 : size_of(p.list ? p.count_type : p.type);
    return size;
  }
};

enum class PlyFormat { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;
};

/// Reads up to and including end_header. Error messages without the file's name.
core::Result<PlyHeader> read_ply_header(ByteReader& reader);

}  // namespace plumbline::cloud
