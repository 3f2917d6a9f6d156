// SPDX-License-Identifier: BSD-3-Clause
// LAS 1.4 (ASPRS, R15), point format 7: what surveyors' programs read.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "formats.hpp"
#include "plumbline/cloud/fusion/dense_fusion.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "source/georeference.hpp"

namespace plumbline::exports {
namespace {

constexpr double kLasScale_m = 1e-4;
constexpr std::uint16_t kLasHeaderSize = 375;
constexpr std::uint32_t kVlrHeaderSize = 54;
constexpr std::uint16_t kFormat7Size = 36;
constexpr std::size_t kExtraRecordSize = 192;

/// A value of a point beyond the format's own.
struct LasExtra {
  std::string name;
  std::string description;
  std::uint8_t type = 9;  ///< type in the specification: 1 unsigned char, 9 float
  [[nodiscard]] std::uint16_t size() const { return type == 1 ? 1 : 4; }
};

template <std::size_t Size>
void put_fixed(core::OutputFile& out, const std::string& text) {
  std::array<char, Size> field{};
  std::memcpy(field.data(), text.data(), std::min(text.size(), Size));
  out.write(field.data(), Size);
}

const std::vector<float>* column_named(const cloud::CloudColumns& columns, const std::string& name) {
  for (const auto& other : columns.others) {
    if (other.name == name) return &other.values;
  }
  return nullptr;
}

/// Columns that become extra bytes of each point.
std::vector<LasExtra> extras_of(const cloud::CloudColumns& columns) {
  std::vector<LasExtra> extras;
  if (!columns.robot.empty()) extras.push_back({"robot", "number of the robot that saw it", 1});
  if (!columns.confidence.empty()) extras.push_back({"confidence", "0 to 1", 9});
  if (column_named(columns, cloud::kSigmaColumn) != nullptr)
    extras.push_back({"sigma", "std. deviation along normal, m", 9});
  return extras;
}

/// The header of a variable length record.
void put_vlr_header(core::OutputFile& out, const std::string& user, std::uint16_t record, std::size_t size,
                    const std::string& description) {
  out.put(std::uint16_t{0});
  put_fixed<16>(out, user);
  out.put(record);
  out.put(static_cast<std::uint16_t>(size));
  put_fixed<32>(out, description);
}

/// Descriptions of the extra bytes, record 4 of the specification.
void put_extra_records(core::OutputFile& out, const std::vector<LasExtra>& extras) {
  put_vlr_header(out, "LASF_Spec", 4, extras.size() * kExtraRecordSize, "extra bytes");
  for (const LasExtra& extra : extras) {
    out.put(std::uint16_t{0});
    out.put(extra.type);
    out.put(std::uint8_t{0});
    put_fixed<32>(out, extra.name);
    put_fixed<kExtraRecordSize - 68>(out, "");  // no data, minimum, maximum, scale, offset
    put_fixed<32>(out, extra.description);
  }
}

/// Coordinates as integers: steps of the scale from the offset.
struct LasSteps {
  Eigen::Vector3d offset;
  /// Rounded to the nearest step.
  [[nodiscard]] std::array<std::int32_t, 3> of(const Eigen::Vector3d& place) const {
    std::array<std::int32_t, 3> steps{};
    for (int k = 0; k < 3; ++k) {
      steps[static_cast<std::size_t>(k)] =
          static_cast<std::int32_t>(std::llround((place[k] - offset[k]) / kLasScale_m));
    }
    return steps;
  }
  [[nodiscard]] Eigen::Vector3d place(const std::array<std::int32_t, 3>& steps) const {
    return offset + kLasScale_m * Eigen::Vector3d(steps[0], steps[1], steps[2]);
  }
};

struct LasLayout {
  std::vector<LasExtra> extras;
  std::string wkt;  ///< with its end; empty: not known where on Earth
  std::uint32_t vlrs = 0;
  std::uint32_t points_at = kLasHeaderSize;
  std::uint16_t point_size = kFormat7Size;
};

/// Sizes of the variable length records and of a point.
LasLayout layout_of_las(const cloud::CloudColumns& columns, const std::optional<Georeference>& reference) {
  LasLayout layout;
  layout.extras = extras_of(columns);
  if (reference) layout.wkt = reference->wkt + '\0';
  if (!layout.wkt.empty()) {
    ++layout.vlrs;
    layout.points_at += kVlrHeaderSize + static_cast<std::uint32_t>(layout.wkt.size());
  }
  if (!layout.extras.empty()) {
    ++layout.vlrs;
    layout.points_at += kVlrHeaderSize + static_cast<std::uint32_t>(layout.extras.size() * kExtraRecordSize);
  }
  for (const LasExtra& extra : layout.extras)
    layout.point_size = static_cast<std::uint16_t>(layout.point_size + extra.size());
  return layout;
}

/// The header of LAS 1.4; legacy counts are zero, as format 7 requires.
void put_las_header(core::OutputFile& out, const LasLayout& layout, const LasSteps& steps,
                    const Eigen::AlignedBox3d& box, std::uint64_t points) {
  out.write("LASF");
  out.put(std::uint16_t{0});         // file source
  out.put(std::uint16_t{1U << 4U});  // coordinate systems are given as WKT
  put_fixed<16>(out, "");            // project
  out.put(std::uint8_t{1});
  out.put(std::uint8_t{4});
  put_fixed<32>(out, "RGB-D SLAM");

  // Program, sizes and point format
  put_fixed<32>(out, std::string("plumbline ") + core::version());
  out.put(std::uint16_t{0});  // day and year: same map, same bytes
  out.put(std::uint16_t{0});
  out.put(kLasHeaderSize);
  out.put(layout.points_at);
  out.put(layout.vlrs);
  out.put(std::uint8_t{7});
  out.put(layout.point_size);

  // Steps and offset of coordinates
  for (int i = 0; i < 6; ++i) out.put(std::uint32_t{0});  // legacy counts
  out.put(std::array<double, 3>{kLasScale_m, kLasScale_m, kLasScale_m});
  out.put(std::array<double, 3>{steps.offset.x(), steps.offset.y(), steps.offset.z()});

  // Extent and number of points
  for (int k = 0; k < 3; ++k) out.put(std::array<double, 2>{box.max()[k], box.min()[k]});
  out.put(std::uint64_t{0});  // waveforms
  out.put(std::uint64_t{0});  // extended records
  out.put(std::uint32_t{0});
  out.put(points);
  out.put(points);  // of first returns
  for (int i = 0; i < 14; ++i) out.put(std::uint64_t{0});
}

/// A point of format 7: position and colour, everything else unset.
void put_las_point(core::OutputFile& out, const std::array<std::int32_t, 3>& steps, const cloud::Point& p) {
  const auto wide = [](std::uint8_t value) { return static_cast<std::uint16_t>(value * 257U); };
  out.put(steps);
  out.put(std::uint16_t{0});    // intensity
  out.put(std::uint8_t{0x11});  // return 1 of 1
  out.put(std::uint8_t{0});     // flags
  out.put(std::uint8_t{0});     // classification: never classified
  out.put(std::uint8_t{0});     // user data
  out.put(std::int16_t{0});     // scan angle
  out.put(std::uint16_t{0});    // point source
  out.put(0.0);                 // time
  out.put(std::array<std::uint16_t, 3>{wide(p.r), wide(p.g), wide(p.b)});
}

/// All points, each with its extra bytes.
void put_las_points(core::OutputFile& out, const cloud::CloudFile& file, const LasSteps& steps) {
  const cloud::CloudColumns& columns = file.columns;
  const std::vector<float>* sigma = column_named(columns, cloud::kSigmaColumn);
  for (std::size_t i = 0; i < file.cloud->size(); ++i) {
    const cloud::Point& p = (*file.cloud)[i];
    put_las_point(out, steps.of(p.getVector3fMap().cast<double>() + file.shift), p);
    if (!columns.robot.empty()) out.put(columns.robot[i]);
    if (!columns.confidence.empty()) out.put(columns.confidence[i]);
    if (sigma != nullptr) out.put((*sigma)[i]);
  }
}

core::Result<ExportSummary> write_las(MapSource& source, const std::filesystem::path& output) {
  const auto reference = georeference_of(source.options(), source.log());
  if (!reference) return tl::unexpected(reference.error());
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());
  const cloud::CloudFile file = *reference ? to_world(**cloud, **reference) : **cloud;

