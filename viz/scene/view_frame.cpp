// SPDX-License-Identifier: BSD-3-Clause
#include "scene/view_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "plumbline/core/numbers.hpp"

namespace plumbline::viz {
namespace {

constexpr double kIsoPitch = 35.0 * kDegree;
constexpr double kIsoAzimuth = 35.0 * kDegree;  // not 45: one wall direction stays the longer one
constexpr double kHeadsRight = 0.2;             // sine of the heading from `forward`
constexpr double kIsoFieldOfView = 28.0 * kDegree;
constexpr double kFreeMargin = 0.07;  // of the picture, free on each side

struct Interval {
  double low = 0.0;
  double high = 0.0;
  void include(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
};

/// Along one camera axis: all but a few specks of the points, and all of must_see.
Interval extent(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& must_see,
                const Eigen::Vector3d& axis) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const auto& p : points) values.push_back(p.dot(axis));
  Interval interval;
  if (!values.empty()) {
    interval = {core::quantile(values, 0.002, 0.0), core::quantile(values, 0.998, 0.0)};
  } else if (!must_see.empty()) {
    interval = {must_see.front().dot(axis), must_see.front().dot(axis)};
  }
  for (const auto& p : must_see) interval.include(p.dot(axis));
  return interval;
}

void fit_orthographic(Projection& projection, const Interval& x, const Interval& y, double width_px) {
  const double room = 1.0 - 2.0 * kFreeMargin;
  const double per_metre_x = width_px * room / std::max(x.high - x.low, 0.2);
  const double per_metre_y = projection.height_px * room / std::max(y.high - y.low, 0.2);
  projection.focal_px = std::min(per_metre_x, per_metre_y);
}

/// Distance of the eye from the centre so that nearly all points lie inside the four sides of the view.
double fit_distance(const Projection& projection, const Eigen::Vector3d& centre,
                    const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& must_see,
                    double width_px) {
  const double room = 1.0 - 2.0 * kFreeMargin;
  const double tan_x = room * 0.5 * width_px / projection.focal_px;
  const double tan_y = room * 0.5 * projection.height_px / projection.focal_px;
  const auto needed = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d v = p - centre;
    return std::max(std::abs(v.dot(projection.right)) / tan_x, std::abs(v.dot(projection.up)) / tan_y) -
           v.dot(projection.forward);
  };
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const auto& p : points) distances.push_back(needed(p));
  double distance = core::quantile(std::move(distances), 0.996, 0.0);
  for (const auto& p : must_see) distance = std::max(distance, needed(p));
  return std::max(distance, 0.3);
}

}  // namespace

std::vector<Eigen::Vector3d> evened(const std::vector<Eigen::Vector3d>& points) {
  constexpr double kCells = 60.0;
  Eigen::Vector3d low, high;
  for (int axis = 0; axis < 3; ++axis) {
    const Interval along = extent(points, {}, Eigen::Vector3d::Unit(axis));
    low[axis] = along.low;
    high[axis] = along.high;
  }
  const double side = std::max((high - low).maxCoeff() / kCells, 1e-3);
  std::set<std::array<long, 3>> taken;
  std::vector<Eigen::Vector3d> result;
  for (const auto& p : points) {
    // Points far outside of 99 % of all points share the border cubes.
    const Eigen::Array3d cell = ((p - low).array() / side).floor().max(-kCells).min(2.0 * kCells);
    const auto index = [&cell](int axis) { return std::lround(cell[axis]); };
    if (taken.insert({index(0), index(1), index(2)}).second) result.push_back(p);
  }
  return result;
}

Eigen::Vector3d Projection::project(const Eigen::Vector3d& p) const {
  const Eigen::Vector3d v = p - eye;
  const double depth = v.dot(forward);
  const double scale = pixels_per_metre(depth);
  return {0.5 * width_px + scale * v.dot(right), 0.5 * height_px + scale * v.dot(up), depth};
}

double Projection::pixels_per_metre(double depth_m) const {
  return orthographic ? focal_px : focal_px / std::max(depth_m, 1e-3);
}

