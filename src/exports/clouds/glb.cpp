// SPDX-License-Identifier: BSD-3-Clause
// glTF 2.0 in one binary file: what browsers and viewers open.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "clouds/mesh.hpp"
#include "formats.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"

namespace plumbline::exports {
namespace {

using Json = nlohmann::ordered_json;

/// Content of the file: positions in glTF's axes (y up), colours as linear light, not as sRGB.
struct GlbData {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;  ///< empty for points
  std::vector<std::array<std::uint16_t, 4>> colors;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< empty: points
  std::array<double, 3>
      shift{};  ///< added to all positions, metres: large coordinates do not fit into floats
};

/// Linear light of each sRGB value (IEC 61966-2-1), in 65535ths.
std::array<std::uint16_t, 256> linear_light() {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double c = static_cast<double>(i) / 255.0;
    const double light = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    table[i] = static_cast<std::uint16_t>(std::lround(light * 65535.0));
  }
  return table;
}

/// From z up to y up.
template <typename T>
std::array<T, 3> y_up(T x, T y, T z) {
  return {x, z, -y};
}

/// Points with colours as linear light.
core::Result<GlbData> points_as_glb(MapSource& source) {
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());
  const std::array<std::uint16_t, 256> light = linear_light();
  GlbData data;
  data.shift = y_up((*cloud)->shift.x(), (*cloud)->shift.y(), (*cloud)->shift.z());
  for (const cloud::Point& p : *(*cloud)->cloud) {
    data.positions.push_back(y_up(p.x, p.y, p.z));
    data.colors.push_back({light[p.r], light[p.g], light[p.b], 65535});
  }
  return data;
}

/// The mesh with unit normals, which glTF requires.
core::Result<GlbData> mesh_as_glb(MapSource& source) {
  const auto mesh = mesh_of(source);
  if (!mesh) return tl::unexpected(mesh.error());

  // Columns of the mesh
  const std::array<std::uint16_t, 256> light = linear_light();
  std::array<const std::vector<float>*, 6> columns{};
  const std::array<const char*, 6> names{"x", "y", "z", "nx", "ny", "nz"};
  for (std::size_t k = 0; k < 6; ++k) columns[k] = mesh->floats(names[k]);
  const auto *red = mesh->bytes("red"), *green = mesh->bytes("green"), *blue = mesh->bytes("blue");

  // Vertices in glTF's axes
  GlbData data;
  for (std::size_t v = 0; v < mesh->vertex_count; ++v) {
    const auto at = [&](std::size_t k) { return (*columns[k])[v]; };
    Eigen::Vector3f normal(at(3), at(4), at(5));
    normal = normal.squaredNorm() > 0.5F ? normal.normalized() : Eigen::Vector3f::UnitZ();
    data.positions.push_back(y_up(at(0), at(1), at(2)));
    data.normals.push_back(y_up(normal.x(), normal.y(), normal.z()));
    data.colors.push_back({light[(*red)[v]], light[(*green)[v]], light[(*blue)[v]], 65535});
  }

  // Positions are floats, so the shift stays apart
  data.triangles = mesh->triangles;
  data.shift = y_up(mesh->shift[0], mesh->shift[1], mesh->shift[2]);
  return data;
}

