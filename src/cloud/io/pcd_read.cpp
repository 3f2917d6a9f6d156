// SPDX-License-Identifier: BSD-3-Clause
// PCD v0.6 and v0.7 (pointclouds.org, "The PCD file format"). The header is checked against the file before
// memory is taken, which PCL's reader does not do; the decompression is PCL's.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <deque>
#include <sstream>

#include "filters/pcl_functions.hpp"
#include "io/byte_reader.hpp"
#include "io/cloud_table.hpp"
#include "io/scalar.hpp"
#include "io/shift.hpp"

namespace plumbline::cloud {
namespace {

struct PcdField {
  std::string name;
  std::uint64_t size = 4;
  char type = 'F';
  std::uint64_t count = 1;
  std::uint64_t offset = 0;  ///< bytes into the record
  Meaning meaning = Meaning::kNone;
  ScalarType scalar = ScalarType::kFloat32;
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::uint64_t width = 0;
  std::uint64_t height = 1;
  std::uint64_t points = 0;
  std::uint64_t record = 0;    ///< bytes of one point
  std::uint64_t elements = 0;  ///< numbers of one point
  std::vector<double> viewpoint;
  std::vector<std::string> comments;
  std::string data;
};

std::string finish_fields(PcdHeader& header) {
  if (header.fields.empty()) return "has no FIELDS line";
  for (auto& field : header.fields) {
    // The scalar type follows from SIZE and TYPE
    const auto t = field.type;
    switch (field.size) {
      case 1:
        field.scalar = t == 'U' ? ScalarType::kUint8 : ScalarType::kInt8;
        break;
      case 2:
        field.scalar = t == 'U' ? ScalarType::kUint16 : ScalarType::kInt16;
        break;

      case 4:
        field.scalar = t == 'F' ? ScalarType::kFloat32 : t == 'U' ? ScalarType::kUint32 : ScalarType::kInt32;
        break;
      case 8:
        field.scalar = t == 'F' ? ScalarType::kFloat64 : t == 'U' ? ScalarType::kUint64 : ScalarType::kInt64;
        break;
      default:
        return fmt::format("field '{}' has SIZE {}, allowed are 1, 2, 4 and 8", field.name, field.size);
    }

    // Combinations that PCD does not have
    if (t != 'F' && t != 'U' && t != 'I')
      return fmt::format("field '{}' has TYPE {}, not F, U or I", field.name, t);
    if (t == 'F' && field.size < 4)
      return fmt::format("field '{}' is a float of {} bytes", field.name, field.size);
    if (field.count == 0 || field.count > 65536)
      return fmt::format("field '{}' has COUNT {}", field.name, field.count);

    // Only single values have a meaning
    field.offset = header.record;
    header.record += field.size * field.count;
    header.elements += field.count;
    field.meaning = field.count == 1 ? meaning_of(field.name) : Meaning::kNone;
    if (field.meaning == Meaning::kPackedColor && field.size != 4) field.meaning = Meaning::kNone;
  }

  // POINTS may be missing
  if (header.points == 0) header.points = header.width * header.height;
  if (header.width != 0 && header.width * header.height != header.points) {
    return fmt::format("WIDTH {} x HEIGHT {} is not POINTS {}", header.width, header.height, header.points);
  }
  if (header.points > 0xFFFFFFFFU) return fmt::format("POINTS {} is more than 2^32", header.points);

  return "";
}

/// One number per field into the member that `key` names.
std::string parse_per_field(const std::string& key, std::istringstream& words, PcdHeader& header) {
  std::string word;
  for (auto& field : header.fields) {
    if (!(words >> word)) return key + " has fewer entries than FIELDS";
    const auto number = parse_count(word);
    if (key == "TYPE") {
      field.type = word.size() == 1 ? word[0] : '?';
    } else if (!number) {
      return fmt::format("{}: '{}' is not a number", key, word);
    } else {
      (key == "SIZE" ? field.size : field.count) = *number;
    }
  }
  return words >> word ? key + " has more entries than FIELDS" : "";
}

std::string parse_line(const std::string& key, std::istringstream& words, PcdHeader& header) {
  std::string word;
  if (key == "VERSION") return "";
  if (key == "FIELDS" || key == "COLUMNS") {
    while (words >> word) {
      PcdField field;
      field.name = word;
      header.fields.push_back(field);
    }
    return header.fields.size() > 1000 ? "more than 1000 fields" : "";
  }

  if (key == "SIZE" || key == "TYPE" || key == "COUNT") return parse_per_field(key, words, header);
  if (key == "VIEWPOINT") {
    while (words >> word) header.viewpoint.push_back(parse_number(word).value_or(0.0));
    return header.viewpoint.size() == 7 ? "" : "VIEWPOINT needs 7 numbers";
  }

  words >> word;
  if (key == "DATA") {
    header.data = word;
    const bool known = word == "ascii" || word == "binary" || word == "binary_compressed";
    return known ? "" : "DATA '" + word + "' is not ascii, binary or binary_compressed";
  }

  // The other words have one number each
  const auto number = parse_count(word);
  if (key != "WIDTH" && key != "HEIGHT" && key != "POINTS")
    return "'" + key.substr(0, 40) + "' is not a PCD header word";
  if (!number || *number > 0xFFFFFFFFU)  // so that a product of two fits 64 bits
    return key + ": '" + word.substr(0, 40) + "' is not a number up to 2^32";
  (key == "WIDTH" ? header.width : key == "HEIGHT" ? header.height : header.points) = *number;
  return "";
}

core::Result<PcdHeader> read_header(ByteReader& reader) {
  PcdHeader header;
  std::string line;
  for (int number = 1; number < 100 && reader.line(line, 65536); ++number) {
    std::istringstream words(line);
    std::string key;
    if (!(words >> key)) continue;

    // Comments may name the frame
    if (key[0] == '#') {
      const std::size_t text = line.find_first_not_of("# ");
      if (text != std::string::npos) header.comments.push_back(line.substr(text));
      continue;
    }

    // All fields are known at DATA, the last line
    std::string problem = parse_line(key, words, header);
    if (problem.empty() && key == "DATA") problem = finish_fields(header);
    if (!problem.empty()) return core::input_error(fmt::format("line {}: {}", number, problem));
    if (key == "DATA") return header;
  }
  return core::input_error("PCD header has no DATA line; the file is truncated or not PCD");
}

void set_binary(CloudBuilder& builder, std::size_t row, const PcdHeader& header, std::size_t f,
                const std::uint8_t* bytes) {
  const PcdField& field = header.fields[f];

  // Packed colour: the bits, even of a float
  if (field.meaning == Meaning::kPackedColor) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, bytes, 4);
    builder.set_packed_color(row, bits);
  } else if (field.meaning != Meaning::kNone) {
    builder.set(row, field.meaning, f, load(field.scalar, bytes, false));
  }
}

