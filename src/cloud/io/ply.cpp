// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/io/ply.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "io/ply_header.hpp"
#include "io/shift.hpp"
#include "plumbline/core/git_lfs.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::size_t kLargestPolygon = 1024;
constexpr double kLongestList = 65536.0;

/// Reads the records of one file after its header.
class Body {
 public:
  Body(ByteReader& reader, PlyFormat format)
      : reader_(reader), ascii_(format == PlyFormat::kAscii), swap_(format == PlyFormat::kBigEndian) {}

  /// False if the file ended or a word was not a number (see problem()).
  bool scalar(ScalarType type, double& value) {
    if (ascii_) return text_scalar(value);
    const std::uint8_t* bytes = reader_.take(size_of(type));
    if (bytes == nullptr) return false;
    value = load(type, bytes, swap_);
    return true;
  }

  bool list(const PlyProperty& property) {
    double count = 0.0;
    if (!scalar(property.count_type, count)) return false;

    // A damaged length must not allocate memory
    if (!(count >= 0.0) || count != std::floor(count)) return refuse("list length is not a natural number");
    if (count > kLongestList)
      return refuse("list with more than 65536 items; the file is damaged or no mesh: export it again");
    items_.resize(static_cast<std::size_t>(count));
    for (double& item : items_) {
      if (!scalar(property.type, item)) return false;
    }
    return true;
  }

  /// Items of the last list that was read.
  [[nodiscard]] const std::vector<double>& items() const { return items_; }
  [[nodiscard]] bool ascii() const { return ascii_; }
  [[nodiscard]] bool swap() const { return swap_; }
  [[nodiscard]] ByteReader& reader() { return reader_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  bool refuse(std::string problem) {
    problem_ = std::move(problem);
    return false;
  }

 private:
  bool text_scalar(double& value) {
    if (!reader_.word(word_)) {
      return word_.empty() ? false : refuse("'" + word_ + "...' is not a number");
    }
    const auto number = parse_number(word_);
    if (!number) return refuse("'" + word_ + "' is not a number");
    value = *number;
    return true;
  }

  ByteReader& reader_;
  bool ascii_;
  bool swap_;
  std::string word_;
  std::vector<double> items_;
  std::string problem_;
};

/// Destination of one fixed-size scalar of a vertex.
struct Sink {
  ScalarType type = ScalarType::kFloat32;
  std::size_t offset = 0;
  float* floats = nullptr;
  std::uint8_t* bytes = nullptr;
  double* doubles = nullptr;  ///< in their place
};

/// Positions with more digits than a float has, by axis, until the whole column is known; else empty.
using WidePositions = std::array<std::vector<double>, 3>;

void store(const Sink& sink, std::size_t row, double value) {
  if (sink.doubles != nullptr) {
    sink.doubles[row] = value;
    return;
  }
  if (sink.floats != nullptr) sink.floats[row] = static_cast<float>(value);
  if (sink.bytes != nullptr) sink.bytes[row] = to_byte(value);
}

std::vector<Sink> make_columns(const PlyElement& element, PlyData& data) {
  const auto count = static_cast<std::size_t>(element.count);
  data.vertex_count = count;
  std::vector<Sink> sinks;
  std::size_t offset = 0;

  // Bytes remain bytes, all others become floats
  for (const auto& property : element.properties) {
    if (property.list) continue;
    if (property.type == ScalarType::kUint8) {
      data.columns.push_back({property.name, std::vector<std::uint8_t>(count)});
    } else {
      data.columns.push_back({property.name, std::vector<float>(count)});
    }

    sinks.push_back({property.type, offset, nullptr, nullptr});
    offset += size_of(property.type);
  }

  // Addresses of the columns, once all exist
  for (std::size_t i = 0; i < sinks.size(); ++i) {
    auto& values = data.columns[i].values;
    if (auto* floats = std::get_if<std::vector<float>>(&values)) sinks[i].floats = floats->data();
    if (auto* bytes = std::get_if<std::vector<std::uint8_t>>(&values)) sinks[i].bytes = bytes->data();
  }

  return sinks;
}

/// Positions that exceed floats go to `wide` first.
void divert_positions(const PlyElement& element, bool ascii, const PlyData& data, std::vector<Sink>& sinks,
                      WidePositions& wide) {
  for (std::size_t i = 0; i < sinks.size(); ++i) {
    const auto axis = axis_of_column(meaning_of(data.columns[i].name));
    if (!axis || sinks[i].floats == nullptr || !(ascii || exceeds_float(sinks[i].type))) continue;
    auto& column = wide[static_cast<std::size_t>(*axis)];
    if (!column.empty()) continue;
    column.resize(static_cast<std::size_t>(element.count));
    sinks[i].doubles = column.data();
  }
}

/// Stores the positions in the columns, with a shift subtracted.
void store_positions(const WidePositions& wide, const std::vector<Sink>& sinks, PlyData& data) {
  for (std::size_t axis = 0; axis < wide.size(); ++axis) {
    if (wide[axis].empty()) continue;
    data.shift[axis] = axis_shift(wide[axis]);
    const auto sink = std::find_if(sinks.begin(), sinks.end(),
                                   [&](const Sink& s) { return s.doubles == wide[axis].data(); });
    for (std::size_t i = 0; i < wide[axis].size(); ++i)
      sink->floats[i] = static_cast<float>(wide[axis][i] - data.shift[axis]);
  }
}

bool has_lists(const PlyElement& element) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [](const auto& p) { return p.list; });
}

