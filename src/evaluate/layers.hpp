// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One layer or two, from heights over a plane.
#include <vector>

namespace plumbline::evaluate {

struct Layers {
  bool two = false;
  double spread = 0.0;                     ///< RMS within the layer(s)
  double separation = 0.0;                 ///< between the means of two layers, 0 for one
  double border = 0.0;                     ///< lowest height of the upper of two layers
  [[nodiscard]] double thickness() const;  ///< sqrt(spread^2 + separation^2)
};

/// Splits the heights where the variance within both parts is least (1-D two-means, exact). They are two
/// layers if their means are at least four times the spread of either apart and each holds a tenth of the
/// heights, at least two. `heights` comes back sorted.
Layers split_layers(std::vector<double>& heights);

}  // namespace plumbline::evaluate
