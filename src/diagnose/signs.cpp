// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/diagnose/signs.hpp"

#include <utility>

namespace plumbline::diagnose {

std::string to_string(Certainty certainty) {
  switch (certainty) {
    case Certainty::kNone:
      return "none";
    case Certainty::kLikely:
      return "likely";
    case Certainty::kCertain:
      return "certain";
  }
  return "none";
}

std::vector<Sign> signs_of(const Samples& samples) {
  std::vector<Sign> all = depth_kind_signs(samples);
  all.push_back(registration_sign(samples));
  all.push_back(fixed_pattern_sign(samples));
  for (Sign& sign : lag_signs(samples)) all.push_back(std::move(sign));
  return all;
}

std::string sentence(const Sign& sign) {
  const bool typed = sign.remedy.rfind("--", 0) == 0;
  return sign.text + (typed ? ". Type: " : ". To do: ") + sign.remedy;
}

}  // namespace plumbline::diagnose