/// Reads scalars record by record, and lists into the body's items; visit(row, property, value) returns
/// whether to continue. Returns the number of records read.
template <typename Visit>
std::uint64_t read_records(Body& body, const PlyElement& element, const Visit& visit) {
  for (std::uint64_t row = 0; row < element.count; ++row) {
    for (const auto& property : element.properties) {
      double value = 0.0;
      if (!(property.list ? body.list(property) : body.scalar(property.type, value))) return row;
      if (!visit(row, property, value)) return row;
    }
  }
  return element.count;
}

/// Returns how many vertices were read.
std::uint64_t fill_columns(Body& body, const PlyElement& element, const std::vector<Sink>& sinks,
                           const PlyData& data) {
  // Records of equal size are read as blocks
  if (!body.ascii() && !has_lists(element)) {
    const std::size_t size = element.least_size(false);
    for (std::size_t row = 0; row < data.vertex_count; ++row) {
      const std::uint8_t* record = body.reader().take(size);
      if (record == nullptr) return row;

      // The usual types, without conversion
      for (const Sink& sink : sinks) {
        if (sink.type == ScalarType::kFloat32 && !body.swap()) {
          std::memcpy(sink.floats + row, record + sink.offset, 4);
        } else if (sink.type == ScalarType::kUint8) {
          sink.bytes[row] = record[sink.offset];
        } else {
          store(sink, row, load(sink.type, record + sink.offset, body.swap()));
        }
      }
    }

    return data.vertex_count;
  }

  // Text and lists, value by value
  std::size_t column = 0;
  return read_records(body, element, [&](std::uint64_t row, const PlyProperty& property, double value) {
    if (!property.list) store(sinks[column++ % sinks.size()], static_cast<std::size_t>(row), value);
    return true;
  });
}

std::uint64_t read_vertices(Body& body, const PlyElement& element, bool take_shift, PlyData& data) {
  std::vector<Sink> sinks = make_columns(element, data);
  WidePositions wide;

  // The shift follows from all positions as doubles
  if (take_shift) divert_positions(element, body.ascii(), data, sinks, wide);
  const std::uint64_t rows = fill_columns(body, element, sinks, data);
  if (rows == element.count) store_positions(wide, sinks, data);
  return rows;
}

bool to_index(double value, std::size_t vertices, std::uint32_t& index) {
  if (!(value >= 0.0) || value >= static_cast<double>(vertices) || value != std::floor(value)) return false;
  index = static_cast<std::uint32_t>(value);
  return true;
}

