// SPDX-License-Identifier: BSD-3-Clause
// Coordinate systems, by PROJ.
#include <fmt/format.h>
#include <proj.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "source/georeference.hpp"

namespace plumbline::exports {
namespace {

struct FreeContext {
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
};
struct FreePj {
  void operator()(PJ* pj) const { proj_destroy(pj); }
};
using Context = std::unique_ptr<PJ_CONTEXT, FreeContext>;
using Pj = std::unique_ptr<PJ, FreePj>;

Context quiet_context() {
  Context context(proj_context_create());
  proj_log_level(context.get(), PJ_LOG_NONE);
  proj_context_set_enable_network(context.get(), 0);
  return context;
}

/// True if both axes are in metres.
bool in_metres(PJ_CONTEXT* context, const PJ* system) {
  const Pj axes(proj_crs_get_coordinate_system(context, system));
  double factor = 0.0;
  return axes &&
         proj_cs_get_axis_info(context, axes.get(), 0, nullptr, nullptr, nullptr, &factor, nullptr, nullptr,
                               nullptr) != 0 &&
         factor == 1.0;
}

/// Name and well-known text of a projected system in metres.
core::Result<void> describe_system(int epsg, Georeference& reference) {
  const Context context = quiet_context();
  const Pj system(proj_create(context.get(), fmt::format("EPSG:{}", epsg).c_str()));
  if (!system) return core::usage_error(fmt::format("EPSG:{}: PROJ knows no such coordinate system", epsg));
  if (proj_get_type(system.get()) != PJ_TYPE_PROJECTED_CRS || !in_metres(context.get(), system.get())) {
    return core::usage_error(fmt::format(
        "EPSG:{} ({}): is not a projected coordinate system in metres; choose one such as that of the "
        "UTM zone, 32601 to 32760",
        epsg, proj_get_name(system.get())));
  }

  // WKT 1 as GDAL writes it, in one line
  const char* const options[] = {"MULTILINE=NO", nullptr};
  const char* text = proj_as_wkt(context.get(), system.get(), PJ_WKT1_GDAL, options);
  if (text == nullptr)
    return core::usage_error(fmt::format("EPSG:{}: cannot be written as well-known text", epsg));
  reference.name = proj_get_name(system.get());
  reference.wkt = text;
  return {};
}

/// From longitude and latitude, degrees, into the system.
Pj from_degrees_into(PJ_CONTEXT* context, int epsg) {
  const Pj given(proj_create_crs_to_crs(context, "EPSG:4326", fmt::format("EPSG:{}", epsg).c_str(), nullptr));
  return Pj(given ? proj_normalize_for_visualization(context, given.get()) : nullptr);
}

/// True if the origin is in the system's area of use, or that is not known.
bool covers_origin(const Georeference& reference) {
  constexpr double kSlack = 3.0;       // degrees: zones are used a little beyond their border
  constexpr double kUnknown = -999.0;  // PROJ gives -1000 for a border that it does not know
  const Context context = quiet_context();
  const Pj system(proj_create(context.get(), fmt::format("EPSG:{}", reference.epsg).c_str()));
  const Pj from_degrees = from_degrees_into(context.get(), reference.epsg);
  double west = 0.0, south = 0.0, east = 0.0, north = 0.0;
  const bool known = system && from_degrees &&
                     proj_get_area_of_use(context.get(), system.get(), &west, &south, &east, &north, nullptr);
  if (!known || std::min({west, south, east, north}) < kUnknown) return true;

  // Degrees of the origin; longitudes wrap around
  const PJ_COORD at = proj_trans(from_degrees.get(), PJ_INV,
                                 proj_coord(reference.origin.x(), reference.origin.y(), 0.0, 0.0));
  if (!std::isfinite(at.xy.x + at.xy.y) || at.xy.y < south - kSlack || at.xy.y > north + kSlack) return false;
  const double width = east - west + (east < west ? 360.0 : 0.0);
  return std::abs(std::remainder(at.xy.x - west - 0.5 * width, 360.0)) <= 0.5 * width + kSlack;
}

core::Result<void> place_map(double latitude, double longitude, double heading, Georeference& reference) {
  constexpr double kStep = 1e-4;  // degrees: about 11 m
  constexpr double kRadians = M_PI / 180.0;
  const Context context = quiet_context();
  const Pj from_degrees = from_degrees_into(context.get(), reference.epsg);
  const Pj globe(proj_create(context.get(), "EPSG:4326"));
  const auto fail = [&] {
    return core::usage_error(
        fmt::format("--datum: EPSG:{} does not cover {} {}", reference.epsg, latitude, longitude));
  };
  if (!from_degrees || !globe) return fail();

  // Grid direction of true north, and how long a true metre is.
  const PJ_COORD here = proj_trans(from_degrees.get(), PJ_FWD, proj_coord(longitude, latitude, 0.0, 0.0));
  const PJ_COORD north =
      proj_trans(from_degrees.get(), PJ_FWD, proj_coord(longitude, latitude + kStep, 0.0, 0.0));

  const double true_m =
      proj_lp_dist(globe.get(), proj_coord(longitude * kRadians, latitude * kRadians, 0.0, 0.0),
                   proj_coord(longitude * kRadians, (latitude + kStep) * kRadians, 0.0, 0.0));
  const double east_m = north.xy.x - here.xy.x;
  const double north_m = north.xy.y - here.xy.y;
  if (!std::isfinite(here.xy.x + here.xy.y + east_m + north_m) || !(true_m > 0.0)) return fail();

  reference.origin = {here.xy.x, here.xy.y, 0.0};
  reference.scale = std::hypot(east_m, north_m) / true_m;
  reference.turn = std::atan2(north_m, east_m) - heading * kRadians;
  return {};
}

core::Result<void> place_at_origin(Georeference& reference) {
  const Eigen::Vector3d origin = reference.origin;
  const Context context = quiet_context();
  const Pj from_degrees = from_degrees_into(context.get(), reference.epsg);
  const PJ_COORD at =
      from_degrees ? proj_trans(from_degrees.get(), PJ_INV, proj_coord(origin.x(), origin.y(), 0.0, 0.0))
                   : proj_coord(HUGE_VAL, HUGE_VAL, 0.0, 0.0);
  if (!std::isfinite(at.xy.x + at.xy.y)) {
    return core::usage_error(fmt::format("EPSG:{} does not cover east {:.0f}, north {:.0f}", reference.epsg,
                                         origin.x(), origin.y()));
  }
  auto placed = place_map(at.xy.y, at.xy.x, 0.0, reference);
  reference.origin = origin;
  return placed;
}

}  // namespace
}  // namespace plumbline::exports

namespace px = plumbline::exports;
PLUMBLINE_PART(px::ProjFunctions, &px::describe_system, &px::place_map, &px::place_at_origin,
               &px::covers_origin)
