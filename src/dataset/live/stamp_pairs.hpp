// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// pair_by_stamp for images that come one after another.
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "live/live_survey.hpp"

namespace plumbline::dataset {

/// A pair is what is nearest to each other, and certain: no image that is still to come, later than those of
/// its topic that are there, could be nearer to either. So pair_by_stamp finds the same pairs among the
/// images of these pairs, whatever else came.
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
  /// The next pair by time; none: it is not certain yet. `final`: nothing is to come.
  std::optional<Pair> next(bool final);
  /// Images that were left alone.
  [[nodiscard]] std::size_t unpaired() const { return unpaired_; }

 private:
  using List = std::deque<Stamped>;
  void add(List& list, Stamped image);
  /// stamp_gap_us of the two.
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
