// SPDX-License-Identifier: BSD-3-Clause
// Poses that were written by another convention carry one frame's depth to where the next frame does not see
// it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "grade.hpp"
#include "plumbline/geometry/pose_convention.hpp"

namespace plumbline::diagnose {
namespace {

using geometry::Rigid3;
using PoseAt = std::function<std::optional<Rigid3>(double)>;

/// Another reading of the same poses.
struct Variant {
  std::string name;
  std::string what;
  std::string remedy;
  PoseAt at;
};

constexpr int kPointStep = 8;  // of the samples' depth
constexpr double kCertainGain = 1.25;
constexpr double kLeastAgree = 0.3;  // of the points, by the better reading
constexpr std::size_t kLeastPairs = 4;

/// Share of a's points that b measures where the poses put them; the best of those in view and of all.
double agreement(const Sample& a, const Sample& b, const sensor::Pinhole& camera, const Rigid3& b_from_a) {
  std::size_t good = 0, all = 0;
  for (int v = 0; v < a.depth.rows; v += kPointStep) {
    const auto* row = a.depth.ptr<float>(v);
    for (int u = 0; u < a.depth.cols; u += kPointStep) {
      if (!(row[u] > 0.0F)) continue;
      const Eigen::Vector3d p = b_from_a * camera.unproject(u, v, row[u]);
      ++all;
      if (p.z() < 0.05) continue;
      const Eigen::Vector2d at = camera.project(p);
      const int bu = static_cast<int>(std::lround(at.x())), bv = static_cast<int>(std::lround(at.y()));
      if (bu < 0 || bv < 0 || bu >= b.depth.cols || bv >= b.depth.rows) continue;
      const double z = b.depth.ptr<float>(bv)[bu];
      if (z > 0.0 && std::abs(z - p.z()) < 0.01 + 0.004 * z * z + 0.005 * z) ++good;
    }
  }
  return all > 100 ? static_cast<double>(good) / static_cast<double>(all) : -1.0;
}

/// Poses as given, and as they would be after one known mistake.
std::vector<Variant> variants_of(const PoseAt& given) {
  // A variant that changes every pose.
  const auto changed = [given](auto change) {
    return [given, change](double stamp) -> std::optional<Rigid3> {
      const auto pose = given(stamp);
      return pose ? std::optional<Rigid3>(change(*pose)) : std::nullopt;
    };
  };

  // Conventions of other programs.
  std::vector<Variant> all;
  all.push_back({"given", "", "", given});
  const char* what[] = {"the poses are inverted: they take points of the world to the camera",
                        "the poses have the axes of OpenGL: y up, z backwards",
                        "the quaternions of the poses begin with w"};
  for (const auto& [name, convention] : geometry::pose_conventions()) {
    all.push_back({name, what[all.size() - 1], "--poses-are " + name,
                   changed([c = convention](const Rigid3& p) { return geometry::read_by(c, p); })});
  }

  // Positions in other units.
  for (const double unit : {0.001, 0.01, 0.1, 10.0, 100.0, 1000.0}) {
    all.push_back({"scale",
                   fmt::format("the positions of the poses are not metres: times {:g} they fit depth", unit),
                   fmt::format("multiply their positions by {:g}", unit),
                   changed([unit](const Rigid3& p) { return Rigid3(p.rotation, p.translation * unit); })});
  }

  // Stamps of another clock.
  for (const double late : {-1.0, -0.5, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3, 0.5, 1.0}) {
    all.push_back({"time",
                   fmt::format("the stamps of the poses are about {:g} s {}", std::abs(late),
                               late > 0.0 ? "early" : "late"),
                   fmt::format("add {:g} s to the stamps of the poses", -late),
                   [given, late](double stamp) { return given(stamp + late); }});
  }
  return all;
}

}  // namespace

Sign pose_sign(const Samples& samples, const geometry::Trajectory& poses) {
  Sign sign{"poses", "times as much depth agrees"};
  const std::vector<Sample> all = samples.samples();
  const std::vector<Variant> variants =
      variants_of([&](double stamp) { return geometry::pose_at(poses, stamp, 0.05); });

  // Pairs within a group, which see much of the same, and of neighbouring groups.
  std::vector<double> sum(variants.size(), 0.0);
  std::vector<std::size_t> better(variants.size(), 0), count(variants.size(), 0);
  std::vector<double> given_sum(variants.size(), 0.0);

  for (std::size_t k = 0; k + 3 < all.size(); k += 4) {
    for (const std::size_t other : {k + 2, k + 3, k + 4}) {
      if (other >= all.size()) continue;
      std::optional<double> given;
      for (std::size_t v = 0; v < variants.size(); ++v) {
        const auto from = variants[v].at(all[k].stamp);
        const auto to = variants[v].at(all[other].stamp);
        if (!from || !to) continue;
        const double agree = agreement(all[k], all[other], samples.depth_camera(), to->inverse() * *from);
        if (agree < 0.0) continue;

        if (v == 0) given = agree;
        if (!given) break;
        sum[v] += agree;
        given_sum[v] += *given;
        better[v] += agree > *given ? 1 : 0;
        ++count[v];
      }
    }
  }

  // The variant with the largest gain over most pairs.
  std::size_t best = 0;
  double gain = 1.0;
  for (std::size_t v = 1; v < variants.size(); ++v) {
    if (count[v] < kLeastPairs || 3 * better[v] < 2 * count[v]) continue;
    if (sum[v] < kLeastAgree * static_cast<double>(count[v])) continue;
    const double here = sum[v] / std::max(0.02 * static_cast<double>(count[v]), given_sum[v]);
    if (here > gain) gain = here, best = v;
  }

  // Certain only with a clear gain.
  sign.size = gain;
  if (!grade(sign, {gain / kCertainGain, best > 0 ? 2.0 : 0.0})) return sign;
  const double n = static_cast<double>(count[best]);
  sign.name = "poses_" + variants[best].name;
  sign.text = fmt::format("{}: {:.0f} instead of {:.0f} % of the depth of frames agrees with that of others",
                          variants[best].what, 100.0 * sum[best] / n, 100.0 * given_sum[best] / n);
  sign.remedy = variants[best].remedy;
  return sign;
}

}  // namespace plumbline::diagnose
