// SPDX-License-Identifier: BSD-3-Clause
#include "source/georeference.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <system_error>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/exports/grid_place.hpp"

namespace plumbline::exports {
namespace {

/// EPSG number of the UTM zone on WGS 84.
int utm_epsg(double latitude, double longitude) {
  const double turned = longitude - 360.0 * std::floor((longitude + 180.0) / 360.0);
  const int zone = std::min(60, static_cast<int>(std::floor((turned + 180.0) / 6.0)) + 1);
  return (latitude < 0.0 ? 32700 : 32600) + zone;
}

/// Places the map by the position and heading of its origin, in the UTM zone there.
core::Result<void> place_by_datum(const std::vector<double>& datum, const ProjFunctions& proj,
                                  Georeference& reference) {
  if (datum.size() != 3 || std::abs(datum[0]) > 84.0 || std::abs(datum[1]) > 180.0) {
    return core::usage_error(
        "--datum: takes latitude,longitude,heading in degrees; latitude from -84 to 84, longitude from -180 "
        "to 180");
  }
  reference.epsg = utm_epsg(datum[0], datum[1]);
  if (auto known = proj.describe(reference.epsg, reference); !known) return known;
  return proj.place(datum[0], datum[1], datum[2], reference);
}

/// Places the map by coordinates of its origin in a projected system.
core::Result<void> place_by_origin(const ExportOptions& options, const ProjFunctions& proj,
                                   Georeference& reference) {
  const std::vector<double>& origin = options.origin;
  if (options.epsg == 0 || origin.size() < 3 || origin.size() > 5) {
    return core::usage_error(
        "--epsg N and --origin EAST,NORTH,HEIGHT[,DEGREES[,SCALE]] go together; give both");
  }
  reference.epsg = options.epsg;
  reference.origin = {origin[0], origin[1], origin[2]};
  if (origin.size() > 3) reference.turn = -origin[3] * M_PI / 180.0;
  if (origin.size() > 4) reference.scale = origin[4];
  return proj.describe(options.epsg, reference);
}

std::filesystem::path georeference_file(std::filesystem::path file) {
  file += ".georeference.json";
  return file;
}

}  // namespace

Eigen::Matrix3d Georeference::linear() const {
  Eigen::Matrix3d turned = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  turned.topLeftCorner<2, 2>() *= scale;
  return turned;
}

/// The georeference that the options ask for, if any; options that contradict each other are refused.
core::Result<std::optional<Georeference>> georeference_of(const ExportOptions& options, core::Log& log) {
  const bool by_origin = options.epsg != 0 || !options.origin.empty();
  if (options.datum.empty() && !by_origin) return std::nullopt;
  if (!options.datum.empty() && by_origin)
    return core::usage_error("--datum and --epsg both say where the map lies; give one of them");

  // The part "proj" knows coordinate systems
  const auto& proj = core::part<ProjFunctions>();
  if (!proj) return tl::unexpected(proj.error());
  Georeference reference;
  auto placed = by_origin ? place_by_origin(options, **proj, reference)
                          : place_by_datum(options.datum, **proj, reference);
  if (!placed) return tl::unexpected(placed.error());

  // Swapped coordinates are a frequent mistake
  if (by_origin && !(*proj)->covers(reference)) {
    log.warning(fmt::format(
        "--origin {:.0f},{:.0f}: lies outside the area of use of EPSG:{} ({}); east comes first, then north",
        reference.origin.x(), reference.origin.y(), reference.epsg, reference.name));
  }
  return reference;
}

core::Result<GridPlace> grid_at(int epsg, double east, double north) {
  const auto& proj = core::part<ProjFunctions>();
  if (!proj) return tl::unexpected(proj.error());
  Georeference reference;
  reference.epsg = epsg;
  reference.origin = {east, north, 0.0};
  if (auto known = (*proj)->describe(epsg, reference); !known) return tl::unexpected(known.error());
  if (auto placed = (*proj)->place_at_origin(reference); !placed) return tl::unexpected(placed.error());
  return GridPlace{epsg, reference.name, east, north, reference.turn, reference.scale};
}

core::Result<GridPlace> grid_of(const std::vector<double>& datum) {
  const auto& proj = core::part<ProjFunctions>();
  if (!proj) return tl::unexpected(proj.error());
  Georeference reference;
  const std::vector<double> on_the_globe(datum.begin(), datum.size() == 4 ? datum.end() - 1 : datum.end());
  if (auto ok = place_by_datum(on_the_globe, **proj, reference); !ok) return tl::unexpected(ok.error());
  return GridPlace{reference.epsg,       reference.name, reference.origin.x(),
                   reference.origin.y(), reference.turn, reference.scale};
}

/// The cloud in world coordinates; the shift takes whole metres, so that floats stay exact.
cloud::CloudFile to_world(const cloud::CloudFile& file, const Georeference& reference) {
  cloud::CloudFile result = file;
  result.cloud = std::make_shared<cloud::Cloud>(*file.cloud);

  const Eigen::Vector3d origin = reference * file.shift;
  result.shift = origin.array().round();
  const Eigen::Vector3d rest = origin - result.shift;
  const Eigen::Matrix3d linear = reference.linear();
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisd(reference.turn, Eigen::Vector3d::UnitZ()).toRotationMatrix().cast<float>();

  // Normals are turned, but not scaled
  for (cloud::Point& p : *result.cloud) {
    p.getVector3fMap() = (linear * p.getVector3fMap().cast<double>() + rest).cast<float>();
    p.getNormalVector3fMap() = (turn * p.getNormalVector3fMap()).eval();
  }
  return result;
}

/// Writes the transform next to the export, for formats that cannot hold it.
core::Result<void> write_georeference(const std::filesystem::path& file, const Georeference& reference) {
  nlohmann::ordered_json json;
  json["what"] = "world = origin + linear * map; metres";
  json["epsg"] = reference.epsg;
  json["name"] = reference.name;
  json["origin"] = {reference.origin.x(), reference.origin.y(), reference.origin.z()};
  json["turn_degrees"] = reference.turn * 180.0 / M_PI;
  json["scale"] = reference.scale;

  // Rows of the matrix
  const Eigen::Matrix3d linear = reference.linear();
  for (int row = 0; row < 3; ++row)
    json["linear"].push_back({linear(row, 0), linear(row, 1), linear(row, 2)});

  json["wkt"] = reference.wkt;
  return core::write_file(georeference_file(file), core::json_text(json));
}

void remove_georeference(const std::filesystem::path& file) {
  std::error_code ignored;
  std::filesystem::remove(georeference_file(file), ignored);
}

}  // namespace plumbline::exports
