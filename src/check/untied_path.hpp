// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The length of a path that nothing seen twice ties to the rest of it.
#include <vector>

#include "plumbline/check/self_check.hpp"

namespace plumbline::check {

/// Two frames that see the same surface, at least several seconds apart or on two paths.
struct Tie {
  std::size_t first_way = 0;
  double first_s = 0.0;
  std::size_t second_way = 0;
  double second_s = 0.0;
};

/// Length, metres, of what lies between no two tied places of its path. Ties to one other path hold what is
/// between them.
double untied_length(const std::vector<Way>& ways, const std::vector<Tie>& ties);

}  // namespace plumbline::check
