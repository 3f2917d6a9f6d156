// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/trajectory_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "plumbline/core/numbers.hpp"
#include "plumbline/core/output_file.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

constexpr double kMinQuaternionNorm = 1e-3;  // below, the rotation is rounding noise

core::Result<geometry::StampedPose> read_pose(const std::string& file, const TextLine& line) {
  const auto wrong = [&](const std::string& what) {
    return core::input_error(fmt::format("{}:{}: {}", file, line.number, what));
  };
  std::array<double, 8> n{};
  if (line.words.size() < n.size()) {
    return wrong(fmt::format("expected 'stamp tx ty tz qx qy qz qw', found {} words", line.words.size()));
  }
  for (std::size_t i = 0; i < n.size(); ++i) {
    const std::optional<double> value = core::to_number(line.words[i]);
    if (!value) return wrong(fmt::format("'{}' is no number", line.words[i]));
    if (!std::isfinite(*value)) return wrong(fmt::format("'{}' is not finite", line.words[i]));
    n[i] = *value;
  }
  const Eigen::Quaterniond q(n[7], n[4], n[5], n[6]);
  if (q.norm() < kMinQuaternionNorm) return wrong("the quaternion is zero");
  return geometry::StampedPose{n[0], {q, Eigen::Vector3d(n[1], n[2], n[3])}};
}

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

core::Result<geometry::Trajectory> read_trajectory(const std::filesystem::path& file) {
  auto lines = read_lines(file);
  if (!lines) return tl::unexpected(lines.error());
  geometry::Trajectory trajectory;
  trajectory.reserve(lines->size());
  for (const TextLine& line : *lines) {
    auto pose = read_pose(file.string(), line);
    if (!pose) return tl::unexpected(pose.error());
    trajectory.push_back(*pose);
  }
  std::stable_sort(trajectory.begin(), trajectory.end(), kByStamp);
  return trajectory;
}

core::Result<void> write_trajectory(const std::filesystem::path& file,
                                    const geometry::Trajectory& trajectory) {
  return core::write_file(file, to_text(trajectory));
}

}  // namespace plumbline::dataset