bool add_polygon(Body& body, const std::vector<double>& corners, PlyData& data) {
  if (corners.size() > kLargestPolygon) return body.refuse("face with more than 1024 corners");
  std::vector<std::uint32_t> indices(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!to_index(corners[i], data.vertex_count, indices[i])) {
      return body.refuse(fmt::format("vertex index {} is not below {}", corners[i], data.vertex_count));
    }
  }

  // A fan of triangles around the first corner
  for (std::size_t i = 2; i < indices.size(); ++i)
    data.triangles.push_back({indices[0], indices[i - 1], indices[i]});
  return true;
}

std::uint64_t read_faces(Body& body, const PlyElement& element, PlyData& data) {
  return read_records(body, element, [&](std::uint64_t, const PlyProperty& property, double) {
    const bool corners = property.name == "vertex_indices" || property.name == "vertex_index";
    return !property.list || !corners || add_polygon(body, body.items(), data);
  });
}

std::uint64_t read_edges(Body& body, const PlyElement& element, PlyData& data) {
  const auto count = static_cast<std::size_t>(element.count);
  const bool colored = std::any_of(element.properties.begin(), element.properties.end(),
                                   [](const auto& property) { return property.name == "red"; });
  data.edges.resize(count);
  data.edge_colors.resize(colored ? count : 0);

  // Edges must join vertices that exist
  return read_records(body, element, [&](std::uint64_t row, const PlyProperty& property, double value) {
    const bool first = property.name == "vertex1";
    if ((first || property.name == "vertex2") &&
        !to_index(value, data.vertex_count, data.edges[row][first ? 0 : 1])) {
      return body.refuse(fmt::format("vertex index {} is not below {}", value, data.vertex_count));
    }

    for (std::size_t k = 0; k < 3 && colored; ++k) {
      constexpr std::array<const char*, 3> kChannels{"red", "green", "blue"};
      if (property.name == kChannels[k]) data.edge_colors[row][k] = to_byte(value);
    }
    return true;
  });
}

/// Reads the records of one element. Returns "" or what is wrong with them.
std::string read_element(Body& body, const PlyElement& element, bool take_shift, PlyData& data) {
  const std::size_t least = element.least_size(body.ascii());
  // The last word of an ascii file needs no blank after it.
  const std::uint64_t room = body.reader().remaining() + (body.ascii() ? 1 : 0);
  if (element.count > 0 && least == 0) return fmt::format("element '{}' has no properties", element.name);

  // A false promise must not allocate memory
  if (element.count > 0 && element.count > room / least) {
    return fmt::format(
        "header promises {} of '{}' (at least {} bytes each) but {} bytes are left; the file is truncated",
        element.count, element.name, least, body.reader().remaining());
  }

  // Other elements are passed over
  std::uint64_t rows = 0;
  if (element.name == "vertex") {
    rows = read_vertices(body, element, take_shift, data);
  } else if (element.name == "face") {
    rows = read_faces(body, element, data);
  } else if (element.name == "edge") {
    rows = read_edges(body, element, data);
  } else {
    rows = read_records(body, element, [](auto&&...) { return true; });
  }

  if (rows == element.count) return "";
  const std::string place = fmt::format("'{}' {} of {}: ", element.name, rows + 1, element.count);
  return place + (body.problem().empty() ? "the file ends here; it is truncated" : body.problem());
}

/// Columns of different lengths are an error of the caller.
void check_lengths(const PlyData& data) {
  for (const auto& column : data.columns) {
    const std::size_t length = std::visit([](const auto& v) { return v.size(); }, column.values);
    if (length != data.vertex_count)
      throw std::invalid_argument("PLY column '" + column.name + "' has another length");
  }
  if (!data.edge_colors.empty() && data.edge_colors.size() != data.edges.size())
    throw std::invalid_argument("PLY edge colours");
}

