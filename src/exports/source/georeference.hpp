// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Position of a map on Earth.
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>

#include "plumbline/core/log.hpp"
#include "plumbline/core/part.hpp"
#include "plumbline/exports/options.hpp"

namespace plumbline::cloud {
struct CloudFile;
}

namespace plumbline::exports {

/// Transform from the map's frame into a projected coordinate system: east = x, north = y, up = z; metres.
struct Georeference {
  int epsg = 0;
  std::string name;  ///< name of the coordinate system
  std::string wkt;   ///< OGC well-known text, version 1, as required by LAS
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double turn = 0.0;   ///< angle from east to the map's x axis, radians, counter-clockwise
  double scale = 1.0;  ///< scale of the projection at the origin; heights are not scaled

  [[nodiscard]] Eigen::Matrix3d linear() const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& map) const { return origin + linear() * map; }
};

/// Queries about a coordinate system and one position in it (functions of the part "proj").
struct ProjFunctions {
  static constexpr const char* kPart = "proj";
  static constexpr std::uint64_t layout() { return core::layout_of<ProjFunctions, Georeference>(); }
  /// Name and text of EPSG:`epsg`. Errors (kUsage): unknown, not projected, not in metres.
  core::Result<void> (*describe)(int epsg, Georeference& reference);
  /// Origin, turn and scale of a map whose origin is at (latitude, longitude) and whose x axis has this
  /// heading, all degrees. Errors (kUsage): the system does not cover it.
  core::Result<void> (*place)(double latitude, double longitude, double heading, Georeference& reference);
  /// Turn and scale of a map that lies at the reference's origin and whose x axis is true north. Errors
  /// (kUsage): the system does not cover it.
  core::Result<void> (*place_at_origin)(Georeference& reference);
  /// True if the origin lies in the system's area of use, give or take 3 degrees, or that is not known.
  bool (*covers)(const Georeference& reference);
};

/// Georeference requested by --datum, or by --epsg with --origin; none if neither was given. Warns about an
/// origin outside of the system. Errors (kUsage).
core::Result<std::optional<Georeference>> georeference_of(const ExportOptions& options, core::Log& log);

/// The cloud in world coordinates, whose large part becomes the cloud's shift.
cloud::CloudFile to_world(const cloud::CloudFile& file, const Georeference& reference);
/// Writes FILE.georeference.json: the transform that was applied.
core::Result<void> write_georeference(const std::filesystem::path& file, const Georeference& reference);
/// Removes the one that an earlier export left beside the file, which it no longer fits.
void remove_georeference(const std::filesystem::path& file);

}  // namespace plumbline::exports
