// SPDX-License-Identifier: BSD-3-Clause
#include "place_bound.hpp"

#include "plumbline/core/clones.hpp"

namespace plumbline::mapping {
namespace {

constexpr double kSlack_px = 0.1;
constexpr double kSlack_m = 0.002;
constexpr double kSlackCosine = 0.01;
constexpr double kAnyDepth_m = 1e9;

// Columns of numbers and no branches: compilers make vector code of these. `pose`: rotation by rows, then
// translation.

PLUMBLINE_CLONES double fitting_points(const double* columns, std::size_t count, const double* pose,
                                       const double* camera) {
  const double* mx = columns;
  const double* my = mx + count;
  const double* mz = my + count;
  const double* qx = mz + count;
  const double* qy = qx + count;
  const double* gate2 = qy + count;
  const double* depth = gate2 + count;
  const double* reach = depth + count;
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = pose[0] * mx[i] + pose[1] * my[i] + pose[2] * mz[i] + pose[9];
    const double y = pose[3] * mx[i] + pose[4] * my[i] + pose[5] * mz[i] + pose[10];
    const double z = pose[6] * mx[i] + pose[7] * my[i] + pose[8] * mz[i] + pose[11];
    const double u = camera[0] * x + (camera[2] - qx[i]) * z;  // pixels apart, times z
    const double v = camera[1] * y + (camera[3] - qy[i]) * z;
    const double off = z - depth[i];
    const double near = z >= pose_gate::kNear_m - kSlack_m ? 1.0 : 0.0;
    const double seen = u * u + v * v <= gate2[i] * z * z ? near : 0.0;
    sum += off * off <= reach[i] * reach[i] ? seen : 0.0;
  }
  return sum;
}

PLUMBLINE_CLONES double fitting_lines(const double* columns, std::size_t count, const double* pose,
                                      const double* camera) {
  constexpr double kGate = (pose_gate::kLine_px + kSlack_px) * (pose_gate::kLine_px + kSlack_px);
  constexpr double kCosine = pose_gate::kLineCosine - kSlackCosine;
  const double* a = columns;
  const double* b = a + 3 * count;
  const double* s = b + 3 * count;
  const double* e = s + 2 * count;
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double ax = pose[0] * a[i] + pose[1] * a[i + count] + pose[2] * a[i + 2 * count] + pose[9];
    const double ay = pose[3] * a[i] + pose[4] * a[i + count] + pose[5] * a[i + 2 * count] + pose[10];
    const double az = pose[6] * a[i] + pose[7] * a[i + count] + pose[8] * a[i + 2 * count] + pose[11];
    const double bx = pose[0] * b[i] + pose[1] * b[i + count] + pose[2] * b[i + 2 * count] + pose[9];
    const double by = pose[3] * b[i] + pose[4] * b[i + count] + pose[5] * b[i + 2 * count] + pose[10];
    const double bz = pose[6] * b[i] + pose[7] * b[i + count] + pose[8] * b[i + 2 * count] + pose[11];
    const double px = camera[0] * ax / az + camera[2];
    const double py = camera[1] * ay / az + camera[3];
    const double dx = camera[0] * bx / bz + camera[2] - px;
    const double dy = camera[1] * by / bz + camera[3] - py;
    const double ex = e[i] - s[i];
    const double ey = e[i + count] - s[i + count];
    const double length2 = dx * dx + dy * dy;
    const double along = dx * ex + dy * ey;
    const double start = dx * (s[i + count] - py) - dy * (s[i] - px);
    const double stop = dx * (e[i + count] - py) - dy * (e[i] - px);
    double fits = az >= pose_gate::kNear_m - kSlack_m ? 1.0 : 0.0;
    fits = bz >= pose_gate::kNear_m - kSlack_m ? fits : 0.0;
    fits = along >= 0.0 ? fits : 0.0;
    fits = along * along >= kCosine * kCosine * length2 * (ex * ex + ey * ey) ? fits : 0.0;
    fits = start * start <= kGate * length2 ? fits : 0.0;
    sum += stop * stop <= kGate * length2 ? fits : 0.0;
  }
  return sum;
}

}  // namespace

InlierBound::InlierBound(const PosePairs& pairs, const sensor::Pinhole& camera)
    : point_count_(pairs.points.size()),
      line_count_(pairs.lines.size()),
      camera_{camera.fx, camera.fy, camera.cx, camera.cy} {
  constexpr std::size_t kPointColumns = 8;
  constexpr std::size_t kLineColumns = 10;
  points_.resize(kPointColumns * point_count_);
  for (std::size_t i = 0; i < point_count_; ++i) {
    const PointPair& p = pairs.points[i];
    const double gate = pose_gate::kPoint_px * p.sigma + kSlack_px;
    const bool measured = p.depth > 0.0;
    const std::array<double, kPointColumns> values{
        p.match.x(),
        p.match.y(),
        p.match.z(),
        p.query.x(),
        p.query.y(),
        gate * gate,
        measured ? p.depth : 0.0,
        measured ? pose_gate::depth_m(p.depth) + kSlack_m : kAnyDepth_m};
    for (std::size_t k = 0; k < kPointColumns; ++k) points_[k * point_count_ + i] = values[k];
  }
  lines_.resize(kLineColumns * line_count_);
  for (std::size_t i = 0; i < line_count_; ++i) {
    const LinePair& l = pairs.lines[i];
    const Eigen::Vector2d s = l.query.start.cast<double>();
    const Eigen::Vector2d e = l.query.end.cast<double>();
    const std::array<double, kLineColumns> values{l.match_start.x(),
                                                  l.match_start.y(),
                                                  l.match_start.z(),
                                                  l.match_end.x(),
                                                  l.match_end.y(),
                                                  l.match_end.z(),
                                                  s.x(),
                                                  s.y(),
                                                  e.x(),
                                                  e.y()};
    for (std::size_t k = 0; k < kLineColumns; ++k) lines_[k * line_count_ + i] = values[k];
  }
}

std::size_t InlierBound::of(const geometry::Rigid3& query_from_match) const {
  const Eigen::Matrix3d& r = query_from_match.rotation;
  const Eigen::Vector3d& t = query_from_match.translation;
  const std::array<double, 12> pose{r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2),
                                    r(2, 0), r(2, 1), r(2, 2), t.x(),   t.y(),   t.z()};
  return static_cast<std::size_t>(fitting_points(points_.data(), point_count_, pose.data(), camera_.data()) +
                                  fitting_lines(lines_.data(), line_count_, pose.data(), camera_.data()));
}

}  // namespace plumbline::mapping
