// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pairing by stamp for images that arrive one after another.
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "live/live_survey.hpp"

namespace plumbline::dataset {

/// Pairs images that are nearest to each other, once no later image of either topic could be nearer. Among
/// the images of these pairs, pair_by_stamp therefore finds the same pairs.
class StampPairs {
 public:
  struct Stamped {
    std::int64_t stamp_ns = 0;
    std::int64_t received_ns = 0;
    SharedBytes bytes;
  };
  struct Pair {
    Stamped color;
    Stamped depth;
  };

  StampPairs(double max_gap_s, double depth_delay_s);
  void add_color(Stamped image) { add(color_, std::move(image)); }
  void add_depth(Stamped image) { add(depth_, std::move(image)); }
  /// The next pair by time; none if it is not certain yet. `final`: no more images will arrive.
  std::optional<Pair> next(bool final);
  /// Number of images without a partner.
  [[nodiscard]] std::size_t unpaired() const { return unpaired_; }

 private:
  using List = std::deque<Stamped>;
  void add(List& list, Stamped image);
  /// Gap of the two stamps in microseconds (stamp_gap_us).
  [[nodiscard]] long long gap(const Stamped& color, const Stamped& depth) const;
  [[nodiscard]] std::optional<std::size_t> nearest_depth(std::size_t color) const;
  [[nodiscard]] std::optional<std::size_t> nearest_color(std::size_t depth) const;

  std::int64_t reach_us_;
  double delay_s_;
  std::int64_t delay_ns_;
  List color_;  ///< by stamp
  List depth_;
  std::size_t unpaired_ = 0;
};

}  // namespace plumbline::dataset
