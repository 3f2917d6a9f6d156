// SPDX-License-Identifier: BSD-3-Clause
#include "untied_path.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace plumbline::check {
namespace {

using Span = std::pair<double, double>;

/// Spans of time of one path whose ends are tied.
std::vector<Span> tied_spans(std::size_t way, const std::vector<Tie>& ties) {
  std::vector<Span> spans;
  std::map<std::size_t, Span> met;  // by the other path
  for (const Tie& tie : ties) {
    if (tie.first_way != way && tie.second_way != way) continue;
    if (tie.first_way == tie.second_way) {
      spans.push_back(std::minmax(tie.first_s, tie.second_s));
      continue;
    }

    // All meetings with another path make one span.
    const auto [other, own_s] = tie.first_way == way ? std::pair(tie.second_way, tie.first_s)
                                                     : std::pair(tie.first_way, tie.second_s);
    Span& span = met.try_emplace(other, own_s, own_s).first->second;
    span = {std::min(span.first, own_s), std::max(span.second, own_s)};
  }
  for (const auto& [other, span] : met) spans.push_back(span);
  return spans;
}

}  // namespace

double untied_length(const std::vector<Way>& ways, const std::vector<Tie>& ties) {
  double length = 0.0;
  for (std::size_t w = 0; w < ways.size(); ++w) {
    const std::vector<Span> spans = tied_spans(w, ties);
    const geometry::Trajectory& path = ways[w].path;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const double middle = 0.5 * (path[i - 1].stamp + path[i].stamp);
      const bool tied = std::any_of(spans.begin(), spans.end(), [&](const Span& span) {
        return span.first < middle && middle < span.second;
      });
      if (!tied)
        length += (path[i].world_from_camera.translation - path[i - 1].world_from_camera.translation).norm();
    }
  }
  return length;
}

}  // namespace plumbline::check
