// SPDX-License-Identifier: BSD-3-Clause
#include "scene/point_style.hpp"

#include <pcl/common/point_tests.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::viz {
namespace {

using Point = pcl::PointXYZRGBNormal;

// A wall seen edge-on has normals that scatter about 90 degrees to the view; it must not get holes.
constexpr double kFacesAway = -0.2;
constexpr double kSurroundedAway = -0.4;

Eigen::Vector3d position(const Point& p) { return {p.x, p.y, p.z}; }
Eigen::Vector3d normal(const Point& p) { return {p.normal_x, p.normal_y, p.normal_z}; }

Rgb scaled(const Rgb& color, double factor) {
  const auto channel = [factor](std::uint8_t v) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(factor * v, 0.0, 255.0)));
  };
  return {channel(color.r), channel(color.g), channel(color.b)};
}

/// Light from above and left of the viewer; 1 for a surface that faces it.
double shade(const Point& p, const Eigen::Vector3d& to_light) {
  const Eigen::Vector3d n = normal(p);
  const double length = n.norm();
  if (!(length > 0.1)) return 0.92;
  const double lambert = std::max(0.0, n.dot(to_light) / length);
  return 0.66 + 0.38 * lambert;
}

/// Middle 96 % of the finite values, widened when they are all alike.
std::pair<double, double> value_range(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); }),
               values.end());
  if (values.empty()) return {0.0, 1.0};
  const double low = core::quantile(values, 0.02, 0.0);
  const double high = core::quantile(values, 0.98, 0.0);
  if (high - low > 1e-9 * std::max(std::abs(low), std::abs(high))) return {low, high};
  const double half = std::max(0.5 * std::abs(low), 0.5);
  return {low - half, low + half};
}

/// Colours by one value per chosen point over a range.
PointColors color_by_value(const std::vector<double>& values, const std::pair<double, double>& range,
                           const std::string& label) {
  PointColors result;
  result.scale = {true, range.first, range.second, label};
  result.colors.reserve(values.size());
  for (const double v : values) {
    result.colors.push_back(sequential_color((v - range.first) / (range.second - range.first)));
  }
  return result;
}

Rgb robot_color(float robot) {
  return std::isfinite(robot) && robot >= 0.0F ? category_color(static_cast<std::size_t>(robot))
                                               : Rgb{150, 150, 150};
}

/// One channel per axis of the scene; grey without a normal.
Rgb normal_color(const Point& p, const SceneAxes& axes) {
  const Eigen::Vector3d n = normal(p);
  if (!(n.norm() > 0.1)) return {150, 150, 150};
  const auto channel = [&n](const Eigen::Vector3d& axis) {
    return static_cast<std::uint8_t>(
        std::lround(127.5 + 110.0 * std::clamp(n.normalized().dot(axis), -1.0, 1.0)));
  };
  return {channel(axes.right), channel(axes.forward), channel(axes.up)};
}

/// Colours before shading, and the scale that explains them.
PointColors base_colors(const Scene& scene, const std::vector<std::uint32_t>& points,
                        const SnapshotOptions& options, const SceneAxes& axes) {
  const auto& cloud = *scene.cloud;
  PointColors result;

  switch (options.color) {
    case ColorMode::kRgb:
      for (const auto i : points) result.colors.push_back({cloud[i].r, cloud[i].g, cloud[i].b});
      return result;
    case ColorMode::kNormal:
      for (const auto i : points) result.colors.push_back(normal_color(cloud[i], axes));
      return result;
    case ColorMode::kRobot:
      for (const auto i : points) result.colors.push_back(robot_color(scene.scalars[i]));
      return result;

    case ColorMode::kHeight: {
      std::vector<double> heights;
      heights.reserve(points.size());
      for (const auto i : points) heights.push_back(position(cloud[i]).dot(axes.up));

      // Quantiles, for outliers must not stretch the scale.
      const double floor = core::quantile(heights, 0.01, 0.0);
      for (double& h : heights) h -= floor;
      const double top = std::max(0.1, core::quantile(heights, 0.98, 0.0));
      return color_by_value(heights, options.scalar_range.value_or(std::make_pair(0.0, top)), "height (m)");
    }

    case ColorMode::kError:
    case ColorMode::kSigma:
    case ColorMode::kConfidence: {
      std::vector<double> values;
      values.reserve(points.size());
      for (const auto i : points) values.push_back(scene.scalars[i]);

      // The map's name of its values comes first.
      const std::string fallback =
          options.color == ColorMode::kError ? "error (m)" : color_mode_name(options.color);
      return color_by_value(values, options.scalar_range.value_or(value_range(values)),
                            scene.scalar_label.empty() ? fallback : scene.scalar_label);
    }
  }

  return result;
}

/// Normals summed over cubes: the direction that the surface around a point faces, independent of its own
/// noisy normal.
class Surroundings {
 public:
  explicit Surroundings(const Scene& scene, std::size_t step) {
    const auto& cloud = *scene.cloud;
    for (std::size_t i = 0; i < cloud.size(); i += step) {
      const Eigen::Vector3d n = normal(cloud[i]);
      if (pcl::isXYZFinite(cloud[i]) && n.allFinite())
        sums_.try_emplace(cell(cloud[i]), Eigen::Vector3d::Zero()).first.value() += n;
    }
  }
  [[nodiscard]] Eigen::Vector3d direction(const Point& p) const {
    const auto found = sums_.find(cell(p));
    return found == sums_.end() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(found->second.normalized());
  }