std::string truncated(std::uint64_t row, std::uint64_t points) {
  return fmt::format("the file ends in point {} of {}; it is truncated", row + 1, points);
}

// Points as records of bytes; "" or the problem.
std::string read_binary(ByteReader& reader, const PcdHeader& header, CloudBuilder& builder) {
  for (std::uint64_t row = 0; row < header.points; ++row) {
    const std::uint8_t* record = reader.take(static_cast<std::size_t>(header.record));
    if (record == nullptr) return truncated(row, header.points);
    for (std::size_t f = 0; f < header.fields.size(); ++f) {
      set_binary(builder, row, header, f, record + header.fields[f].offset);
    }
  }
  return "";
}

/// Colours are also written as signed integers; other numbers become black.
std::uint32_t packed_color(double value) {
  const bool fits = value >= -2147483648.0 && value <= 4294967295.0;
  return fits ? static_cast<std::uint32_t>(static_cast<std::int64_t>(value)) : 0U;
}

/// The numbers of ascii data one after the other, separated by blanks or, as PDAL reads them, commas.
class PcdWords {
 public:
  PcdWords(ByteReader& reader, std::uint64_t a_point) : reader_(reader), a_point_(a_point) {}

  /// False at the end of the file.
  bool next(std::string& word) {
    if (pieces_.empty() && !read_pieces()) return false;
    word = std::move(pieces_.front());
    pieces_.pop_front();
    return true;
  }
  /// True for "1,5": commas are decimal, not separators.
  [[nodiscard]] bool decimal_comma() const { return decimal_comma_; }

 private:
  bool read_pieces() {
    std::string text;
    if (!reader_.word(text) && text.empty()) return false;
    if (text.size() > 1 && text.back() == ',') text.pop_back();
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(',', begin), text.size());
      pieces_.push_back(text.substr(begin, end - begin));
      begin = end + 1;
    }

    // Commas are decimal unless the word is a point
    decimal_comma_ = pieces_.size() > 1 && pieces_.size() != a_point_;
    return true;
  }

  ByteReader& reader_;
  std::uint64_t a_point_;  ///< numbers that a point has
  std::deque<std::string> pieces_;
  bool decimal_comma_ = false;
};

std::string read_ascii(ByteReader& reader, const PcdHeader& header, CloudBuilder& builder) {
  PcdWords words(reader, header.elements);
  std::string word;

  for (std::uint64_t row = 0; row < header.points; ++row) {
    for (std::size_t f = 0; f < header.fields.size(); ++f) {
      const PcdField& field = header.fields[f];
      for (std::uint64_t k = 0; k < field.count; ++k) {
        if (!words.next(word)) return truncated(row, header.points);

        // Decimal commas would make two numbers of one
        if (words.decimal_comma())
          return fmt::format("point {}: decimal comma; write numbers with a point", row + 1);
        const auto value = parse_number(word);
        if (!value) return fmt::format("point {}: '{}' is not a number", row + 1, word);

        // Packed colour: a number, or the bits of a float
        if (field.meaning != Meaning::kPackedColor) {
          builder.set(row, field.meaning, f, *value);
        } else if (field.scalar == ScalarType::kFloat32) {
          const auto number = static_cast<float>(*value);
          std::uint32_t bits = 0;
          std::memcpy(&bits, &number, 4);
          builder.set_packed_color(row, bits);
        } else {
          builder.set_packed_color(row, packed_color(*value));
        }
      }
    }
  }

  return "";
}

