// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/trajectory_io.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "plumbline/core/output_file.hpp"

namespace plumbline::dataset {
namespace {

/// TUM's format, rounded to microseconds and nanometres.
std::string to_text(const geometry::Trajectory& trajectory) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (const geometry::StampedPose& pose : trajectory) {
    const auto digit = [](double v) { return std::abs(v) < 0.5e-9 ? 0.0 : v; };  // no "-0.000000000"
    const Eigen::Vector3d t = pose.world_from_camera.translation.unaryExpr(digit);
    Eigen::Quaterniond q = pose.world_from_camera.quaternion();
    q.coeffs() = q.coeffs().unaryExpr(digit).eval();
    fmt::format_to(std::back_inserter(text), "{:.6f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                   pose.stamp, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

}  // namespace

core::Result<void> write_trajectory(const std::filesystem::path& file,
                                    const geometry::Trajectory& trajectory) {
  return core::write_file(file, to_text(trajectory));
}

}  // namespace plumbline::dataset