/// Offset of a column's numbers; only positions are shifted, and written as doubles.
double shift_of(const PlyData& data, const PlyColumn& column) {
  const bool position = column.name == "x" || column.name == "y" || column.name == "z";
  return position ? data.shift[static_cast<std::size_t>(column.name[0] - 'x')] : 0.0;
}

/// Elements in the order in which their records follow.
std::string header_of(const PlyData& data) {
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  for (const auto& comment : data.comments) text += "comment " + comment + "\n";
  text += fmt::format("element vertex {}\n", data.vertex_count);

  for (const auto& column : data.columns) {
    const bool floats = std::holds_alternative<std::vector<float>>(column.values);
    const char* type = !floats ? "uchar" : shift_of(data, column) != 0.0 ? "double" : "float";
    text += fmt::format("property {} {}\n", type, column.name);
  }

  // Empty elements are left out
  if (!data.triangles.empty())
    text += fmt::format("element face {}\nproperty list uchar int vertex_indices\n", data.triangles.size());
  if (!data.edges.empty()) {
    text += fmt::format("element edge {}\nproperty int vertex1\nproperty int vertex2\n", data.edges.size());
    if (!data.edge_colors.empty()) text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  return text + "end_header\n";
}

/// Vertices with their absolute positions.
void put_vertices(const PlyData& data, core::OutputFile& out) {
  for (std::size_t row = 0; row < data.vertex_count; ++row) {
    for (const auto& column : data.columns) {
      const auto* floats = std::get_if<std::vector<float>>(&column.values);
      const double shift = floats != nullptr ? shift_of(data, column) : 0.0;
      if (shift != 0.0) {
        out.put(with_shift((*floats)[row], shift));
      } else {
        std::visit([&out, row](const auto& values) { out.put(values[row]); }, column.values);
      }
    }
  }
}

}  // namespace

const std::vector<float>* PlyData::floats(std::string_view name) const {
  for (const auto& column : columns) {
    if (column.name == name) return std::get_if<std::vector<float>>(&column.values);
  }
  return nullptr;
}

const std::vector<std::uint8_t>* PlyData::bytes(std::string_view name) const {
  for (const auto& column : columns) {
    if (column.name == name) return std::get_if<std::vector<std::uint8_t>>(&column.values);
  }
  return nullptr;
}

void PlyData::add(std::string name, std::vector<float> values) {
  if (columns.empty()) vertex_count = values.size();
  columns.push_back({std::move(name), std::move(values)});
}

void PlyData::add(std::string name, std::vector<std::uint8_t> values) {
  if (columns.empty()) vertex_count = values.size();
  columns.push_back({std::move(name), std::move(values)});
}

core::Result<PlyData> read_ply(const std::filesystem::path& file, bool take_shift) {
  ByteReader reader(file);
  if (!reader.open()) return core::input_error(file.string() + ": cannot be read");
  if (core::is_lfs_pointer(file)) return core::input_error(file.string() + ": " + core::kLfsPointer);
  auto header = read_ply_header(reader);
  if (!header) return core::input_error(file.string() + ": " + header.error().message);
  PlyData data;
  data.comments = header->comments;
  Body body(reader, header->format);

  // Elements follow in the order of the header
  for (const auto& element : header->elements) {
    const std::string problem = read_element(body, element, take_shift, data);
    if (!problem.empty()) return core::input_error(file.string() + ": " + problem);
  }
  return data;
}

core::Result<void> write_ply(const std::filesystem::path& file, const PlyData& data) {
  check_lengths(data);
  core::OutputFile out(file);
  out.write(header_of(data));
  put_vertices(data, out);

  // Triangles are lists of three
  for (const auto& triangle : data.triangles) {
    out.put(std::uint8_t{3});
    out.put(triangle);
  }

  for (std::size_t i = 0; i < data.edges.size(); ++i) {
    out.put(data.edges[i]);
    if (!data.edge_colors.empty()) out.put(data.edge_colors[i]);
  }

  return out.commit();
}

}  // namespace plumbline::cloud