template <typename T>
std::size_t byte_size(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

/// glTF's numbers for types of components and targets of sections.
constexpr int kFloat = 5126, kShort = 5123, kInt = 5125, kVertices = 34962, kIndices = 34963;

/// The accessor of positions, of which glTF requires the range.
Json position_accessor(const std::vector<std::array<float, 3>>& positions) {
  std::array<float, 3> low{}, high{};
  low.fill(std::numeric_limits<float>::max());
  high.fill(std::numeric_limits<float>::lowest());
  for (const auto& p : positions) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  return {
      {"componentType", kFloat}, {"count", positions.size()}, {"type", "VEC3"}, {"min", low}, {"max", high}};
}

/// Sections of the buffer one after another, each with the accessor that reads it.
class GlbSections {
 public:
  explicit GlbSections(Json& json) : json_(json) {
    json_["bufferViews"] = Json::array();
    json_["accessors"] = Json::array();
  }
  /// Returns the number of the accessor.
  std::size_t add(std::size_t bytes, int target, Json accessor) {
    accessor["bufferView"] = json_["bufferViews"].size();
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", bytes_}, {"byteLength", bytes}, {"target", target}});
    json_["accessors"].push_back(std::move(accessor));
    bytes_ += bytes;
    return json_["accessors"].size() - 1;
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  Json& json_;
  std::size_t bytes_ = 0;
};

/// The points or the mesh, with its sections in the order in which they are written.
Json glb_primitive(const GlbData& data, GlbSections& sections) {
  const std::size_t count = data.positions.size();
  Json attributes;
  attributes["POSITION"] =
      sections.add(byte_size(data.positions), kVertices, position_accessor(data.positions));
  if (!data.normals.empty()) {
    attributes["NORMAL"] = sections.add(byte_size(data.normals), kVertices,
                                        {{"componentType", kFloat}, {"count", count}, {"type", "VEC3"}});
  }

  attributes["COLOR_0"] =
      sections.add(byte_size(data.colors), kVertices,
                   {{"componentType", kShort}, {"normalized", true}, {"count", count}, {"type", "VEC4"}});

  // Mode 0 is points, mode 4 triangles
  Json primitive = {{"attributes", attributes}, {"material", 0}, {"mode", data.triangles.empty() ? 0 : 4}};
  if (!data.triangles.empty()) {
    primitive["indices"] =
        sections.add(byte_size(data.triangles), kIndices,
                     {{"componentType", kInt}, {"count", 3 * data.triangles.size()}, {"type", "SCALAR"}});
  }
  return primitive;
}

/// The JSON part.
Json glb_json(const GlbData& data, const std::string& name, const std::string& frame) {
  Json json;
  json["asset"] = {{"version", "2.0"},
                   {"generator", std::string("plumbline ") + core::version()},
                   {"extras", {{"frame", frame + "; turned to glTF's axes: y up, metres"}}}};

  // One node, moved by the shift
  json["scene"] = 0;
  json["scenes"] = Json::array({{{"nodes", {0}}}});
  json["nodes"] = Json::array({{{"name", name}, {"mesh", 0}}});
  if (data.shift != std::array<double, 3>{}) json["nodes"][0]["translation"] = data.shift;
  GlbSections sections(json);
  const Json primitive = glb_primitive(data, sections);

  // Colours as recorded, without lighting
  json["meshes"] = Json::array({{{"primitives", Json::array({primitive})}}});
  json["materials"] =
      Json::array({{{"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}},
                    {"doubleSided", true},
                    {"extensions", {{"KHR_materials_unlit", Json::object()}}}}});
  json["extensionsUsed"] = {"KHR_materials_unlit"};
  json["buffers"] = Json::array({{{"byteLength", sections.bytes()}}});
  return json;
}

core::Result<ExportSummary> write_glb(MapSource& source, const std::filesystem::path& output) {
  const bool mesh = source.request().content == Content::kMesh;
  const auto data = mesh ? mesh_as_glb(source) : points_as_glb(source);
  if (!data) return tl::unexpected(data.error());

  const Json json = glb_json(*data, source.name(), source.frame_text());
  std::string text = core::json_text(json, -1);
  text.append((4 - text.size() % 4) % 4, ' ');

  // All parts are whole words.
  const std::size_t binary = json["buffers"][0]["byteLength"].get<std::size_t>();
  const std::size_t whole = 12 + 8 + text.size() + 8 + binary;
  if (whole > std::numeric_limits<std::uint32_t>::max()) {
    return core::input_error(
        fmt::format("{}: {} MB are more than a GLB holds (4 GB); thin the cloud with --voxel",
                    output.string(), whole >> 20U));
  }

  core::OutputFile out(output);
  out.write("glTF");
  out.put(std::array<std::uint32_t, 3>{2, static_cast<std::uint32_t>(whole),
                                       static_cast<std::uint32_t>(text.size())});
  out.write("JSON");
  out.write(text);

  out.put(static_cast<std::uint32_t>(binary));
  out.write(std::string_view("BIN\0", 4));
  out.write(data->positions.data(), byte_size(data->positions));
  out.write(data->normals.data(), byte_size(data->normals));
  out.write(data->colors.data(), byte_size(data->colors));
  out.write(data->triangles.data(), byte_size(data->triangles));
  if (auto written = out.commit(); !written) return tl::unexpected(written.error());

  ExportSummary summary;
  summary.written = {output};
  if (const auto cloud = source.cloud()) note_colorless(**cloud, summary);
  if (const auto up = source.need_upright(output.string()); !up) summary.notes.push_back(up.error().message);
  return summary;
}

}  // namespace

Format glb_format() {
  return {
      "glb",
      {".glb"},
      {Content::kCloud, Content::kMesh},
      "",
      "glTF binary for browsers and viewers",
      "The points, or with `--mesh` the mesh with vertex colours; metres, y up as glTF requires, colours as "
      "linear light, unlit. Positions are floats: no viewer needs an extension for them. Of a large cloud, "
      "`--voxel \"2 cm\"` makes a file that a phone opens.",
      {"voxel", "resolution", "reach"},
      &write_glb};
}

}  // namespace plumbline::exports