/// Compressed data are stored field after field.
std::string read_compressed(ByteReader& reader, const PcdHeader& header, CloudBuilder& builder) {
  const std::uint8_t* sizes = reader.take(8);
  if (sizes == nullptr) return "the file ends before its compressed data; it is truncated";

  // Sizes of the compressed and the uncompressed data
  std::uint32_t packed_size = 0;
  std::uint32_t size = 0;
  std::memcpy(&packed_size, sizes, 4);
  std::memcpy(&size, sizes + 4, 4);

  // Sizes are compared before memory is allocated
  if (size != header.points * header.record) {
    return fmt::format("compressed data hold {} bytes, {} points need {}", size, header.points,
                       header.points * header.record);
  }

  const std::uint8_t* packed = reader.take(packed_size);
  if (packed == nullptr)
    return fmt::format("header promises {} compressed bytes; the file is truncated", packed_size);

  std::vector<std::uint8_t> bytes(size);
  const auto& pcl = pcl_functions();
  if (!pcl) return pcl.error().message;
  if (size > 0 && (*pcl)->lzf_decompress(packed, packed_size, bytes.data(), size) != size) {
    return "compressed data are damaged";
  }

  // Each field for all points
  for (std::size_t f = 0; f < header.fields.size(); ++f) {
    const PcdField& field = header.fields[f];
    const std::uint8_t* column = bytes.data() + field.offset * header.points;
    for (std::uint64_t row = 0; row < header.points; ++row) {
      set_binary(builder, row, header, f, column + row * field.size * field.count);
    }
  }

  return "";
}

/// "" or why the file cannot hold the points that the header promises. LZF makes no more than 264 bytes of 3.
std::string check_size(const PcdHeader& header, std::uint64_t remaining) {
  double most = static_cast<double>(remaining);
  double least = static_cast<double>(header.record);
  if (header.data == "ascii") {
    most += 1.0;
    least = 2.0 * static_cast<double>(header.elements);
  } else if (header.data == "binary_compressed") {
    most *= 88.0;
  }
  if (static_cast<double>(header.points) * least <= most) return "";
  return fmt::format(
      "header promises {} points (at least {} bytes each) but {} bytes are left; the file is truncated",
      header.points, least, remaining);
}

}  // namespace

core::Result<CloudFile> read_pcd_cloud(const std::filesystem::path& file, LargeCoordinates large) {
  const auto error = [&file](const std::string& what) {
    return core::input_error(file.string() + ": " + what);
  };

  ByteReader reader(file);
  if (!reader.open()) return error("cannot be read");

  // The header must fit the file's size
  const auto header = read_header(reader);
  if (!header) return error(header.error().message);
  std::string problem = check_size(*header, reader.remaining());
  if (!problem.empty()) return error(problem);

  // The builder allocates only columns with a meaning
  std::vector<Meaning> meanings;
  std::vector<std::string> names;
  for (const auto& field : header->fields) {
    meanings.push_back(field.meaning);
    names.push_back(field.name);
  }

  CloudBuilder builder(meanings, names, static_cast<std::size_t>(header->points));
  if (!builder.has_position()) return error("has no x, y and z; it is not a point cloud");

  // Digits that floats would lose
  for (const PcdField& field : header->fields) {
    const bool digits = header->data == "ascii" || exceeds_float(field.scalar);
    if (digits && large == LargeCoordinates::kShifted) builder.keep_digits(field.meaning);
  }

  if (header->data == "ascii") {
    problem = read_ascii(reader, *header, builder);
  } else if (header->data == "binary") {
    problem = read_binary(reader, *header, builder);
  } else {
    problem = read_compressed(reader, *header, builder);
  }
  if (!problem.empty()) return error(problem);

  // Several rows: an organised cloud
  const bool organised = header->width != 0 && header->height > 1;
  builder.shape(static_cast<std::uint32_t>(organised ? header->width : header->points),
                static_cast<std::uint32_t>(organised ? header->height : 1));

  CloudFile result = builder.finish();
  result.frame = frame_in(header->comments);

  // The viewpoint is shifted like the points
  if (const auto& v = header->viewpoint; v.size() == 7) {
    result.cloud->sensor_origin_ =
        (Eigen::Vector4d(v[0], v[1], v[2], 0.0) -
         Eigen::Vector4d(result.shift.x(), result.shift.y(), result.shift.z(), 0.0))
            .cast<float>();
    result.cloud->sensor_orientation_ = Eigen::Quaterniond(v[3], v[4], v[5], v[6]).cast<float>();
  }

  return result;
}

}  // namespace plumbline::cloud
