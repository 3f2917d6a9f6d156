// SPDX-License-Identifier: BSD-3-Clause
#include "pair_choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "plumbline/core/numbers.hpp"

namespace plumbline::check {
namespace {

using geometry::Rigid3;

constexpr std::array<double, kRevisit> kGaps_s{1.0 / 3.0, 1.0, 3.0};
/// Every n-th anchor begins a pair.
constexpr std::array<std::size_t, kRevisit> kEvery{1, 1, 3};
constexpr double kRevisitAfter_s = 5.0;
constexpr double kLeastOverlap = 0.12;
constexpr std::size_t kMostAnAnchor = 3;
constexpr std::size_t kMostRevisits = 200;

/// The share of the first picture that the second one may show from the same side; 0: none worth a pair.
double overlap(const Outline& first, const Eigen::Vector3d& first_at, const FramePoses& second,
               const SmallCamera& camera) {
  constexpr double kSameSide = 0.25;
  const Rigid3 camera_from_world = second.world_from_depth.inverse();
  std::vector<double> ratios;
  for (std::size_t i = 0; i < first.points.size(); ++i) {
    const Eigen::Vector3d p = camera_from_world * first.points[i];
    if (!camera.grid_point(p)) continue;
    const Eigen::Vector3d normal = camera_from_world.rotation * first.normals[i];
    if (-normal.dot(p) / p.norm() > kSameSide)
      ratios.push_back(p.norm() / (first.points[i] - first_at).norm());
  }
  if (ratios.empty()) return 0.0;

  const double seen =
      first.share * static_cast<double>(ratios.size()) / static_cast<double>(first.points.size());
  const double ratio = core::median(std::move(ratios));
  return seen > kLeastOverlap && ratio > 0.5 && ratio < 2.0 ? seen : 0.0;
}

struct Revisit {
  std::size_t rank = 0;  ///< among those of its anchor
  std::size_t first = 0;
  std::size_t second = 0;
};

/// At most kMostRevisits, the best of each anchor before the second best ones, evenly spread.
std::vector<Revisit> thinned(std::vector<Revisit> all) {
  std::sort(all.begin(), all.end(), [](const Revisit& a, const Revisit& b) {
    return std::tie(a.rank, a.first, a.second) < std::tie(b.rank, b.first, b.second);
  });
  std::vector<Revisit> kept;
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && all[end].rank == all[begin].rank) ++end;
    const std::size_t many = end - begin, room = std::min(many, kMostRevisits - kept.size());
    for (std::size_t i = 0; i < room; ++i) kept.push_back(all[begin + i * many / room]);
  }
  return kept;
}

void add_revisits(const std::vector<PosedFrame>& frames, const std::vector<std::size_t>& anchors,
                  const std::vector<Outline>& outlines, const std::vector<SmallCamera>& cameras,
                  std::vector<Partners>& pairs) {
  std::vector<Revisit> found;
  std::set<std::pair<std::size_t, std::size_t>> taken;

  for (std::size_t a = 0; a < anchors.size(); ++a) {
    const PosedFrame& first = frames[anchors[a]];
    const Eigen::Vector3d at = first.poses.world_from_depth.translation;
    std::vector<std::pair<double, std::size_t>> partners;

    // Anchors of another time that see the same surface.
    for (std::size_t b = 0; b < anchors.size(); ++b) {
      const PosedFrame& second = frames[anchors[b]];

      const bool other = first.frame.way != second.frame.way;
      if (!other && std::abs(first.frame.stamp - second.frame.stamp) < kRevisitAfter_s) continue;
      if (outlines[a].points.empty() || outlines[b].points.empty()) continue;

      const double apart = (at - second.poses.world_from_depth.translation).norm();
      if (apart > outlines[a].distance_m + outlines[b].distance_m) continue;
      const double seen = overlap(outlines[a], at, second.poses, cameras[second.frame.way]);
      if (seen > 0.0) partners.emplace_back(-seen, b);
    }

    // The best ones, not all of one visit.
    std::sort(partners.begin(), partners.end());
    std::vector<std::size_t> chosen;
    for (const auto& [seen, b] : partners) {
      const bool near = std::any_of(chosen.begin(), chosen.end(), [&](std::size_t c) {
        const KeptFrame& x = frames[anchors[b]].frame;
        const KeptFrame& y = frames[anchors[c]].frame;
        return x.way == y.way && std::abs(x.stamp - y.stamp) < 2.0;
      });

      if (near) continue;
      chosen.push_back(b);
      if (taken.insert(std::minmax(a, b)).second) found.push_back({chosen.size(), a, b});
      if (chosen.size() == kMostAnAnchor) break;
    }
  }

  for (const Revisit& revisit : thinned(std::move(found)))
    pairs[revisit.first].by_gap[kRevisit].push_back(revisit.second);
}

}  // namespace

Outline outline_of(const View& view) {
  constexpr int kStep = 24;
  Outline outline;
  std::vector<double> depths;
  std::size_t all = 0;
  const cv::Size& size = view.camera->size();
  for (int y = kStep / 2; y < size.height; y += kStep) {
    for (int x = kStep / 2; x < size.width; x += kStep, ++all) {
      if (view.z({x, y}) > 0.0) depths.push_back(view.z({x, y}));
      const auto normal = view.normal({x, y});
      if (!normal) continue;
      outline.points.push_back(view.poses.world_from_depth * view.point({x, y}));
      outline.normals.emplace_back(view.poses.world_from_depth.rotation * *normal);
    }
  }
  outline.share = all > 0 ? static_cast<double>(outline.points.size()) / static_cast<double>(all) : 0.0;
  outline.distance_m = depths.empty() ? 0.0 : core::median(std::move(depths));
  return outline;
}

std::vector<Partners> choose_pairs(const std::vector<PosedFrame>& frames,
                                   const std::vector<std::size_t>& anchors,
                                   const std::vector<Outline>& outlines,
                                   const std::vector<SmallCamera>& cameras) {
  std::vector<Partners> pairs(anchors.size());
  for (std::size_t a = 0; a < anchors.size(); ++a) {
    const KeptFrame& first = frames[anchors[a]].frame;
    const std::size_t after = anchors[a] + 1;
    if (after < frames.size() && frames[after].frame.use == FrameChoice::Use::kNext &&
        frames[after].frame.way == first.way)
      pairs[a].next = after;

    for (std::size_t gap = 0; gap < kRevisit; ++gap) {
      if (a % kEvery[gap] != 0) continue;

      // The anchor nearest to that time, if there is one about then.
      std::size_t best = a;
      for (std::size_t b = a + 1; b < anchors.size() && frames[anchors[b]].frame.way == first.way; ++b) {
        const auto off = [&](std::size_t c) {
          return std::abs(frames[anchors[c]].frame.stamp - first.stamp - kGaps_s[gap]);
        };

        if (frames[anchors[b]].frame.stamp - first.stamp > 1.4 * kGaps_s[gap]) break;
        if (off(b) > 0.4 * kGaps_s[gap]) continue;
        if (best != a && off(b) >= off(best)) break;
        best = b;
      }
      if (best != a) pairs[a].by_gap[gap].push_back(best);
    }
  }

  add_revisits(frames, anchors, outlines, cameras, pairs);
  return pairs;
}

}  // namespace plumbline::check
