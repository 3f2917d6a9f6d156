// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Compares the keyframes' small pictures of two aligned maps: does one place look the same in both?
// (docs/method/merging.md)
#include <array>
#include <vector>

#include "plumbline/mapping/merging/map_fusion.hpp"

namespace plumbline::mapping {

/// Correlation of grey values, from -1 to 1, of each cell of 0.3 m of surface that keyframes of both maps
/// show from similar places: the mean over pairs of keyframes. Cells without texture are left out.
std::vector<double> picture_correlations(const MapPart& a, const MapPart& b,
                                         const geometry::Rigid3& a_from_b);

/// The distribution of correlations where both maps show the same things, and the odds of such statements as
/// natural logarithms. Four cells count as one, for one thing fills or hides them together.
class PictureOdds {
 public:
  /// As measured in rooms, offices and corridors.
  PictureOdds() = default;
  /// Learnt from two maps as they are aligned, for another alignment of the same two.
  explicit PictureOdds(const std::vector<double>& aligned);

  /// The same things are seen, against others.
  [[nodiscard]] double of_one_place(const std::vector<double>& correlations) const;
  /// The same things are seen, against a place that looks alike but for a quarter of it, as two rooms do with
  /// the same furniture and other pictures on the walls.
  [[nodiscard]] double against_like(const std::vector<double>& correlations) const;

 private:
  static constexpr std::size_t kClasses = 4;
  using Shares = std::array<double, kClasses>;
  static std::size_t class_of(double correlation);
  [[nodiscard]] double odds(const std::vector<double>& correlations, const Shares& other) const;

  Shares same_{0.03, 0.03, 0.09, 0.85};
};

}  // namespace plumbline::mapping
