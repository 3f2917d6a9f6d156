// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <initializer_list>

#include "plumbline/diagnose/signs.hpp"

namespace plumbline::diagnose {

/// Sets strength, the least of `evidence` (each in terms of what is needed), and certainty; true unless that
/// is kNone.
inline bool grade(Sign& sign, std::initializer_list<double> evidence) {
  constexpr double kLikely = 0.8;
  sign.strength = std::max(0.0, std::min(evidence));
  sign.certainty = sign.strength >= 1.0       ? Certainty::kCertain
                   : sign.strength >= kLikely ? Certainty::kLikely
                                              : Certainty::kNone;
  return sign.certainty != Certainty::kNone;
}

}  // namespace plumbline::diagnose
