// SPDX-License-Identifier: BSD-3-Clause
#include "samples.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "plumbline/check/path_samples.hpp"
#include "verdict.hpp"

namespace plumbline::check {
namespace {

using geometry::PoseSamples;
using geometry::Vector6d;

constexpr std::uint64_t kSeedOfSigns = 32;
/// Draws of the graph turn cameras by more than they are turned, for how far they shift them.
constexpr double kTurns = 0.5;

/// The motion that shifts a place alike and turns it less.
Vector6d less_turned(const Vector6d& motion, const Eigen::Vector3d& at) {
  Vector6d less = kTurns * motion;
  less.head<3>() += (1.0 - kTurns) * (motion.head<3>() + motion.tail<3>().cross(at));
  return less;
}

}  // namespace

std::array<double, geometry::kPoseSamples> factors_of(std::size_t number) {
  core::SplitMix random(kSeedOfSigns + number);
  std::array<double, geometry::kPoseSamples> all{};
  double sum = 0.0;
  for (double& one : all) {
    one = normal(random);
    sum += one * one;
  }
  for (double& one : all) one /= std::sqrt(sum / static_cast<double>(all.size()));
  return all;
}

double normal(core::SplitMix& random) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random.next() >> 11U) * 0x1p-53;
  return sum;
}

std::vector<AnchorSamples> possible_errors(const CheckReport& report, const std::vector<GraphAnchor>& anchors,
                                           const GraphReport& graph, const CameraPart& camera) {
  if (graph.draws.empty()) return {};

  // The corrections found and the camera's part have a form of their own; draws of the graph make up the
  // rest.
  const double share = found_share(report), of_camera = camera_share();
  const double known_m = std::hypot(share * graph.rms_m, of_camera * camera.rms_m);
  const double rest_m = std::sqrt(std::max(0.0, report.expected_m * report.expected_m - known_m * known_m));
  const double of_draws = rest_m / std::max(1e-9, graph.draws_rms_m);

  const auto of_found = factors_of(0);
  std::vector<AnchorSamples> all;
  for (std::size_t a = 0; a < anchors.size(); ++a) {
    AnchorSamples one{anchors[a].stamp, anchors[a].way, {}};
    for (std::size_t s = 0; s < of_found.size(); ++s) {
      one.world[s] = share * of_found[s] * graph.found[a] +
                     of_draws * less_turned(graph.draws[a][s], anchors[a].world_from_camera.translation);
      if (!camera.draws.empty()) one.world[s] += of_camera * camera.draws[a][s];
    }
    all.push_back(one);
  }
  return all;
}

PoseSamples samples_of(const CheckReport& report, std::size_t way, const geometry::StampedPose& pose) {
  const auto begin = std::find_if(report.samples.begin(), report.samples.end(),
                                  [&](const AnchorSamples& a) { return a.way == way; });
  const auto end =
      std::find_if(begin, report.samples.end(), [&](const AnchorSamples& a) { return a.way != way; });
  PoseSamples samples;
  samples.fill(Vector6d::Constant(std::numeric_limits<double>::quiet_NaN()));
  if (begin == end) return samples;

  // Between the anchors before and after.
  const auto after = std::find_if(begin, end, [&](const AnchorSamples& a) { return a.stamp >= pose.stamp; });
  const auto last = after == end ? std::prev(end) : after;
  const auto first = last == begin || after == end ? last : std::prev(last);
  const double gap_s = last->stamp - first->stamp;
  const double at = gap_s > 0.0 ? (pose.stamp - first->stamp) / gap_s : 0.0;

  // In the camera's axes, about the camera.
  const Eigen::Matrix3d back = pose.world_from_camera.rotation.transpose();
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const Vector6d motion = (1.0 - at) * first->world[s] + at * last->world[s];
    const Eigen::Vector3d turn = motion.tail<3>();
    samples[s] << back * (motion.head<3>() + turn.cross(pose.world_from_camera.translation)), back * turn;
  }
  return samples;
}

}  // namespace plumbline::check
