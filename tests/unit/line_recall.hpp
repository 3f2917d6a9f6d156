// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// How well descriptors find the same polygon edge in two views: recall at a demanded precision.
#include <algorithm>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "line_world.hpp"
#include "plumbline/features/lbd.hpp"
#include "plumbline/features/line_detector.hpp"

namespace plumbline::features::world {

struct ViewPair {
  std::string name;
  double angle;  // rad
  double scale;
  double perspective;
  double gain;
  double offset;  // grey levels
  double noise;   // grey levels
};

inline std::vector<ViewPair> view_pairs() {
  return {{"small motion", 0.02, 1.0, 0.0, 1.0, 0.0, 3.0},    {"brightness", 0.02, 1.0, 0.0, 0.6, 30.0, 3.0},
          {"rotation 20 deg", 0.35, 1.0, 0.0, 1.0, 0.0, 3.0}, {"scale 1.2", 0.05, 1.2, 0.0, 1.0, 0.0, 3.0},
          {"scale 0.8", 0.05, 0.8, 0.0, 1.0, 0.0, 3.0},       {"perspective", 0.1, 1.0, 0.25, 1.0, 0.0, 3.0},
          {"all, noisy", 0.2, 1.15, 0.15, 0.7, 20.0, 8.0}};
}

using Describe = std::function<std::vector<LineDescriptor>(const cv::Mat&, const std::vector<LineSegment>&)>;

/// One view: its picture, the lines found in it and the polygon edge that each lies on.
struct View {
  cv::Mat image;
  std::vector<LineSegment> lines;
  std::vector<int> edges;
};

/// Lines that lie on no single edge (across a T-junction, say) have no known truth and are left out.
inline View make_view(const std::vector<Polygon>& polygons, double gain, double offset, double noise,
                      std::uint32_t seed) {
  View view;
  view.image = disturb(render(640, 480, 110.0, polygons), noise, gain, offset, seed);
  for (const LineSegment& l : LineDetector().detect(view.image)) {
    const int edge = edge_of(l, polygons, 1.5);
    if (edge < 0) continue;
    view.lines.push_back(l);
    view.edges.push_back(edge);
  }
  return view;
}

/// The same world seen twice.
inline std::pair<View, View> make_views(const ViewPair& pair, std::uint32_t seed) {
  const std::vector<Polygon> polygons = clutter(70, 640, 480, seed);
  const std::vector<Polygon> moved =
      warp(view_change(640, 480, pair.angle, pair.scale, pair.perspective), polygons);
  return {make_view(polygons, 1.0, 0.0, pair.noise, seed + 100),
          make_view(moved, pair.gain, pair.offset, pair.noise, seed + 200)};
}

/// Mutual nearest neighbours by Hamming distance alone, most certain first: largest recall (of the edges seen
/// in both views) at a precision of at least `precision`.
class RecallMeter {
 public:
  void add(const View& a, const View& b, const Describe& describe) {
    const std::vector<LineDescriptor> da = describe(a.image, a.lines);
    const std::vector<LineDescriptor> db = describe(b.image, b.lines);
    const std::set<int> in_b(b.edges.begin(), b.edges.end());
    for (int e : a.edges) possible_ += in_b.count(e) > 0 ? 1 : 0;
    const auto nearest = [](const LineDescriptor& d, const std::vector<LineDescriptor>& others) {
      std::pair<int, std::size_t> best{257, 0};
      for (std::size_t j = 0; j < others.size(); ++j) best = std::min(best, {hamming(d, others[j]), j});
      return best;
    };
    for (std::size_t i = 0; i < da.size() && !db.empty(); ++i) {
      const auto [distance, j] = nearest(da[i], db);
      if (nearest(db[j], da).second != i) continue;
      matches_.emplace_back(distance, a.edges[i] != b.edges[j]);
    }
  }

  [[nodiscard]] double recall(double precision) const {
    std::vector<std::pair<int, bool>> sorted = matches_;
    std::sort(sorted.begin(), sorted.end());
    int right = 0;
    int best = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      right += sorted[i].second ? 0 : 1;
      const bool last = i + 1 == sorted.size() || sorted[i + 1].first != sorted[i].first;
      if (last && right >= precision * static_cast<double>(i + 1)) best = right;
    }
    return possible_ > 0 ? static_cast<double>(best) / possible_ : 0.0;
  }

  /// Share of right ones among all mutual matches.
  [[nodiscard]] double precision() const {
    const auto wrong =
        std::count_if(matches_.begin(), matches_.end(), [](const auto& m) { return m.second; });
    return matches_.empty() ? 0.0 : 1.0 - static_cast<double>(wrong) / static_cast<double>(matches_.size());
  }
  [[nodiscard]] int possible() const { return possible_; }

 private:
  std::vector<std::pair<int, bool>> matches_;  // distance, wrong
  int possible_ = 0;
};

}  // namespace plumbline::features::world