  // The offset is a whole metre in the middle, so that whole coordinates survive.
  Eigen::AlignedBox3d box;
  for (const cloud::Point& p : *file.cloud) box.extend(p.getVector3fMap().cast<double>() + file.shift);
  const LasSteps steps{box.center().array().round()};

  if (box.sizes().maxCoeff() / kLasScale_m > std::numeric_limits<std::int32_t>::max()) {
    return core::input_error(
        fmt::format("{}: the cloud is {:.0f} m wide; LAS with a step of 0.1 mm holds 214 km", output.string(),
                    box.sizes().maxCoeff()));
  }

  const Eigen::AlignedBox3d rounded(steps.place(steps.of(box.min())), steps.place(steps.of(box.max())));

  const LasLayout layout = layout_of_las(file.columns, *reference);
  core::OutputFile out(output);
  put_las_header(out, layout, steps, rounded, file.cloud->size());

  if (!layout.wkt.empty()) {
    put_vlr_header(out, "LASF_Projection", 2112, layout.wkt.size(), "OGC coordinate system WKT");
    out.write(layout.wkt);
  }

  if (!layout.extras.empty()) put_extra_records(out, layout.extras);
  put_las_points(out, file, steps);
  ExportSummary summary;
  note_colorless(file, summary);
  if (auto written = out.commit(); !written) return tl::unexpected(written.error());

  summary.written = {output};
  if (*reference) {
    if (auto beside = write_georeference(output, **reference); !beside) return tl::unexpected(beside.error());
    summary.notes.push_back(fmt::format("in {} (EPSG:{})", (*reference)->name, (*reference)->epsg));
  }

  return summary;
}

}  // namespace

Format las_format() {
  return {
      "las",
      {".las"},
      {Content::kCloud},
      "",
      "LAS 1.4 for surveying",
      "Point format 7 with 16-bit colours, steps of 0.1 mm from an offset in the middle of the data, so that "
      "large coordinates stay exact; `robot`, `confidence` and `sigma` (metres) as named extra bytes if the "
      "map has them. With `--datum` or `--epsg` in world coordinates, with the system as WKT in the file and "
      "the whole transform in `FILE.georeference.json`. There is no `.laz`: no library in Debian writes it; "
      "the program `laszip` compresses the file without loss.",
      {"voxel", "datum", "epsg", "origin"},
      &write_las};
}

}  // namespace plumbline::exports
