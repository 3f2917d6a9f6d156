// SPDX-License-Identifier: BSD-3-Clause
// On a plane 1 / z is linear in the ray (x, y, 1). If depth is the distance along the ray, sqrt(1 + x^2 +
// y^2) / d is; if it is a disparity, d itself. The right kind is the one by which planes are largest.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "grade.hpp"

namespace plumbline::diagnose {
namespace {

enum Kind : std::size_t { kAlongZ, kAlongRay, kDisparity, kKinds };

constexpr int kGrid = 2;          // of the samples' depth
constexpr int kSeedSpacing = 20;  // of grid points
constexpr int kSeedHalf = 5;
constexpr double kTolerance = 0.02;  // of the distance
constexpr std::size_t kLeastRegion = 500;
constexpr std::size_t kLeastPlanes = 8;
constexpr double kBend = 0.15;        // of ray distances taken as z
constexpr double kMoreInfo = 1.2;     // of planes, if depth is taken along the ray
constexpr double kFewerPlanes = 1.2;  // for the same surface, if depth is taken as disparity

/// Depth of one frame on a grid, as a quantity that is linear on planes.
struct Field {
  int width = 0;
  int height = 0;
  std::vector<float> x, y, d;
  std::size_t measured = 0;

  [[nodiscard]] double value(Kind kind, std::size_t i) const {
    const double d_i = d[i];
    if (kind == kDisparity) return d_i;
    return (kind == kAlongRay ? std::sqrt(1.0 + x[i] * x[i] + y[i] * y[i]) : 1.0) / d_i;
  }
};

/// Depth on the grid, with the directions of its rays.
Field field_of(const Sample& sample, const sensor::Pinhole& camera) {
  Field f;
  f.width = sample.depth.cols / kGrid;
  f.height = sample.depth.rows / kGrid;
  for (int v = 0; v < f.height; ++v) {
    const auto* row = sample.depth.ptr<float>(v * kGrid);
    for (int u = 0; u < f.width; ++u) {
      f.x.push_back(static_cast<float>((u * kGrid - camera.cx) / camera.fx));
      f.y.push_back(static_cast<float>((v * kGrid - camera.cy) / camera.fy));
      f.d.push_back(row[u * kGrid]);
      f.measured += row[u * kGrid] > 0.0F ? 1 : 0;
    }
  }
  return f;
}

/// Bend of depth on a plane, in terms of that of distances along the ray: 0 along z, 1 along the ray.
struct Bend {
  double value = 0.0;
  double weight = 0.0;  ///< information
};

/// Minimises the sum of ((a + b x + c y) / value - 1)^2.
class PlaneFit {
 public:
  void add(const Field& f, Kind kind, std::size_t i) {
    const Eigen::Vector3d row = Eigen::Vector3d(1.0, f.x[i], f.y[i]) / f.value(kind, i);
    normal_ += row * row.transpose();
    right_ += row;
  }
  [[nodiscard]] Eigen::Vector3d solve() const { return normal_.ldlt().solve(right_); }

 private:
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Identity() * 1e-9;
  Eigen::Vector3d right_ = Eigen::Vector3d::Zero();
};

class PlaneGrower {
 public:
  explicit PlaneGrower(const Field& field) : f_(field) {}

  /// Number of grid points on planes of some size; adds the bend of each.
  std::size_t covered(Kind kind, std::vector<Bend>& bends) {
    taken_.assign(f_.d.size(), 0);
    std::size_t count = 0;
    for (int v = kSeedSpacing / 2; v < f_.height; v += kSeedSpacing) {
      for (int u = kSeedSpacing / 2; u < f_.width; u += kSeedSpacing) {
        const std::size_t seed = at(u, v);
        if (taken_[seed] != 0 || !(f_.d[seed] > 0.0F)) continue;
        if (!grow(kind, u, v)) continue;
        bends.push_back(bend(kind));
        for (const std::size_t i : region_) {
          count += taken_[i] == 0 ? 1 : 0;
          taken_[i] = 1;
        }
      }
    }
    return count;
  }

 private:
  [[nodiscard]] std::size_t at(int u, int v) const { return static_cast<std::size_t>(v * f_.width + u); }

  bool grow(Kind kind, int u, int v) {
    // First plane from the seed's surroundings.
    PlaneFit first;
    int count = 0;
    for (int y = std::max(0, v - kSeedHalf); y <= std::min(f_.height - 1, v + kSeedHalf); ++y) {
      for (int x = std::max(0, u - kSeedHalf); x <= std::min(f_.width - 1, u + kSeedHalf); ++x) {
        if (!(f_.d[at(x, y)] > 0.0F)) continue;
        first.add(f_, kind, at(x, y));
        ++count;
      }
    }

    // Too few points for a plane.
    if (count < 60) return false;

    // Grown from the seed, fitted to its region again.
    Eigen::Vector3d plane = first.solve();
    for (int round = 0; round < 3; ++round) {
      flood(kind, at(u, v), plane);
      if (region_.size() < kLeastRegion / 4) return false;
      PlaneFit all;
      for (const std::size_t i : region_) all.add(f_, kind, i);
      plane = all.solve();
    }

    // The region of the last fit.
    flood(kind, at(u, v), plane);
    return region_.size() >= kLeastRegion;
  }

