// SPDX-License-Identifier: BSD-3-Clause
#include "io/ply_header.hpp"

#include <fmt/format.h>

#include <sstream>

namespace plumbline::cloud {
namespace {

constexpr std::size_t kLongestLine = 4096;
constexpr int kMostLines = 2000;

// Scalar type by its old or its new name.
std::optional<ScalarType> scalar_type(const std::string& name) {
  if (name == "char" || name == "int8") return ScalarType::kInt8;
  if (name == "uchar" || name == "uint8") return ScalarType::kUint8;
  if (name == "short" || name == "int16") return ScalarType::kInt16;
  if (name == "ushort" || name == "uint16") return ScalarType::kUint16;
  if (name == "int" || name == "int32") return ScalarType::kInt32;
  if (name == "uint" || name == "uint32") return ScalarType::kUint32;
  if (name == "int64" || name == "long") return ScalarType::kInt64;
  if (name == "uint64" || name == "ulong") return ScalarType::kUint64;
  if (name == "float" || name == "float32") return ScalarType::kFloat32;
  if (name == "double" || name == "float64") return ScalarType::kFloat64;
  return std::nullopt;
}

// The format line; "" or the problem, as for the lines below.
std::string parse_format(std::istringstream& words, PlyHeader& header) {
  std::string name;
  std::string version;
  words >> name >> version;
  if (name == "ascii") {
    header.format = PlyFormat::kAscii;
  } else if (name == "binary_little_endian") {
    header.format = PlyFormat::kLittleEndian;
  } else if (name == "binary_big_endian") {
    header.format = PlyFormat::kBigEndian;
  } else {
    return "format '" + name + "' is not ascii, binary_little_endian or binary_big_endian";
  }
  return version == "1.0" ? "" : "format version '" + version + "' is not 1.0";
}

std::string parse_element(std::istringstream& words, PlyHeader& header) {
  std::string count;
  PlyElement element;
  words >> element.name >> count;
  const auto number = parse_count(count);
  if (element.name.empty() || !number) return "element needs a name and a count";

  // Elements are found by name
  for (const auto& other : header.elements) {
    if (other.name == element.name) return "element '" + element.name + "' is there twice";
  }
  element.count = *number;
  header.elements.push_back(std::move(element));
  return "";
}

std::string parse_property(std::istringstream& words, PlyHeader& header) {
  if (header.elements.empty()) return "property before the first element";
  PlyProperty property;
  std::string type;
  words >> type;

  // A list has a type for its length as well
  if (type == "list") {
    property.list = true;
    std::string count_type;
    words >> count_type >> type;
    const auto counts = scalar_type(count_type);
    if (!counts || *counts == ScalarType::kFloat32 || *counts == ScalarType::kFloat64) {
      return "list count type '" + count_type + "' is not an integer type";
    }
    property.count_type = *counts;
  }

  const auto items = scalar_type(type);
  words >> property.name;
  if (!items) return "property type '" + type + "' is not known";
  if (property.name.empty()) return "property without a name";

  // Columns are found by name, which must be unique
  property.type = *items;
  auto& properties = header.elements.back().properties;
  for (const auto& other : properties) {
    if (other.name == property.name) return "property '" + property.name + "' is there twice";
  }
  properties.push_back(std::move(property));
  return "";
}

}  // namespace

core::Result<PlyHeader> read_ply_header(ByteReader& reader) {
  PlyHeader header;
  std::string line;
  const bool begun = reader.line(line, kLongestLine);
  line.erase(line.find_last_not_of(" \t\r") + 1);  // some programs end their lines with blanks
  if (!begun || line != "ply") return core::input_error("is not a PLY file (no 'ply' at its start)");

  bool format = false;
  for (int number = 2; number <= kMostLines; ++number) {
    if (!reader.line(line, kLongestLine)) break;
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    std::string problem;

    // The header is complete
    if (keyword == "end_header") {
      if (!format) return core::input_error("PLY header has no format line");
      return header;
    }

    // Comments are kept, obj_info is not
    if (keyword == "format") {
      problem = parse_format(words, header);
      format = true;
    } else if (keyword == "comment" || keyword == "obj_info") {
      const auto text = line.find_first_not_of(' ', line.find(keyword) + keyword.size());
      if (keyword == "comment") header.comments.push_back(text == std::string::npos ? "" : line.substr(text));
    } else if (keyword == "element") {
      problem = parse_element(words, header);
    } else if (keyword == "property") {
      problem = parse_property(words, header);
    } else if (!keyword.empty()) {
      problem = "'" + keyword.substr(0, 40) + "' is not a PLY header word";
    }

    if (!problem.empty()) return core::input_error(fmt::format("line {}: {}", number, problem));
  }

  return core::input_error("PLY header has no end_header; the file is truncated or not PLY");
}

}  // namespace plumbline::cloud
