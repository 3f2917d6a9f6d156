// SPDX-License-Identifier: BSD-3-Clause
#include "live/stamp_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "layout.hpp"

namespace plumbline::dataset {
namespace {

constexpr std::size_t kMostAlone = 64;  // images of one kind that wait for the other
constexpr std::int64_t kMicrosecond_ns = 1000;

}  // namespace

StampPairs::StampPairs(double max_gap_s, double depth_delay_s)
    : reach_us_(std::llround(max_gap_s * 1e6)),
      delay_s_(depth_delay_s),
      delay_ns_(std::llround(depth_delay_s * 1e9)) {}

void StampPairs::add(List& list, Stamped image) {
  const auto later = [](std::int64_t stamp, const Stamped& other) { return stamp < other.stamp_ns; };
  list.insert(std::upper_bound(list.begin(), list.end(), image.stamp_ns, later), std::move(image));
  if (list.size() <= kMostAlone) return;
  list.pop_front();
  ++unpaired_;
}

long long StampPairs::gap(const Stamped& color, const Stamped& depth) const {
  return stamp_gap_us(seconds_of(color.stamp_ns), seconds_of(depth.stamp_ns), delay_s_);
}

std::optional<std::size_t> StampPairs::nearest_depth(std::size_t color) const {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < depth_.size(); ++i) {
    if (!best || gap(color_[color], depth_[i]) < gap(color_[color], depth_[*best])) best = i;
  }
  return best && gap(color_[color], depth_[*best]) <= reach_us_ ? best : std::nullopt;
}

std::optional<std::size_t> StampPairs::nearest_color(std::size_t depth) const {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < color_.size(); ++i) {
    if (!best || gap(color_[i], depth_[depth]) < gap(color_[*best], depth_[depth])) best = i;
  }
  return best;
}

std::optional<StampPairs::Pair> StampPairs::next(bool final) {
  while (!color_.empty()) {
    const std::int64_t when = color_.front().stamp_ns - delay_ns_;
    const auto depth = nearest_depth(0);
    const bool same_moment = depth && gap(color_.front(), depth_[*depth]) == 0;
    const bool depth_certain = final || same_moment || (!depth_.empty() && depth_.back().stamp_ns >= when);

    // Nearer depth may still arrive
    if (!depth_certain) return std::nullopt;
    if (!depth) {
      // No depth near it has arrived, and none can
      if (!final && depth_.back().stamp_ns < when + reach_us_ * kMicrosecond_ns) return std::nullopt;
      color_.pop_front();
      ++unpaired_;
      continue;
    }

    // Depth after colour may belong to the next colour, which must arrive first
    const std::int64_t depth_when = depth_[*depth].stamp_ns + delay_ns_;
    const bool color_certain = final || same_moment || color_.back().stamp_ns >= depth_when;
    if (!color_certain) return std::nullopt;
    if (nearest_color(*depth) != std::optional<std::size_t>(0)) {
      color_.pop_front();
      ++unpaired_;
      continue;
    }

    Pair pair{std::move(color_.front()), std::move(depth_[*depth])};
    color_.pop_front();
    unpaired_ += *depth;
    depth_.erase(depth_.begin(), depth_.begin() + static_cast<std::ptrdiff_t>(*depth) + 1);
    return pair;
  }
  return std::nullopt;
}

}  // namespace plumbline::dataset