  /// 1 / d = (a + b x + c y) (1 - bend r^2 / 2) on the region.
  [[nodiscard]] Bend bend(Kind kind) const {
    PlaneFit fit;
    for (const std::size_t i : region_) fit.add(f_, kind, i);
    const Eigen::Vector3d plane = fit.solve();
    Eigen::Matrix4d normal = Eigen::Matrix4d::Identity() * 1e-9;
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const std::size_t i : region_) {
      const double value = f_.value(kind, i);
      const double r2 = f_.x[i] * f_.x[i] + f_.y[i] * f_.y[i];
      const double at = plane.x() + plane.y() * f_.x[i] + plane.z() * f_.y[i];
      const Eigen::Vector4d row = Eigen::Vector4d(1.0, f_.x[i], f_.y[i], -0.5 * r2 * at) / value;
      normal += row * row.transpose();
      right += row;
    }
    const Eigen::Vector4d solution = normal.ldlt().solve(right);
    return {solution.w(), 1.0 / normal.inverse()(3, 3)};
  }

  /// Connected grid points on the plane, from the seed on.
  void flood(Kind kind, std::size_t seed, const Eigen::Vector3d& plane) {
    seen_.assign(f_.d.size(), 0);
    region_.clear();
    const auto visit = [&](std::size_t i) {
      if (seen_[i] != 0 || !(f_.d[i] > 0.0F)) return;
      seen_[i] = 1;
      const double fit = plane.x() + plane.y() * f_.x[i] + plane.z() * f_.y[i];
      if (std::abs(fit / f_.value(kind, i) - 1.0) < kTolerance) region_.push_back(i);
    };
    visit(seed);
    const auto width = static_cast<std::size_t>(f_.width);
    for (std::size_t k = 0; k < region_.size(); ++k) {
      const std::size_t i = region_[k];
      if (i % width > 0) visit(i - 1);
      if (i % width + 1 < width) visit(i + 1);
      if (i >= width) visit(i - width);
      if (i + width < f_.d.size()) visit(i + width);
    }
  }

  const Field& f_;
  std::vector<unsigned char> taken_, seen_;
  std::vector<std::size_t> region_;
};

/// Planes of all frames, if depth is of one kind.
struct Planes {
  std::vector<Bend> bends;
  double covered = 0.0;  ///< grid points

  [[nodiscard]] double weight() const {
    double sum = 0.0;
    for (const Bend& bend : bends) sum += bend.weight;
    return sum;
  }
  /// Weighted median of the bends.
  [[nodiscard]] double bend() const {
    std::vector<Bend> sorted = bends;
    std::sort(sorted.begin(), sorted.end(), [](const Bend& a, const Bend& b) { return a.value < b.value; });
    double left = 0.5 * weight();
    for (const Bend& bend : sorted) {
      if ((left -= bend.weight) <= 0.0) return bend.value;
    }
    return 0.0;
  }
};

/// Planes bend if depth is the distance along the ray.
Sign ray_sign(const Planes& along_z, const Planes& along_ray) {
  Sign sign{"ray_distance", "of the bend of distances along the ray"};
  if (std::min(along_z.bends.size(), along_ray.bends.size()) < kLeastPlanes) return sign;
  sign.size = along_z.bend();
  const double info = along_ray.weight() / std::max(1e-9, along_z.weight());
  if (!grade(sign, {sign.size / kBend, info / kMoreInfo, 2.0 - std::abs(along_ray.bend()) / kBend}))
    return sign;
  sign.text = fmt::format(
      "depth is the distance along the ray, not along the camera's axis: {} planes bend ({:+.2f}; {:+.2f} if "
      "it is taken so)",
      along_z.bends.size(), sign.size, along_ray.bend());
  sign.remedy =
      "divide each pixel's depth by sqrt(1 + x^2 + y^2), x = (u - cx) / fx, y = (v - cy) / fy, or let the "
      "recorder write z";
  return sign;
}

/// Depth read as disparity covers more with fewer planes.
Sign disparity_sign(const Planes& depth, const Planes& disparity) {
  Sign sign{"disparity", "times fewer planes"};
  if (std::min(depth.bends.size(), disparity.bends.size()) < kLeastPlanes) return sign;
  sign.size = static_cast<double>(depth.bends.size()) / static_cast<double>(disparity.bends.size());
  const double more = disparity.covered > depth.covered ? 2.0 : 0.0;
  if (!grade(sign, {sign.size / kFewerPlanes, more})) return sign;
  sign.text = fmt::format(
      "the depth images hold disparities or inverse depth, not distances: taken so, {} planes cover what "
      "takes {} now",
      disparity.bends.size(), depth.bends.size());
  sign.remedy = "write depth = focal length x baseline / disparity, in millimetres";
  return sign;
}

}  // namespace

std::vector<Sign> depth_kind_signs(const Samples& samples) {
  std::array<Planes, kKinds> planes;
  const std::vector<Sample> all = samples.samples();
  for (std::size_t k = 0; k < all.size(); k += 4) {
    const Field field = field_of(all[k], samples.depth_camera());

    // Too little depth for planes.
    if (field.measured < 4 * kLeastRegion) continue;
    PlaneGrower grower(field);
    for (const Kind kind : {kAlongZ, kAlongRay, kDisparity})
      planes[kind].covered += static_cast<double>(grower.covered(kind, planes[kind].bends));
  }
  return {ray_sign(planes[kAlongZ], planes[kAlongRay]), disparity_sign(planes[kAlongZ], planes[kDisparity])};
}

}  // namespace plumbline::diagnose