Eigen::Vector3d Projection::to_viewer(const Eigen::Vector3d& p) const {
  return orthographic ? Eigen::Vector3d(-forward) : Eigen::Vector3d((eye - p).normalized());
}

/// Obliquely from above: from the left, unless that shows the backs of the surfaces that the cameras saw.
static Eigen::Vector3d iso_forward(const SceneAxes& axes) {
  const double side = axes.heading.dot(axes.right) > kHeadsRight ? 1.0 : -1.0;
  return std::cos(kIsoPitch) *
             (std::cos(kIsoAzimuth) * axes.forward + side * std::sin(kIsoAzimuth) * axes.right) -
         std::sin(kIsoPitch) * axes.up;
}

/// Line of sight of a view.
static Eigen::Vector3d forward_of(const SnapshotOptions& options, const SceneAxes& axes) {
  switch (options.view) {
    case View::kIso:
      return iso_forward(axes);
    case View::kTop:
      return -axes.up;
    case View::kBottom:
      return axes.up;
    case View::kFront:
      return axes.forward;

    case View::kBack:
      return -axes.forward;
    case View::kLeft:
      return axes.right;
    case View::kRight:
      return -axes.right;
    case View::kExplicit:
      break;
  }

  return (options.viewpoint.target - options.viewpoint.eye).normalized();
}

/// Up of a plan on the paper: y where z is up, as in floor plans and grids; else where the first camera
/// looked.
static Eigen::Vector3d plan_up(const SceneAxes& axes) {
  const bool z_up = (axes.up - Eigen::Vector3d::UnitZ()).norm() < 1e-9;
  return z_up ? Eigen::Vector3d(Eigen::Vector3d::UnitY()) : axes.forward;
}

Projection view_directions(const SnapshotOptions& options, const SceneAxes& axes) {
  Projection view;
  const bool given = options.view == View::kExplicit;
  const bool plan = options.view == View::kTop || options.view == View::kBottom;
  view.forward = forward_of(options, axes);
  view.up = given ? options.viewpoint.up : plan ? plan_up(axes) : axes.up;
  if (given) view.eye = options.viewpoint.eye;
  view.orthographic = options.view != View::kIso && !given;
  const double field_of_view = given ? options.viewpoint.field_of_view_deg * kDegree : kIsoFieldOfView;

  // Up becomes perpendicular to the line of sight.
  view.right = view.forward.cross(view.up).normalized();
  view.up = view.right.cross(view.forward);
  view.width_px = options.width_px;
  view.height_px = options.height_px;
  if (!view.orthographic) view.focal_px = 0.5 * view.height_px / std::tan(0.5 * field_of_view);
  return view;
}

void fit(Projection& projection, const std::vector<Eigen::Vector3d>& points,
         const std::vector<Eigen::Vector3d>& must_see, double kept_free_px) {
  const double width_px = projection.width_px - kept_free_px;
  const Interval x = extent(points, must_see, projection.right);
  const Interval y = extent(points, must_see, projection.up);
  const Interval z = extent(points, must_see, projection.forward);
  const double depth = std::max(z.high - z.low, 0.2);
  const Eigen::Vector3d centre =
      0.5 * ((x.low + x.high) * projection.right + (y.low + y.high) * projection.up +
             (z.low + z.high) * projection.forward);

  // Distance of the eye, or scale of the plan.
  double distance = 2.0 * depth + 1.0;
  if (projection.orthographic) {
    fit_orthographic(projection, x, y, width_px);
  } else {
    distance = fit_distance(projection, centre, points, must_see, width_px);
  }
  const double aside_m = 0.5 * kept_free_px / projection.pixels_per_metre(distance);
  projection.eye = centre - distance * projection.forward + aside_m * projection.right;

  // Some points may lie outside; half as much depth again includes them without wasting depth precision.
  projection.near_m = std::max(distance - 1.0 * depth, 0.05 * distance);
  projection.far_m = distance + 1.5 * depth;
}

}  // namespace plumbline::viz