 private:
  static std::uint64_t cell(const Point& p) {
    constexpr double kSide_m = 0.15;
    return cloud::pack_cell(cloud::cell_of(position(p) / kSide_m));
  }
  cloud::CellMap<Eigen::Vector3d> sums_;
};

}  // namespace

std::vector<std::uint32_t> visible_points(const Scene& scene, const Projection& projection, bool cull,
                                          std::size_t step) {
  std::vector<std::uint32_t> all;
  std::vector<std::uint32_t> facing;
  if (scene.cloud == nullptr) return all;

  // Surroundings smooth noisy normals.
  const auto& cloud = *scene.cloud;
  all.reserve(cloud.size() / step + 1);
  std::optional<Surroundings> surroundings;
  if (cull) surroundings.emplace(scene, step);

  for (std::size_t i = 0; i < cloud.size(); i += step) {
    const Point& p = cloud[i];
    if (!pcl::isXYZFinite(p)) continue;
    all.push_back(static_cast<std::uint32_t>(i));
    if (!cull) continue;

    const Eigen::Vector3d to_viewer = projection.to_viewer(position(p));
    const bool away = normal(p).dot(to_viewer) < kFacesAway;  // false for NaN normals
    // A ceiling that is left out must leave no isolated points: those whose normals are noise follow their
    // surroundings.
    if (away || surroundings->direction(p).dot(to_viewer) < kSurroundedAway) continue;
    facing.push_back(static_cast<std::uint32_t>(i));
  }

  const bool enough = facing.size() * 50 > all.size();
  return cull && enough ? facing : all;
}

/// The nearest point of each cell, for it covers farther ones.
std::vector<std::uint32_t> nearest_per_cell(const Scene& scene, const std::vector<std::uint32_t>& points,
                                            const Projection& projection, double cell_px) {
  constexpr std::uint32_t kNone = 0xffffffffU;
  constexpr double kBorderCells = 16.0;  // a point outside may still reach in with its size
  const double columns = std::ceil(projection.width_px / cell_px) + 2.0 * kBorderCells;
  const double rows = std::ceil(projection.height_px / cell_px) + 2.0 * kBorderCells;
  const auto cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::vector<std::uint32_t> nearest(cells, kNone);

  // Points outside the grid cannot be seen.
  std::vector<float> depth(cells, std::numeric_limits<float>::infinity());
  for (const auto i : points) {
    const Eigen::Vector3d at = projection.project(position((*scene.cloud)[i]));
    const double column = std::floor(at.x() / cell_px) + kBorderCells;
    const double row = std::floor(at.y() / cell_px) + kBorderCells;
    const bool inside = column >= 0.0 && column < columns && row >= 0.0 && row < rows &&
                        at.z() > projection.near_m && at.z() < projection.far_m;
    if (!inside) continue;

    // Depth test within the cell.
    const auto cell = static_cast<std::size_t>(row * columns + column);
    if (static_cast<float>(at.z()) >= depth[cell]) continue;
    depth[cell] = static_cast<float>(at.z());
    nearest[cell] = i;
  }

  // In the order of the cloud.
  nearest.erase(std::remove(nearest.begin(), nearest.end(), kNone), nearest.end());
  std::sort(nearest.begin(), nearest.end());
  return nearest;
}

double point_spacing(const Scene& scene, const std::vector<std::uint32_t>& points) {
  if (points.size() < 2) return 0.0;

  // Count points in cubes; a surface through a cube of side h covers about 1.2 h^2 of it.
  constexpr int kCells = 128;
  Eigen::Vector3d low, high;

  // Extent without outliers, from a sample.
  const std::size_t step = std::max<std::size_t>(1, points.size() / 20000);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (std::size_t i = 0; i < points.size(); i += step) {
      values.push_back(position((*scene.cloud)[points[i]])[axis]);
    }
    low[axis] = core::quantile(values, 0.01, 0.0);
    high[axis] = core::quantile(values, 0.99, 0.0);
  }

  // Occupied cubes measure the surface.
  const double side = std::max((high - low).maxCoeff() / kCells, 1e-4);
  std::vector<std::uint32_t> count(static_cast<std::size_t>(kCells) * kCells * kCells, 0);
  for (const auto i : points) {
    const Eigen::Vector3d cell = (position((*scene.cloud)[i]) - low) / side;
    if ((cell.array() < 0.0).any() || (cell.array() >= kCells).any()) continue;
    const auto index = [&cell](int axis) { return static_cast<std::size_t>(cell[axis]); };
    ++count[(index(2) * kCells + index(1)) * kCells + index(0)];
  }

  count.erase(std::remove(count.begin(), count.end(), 0U), count.end());
  if (count.empty()) return side;
  return side * std::sqrt(1.2 / static_cast<double>(core::median(std::move(count))));
}

PointColors color_points(const Scene& scene, const std::vector<std::uint32_t>& points,
                         const SnapshotOptions& options, const SceneAxes& axes,
                         const Projection& projection) {
  PointColors result;
  if (points.empty()) return result;
  result = base_colors(scene, points, options, axes);
  // Normals are colours already, and categories must stay comparable with the legend: shade them less.
  const double strength = options.color == ColorMode::kNormal ? 0.0
                          : options.color == ColorMode::kRgb  ? 1.0
                                                              : 0.8;
  if (!options.shading || strength == 0.0) return result;
  const Eigen::Vector3d to_light =
      (-projection.forward + 0.45 * projection.up - 0.35 * projection.right).normalized();
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double factor = 1.0 + strength * (shade((*scene.cloud)[points[k]], to_light) - 1.0);
    result.colors[k] = scaled(result.colors[k], factor);
  }
  return result;
}

}  // namespace plumbline::viz
