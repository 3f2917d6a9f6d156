// SPDX-License-Identifier: BSD-3-Clause
#include "summary/signs.hpp"

#include <iterator>
#include <utility>

namespace plumbline::pipeline {

void add_signs(const std::string& robot, std::vector<diagnose::Sign> found, core::Log& log,
               std::vector<diagnose::Sign>& all) {
  for (diagnose::Sign& sign : found) {
    if (sign.certainty == diagnose::Certainty::kNone) continue;
    if (!robot.empty()) sign.text = robot + ": " + sign.text;
    if (sign.certainty == diagnose::Certainty::kLikely) log.warning("perhaps " + diagnose::sentence(sign));
  }
  all.insert(all.end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
}

void report_signs(const std::vector<diagnose::Sign>& signs, Json& summary) {
  for (const diagnose::Sign& sign : signs) {
    summary["signs"].push_back({{"name", sign.name},
                                {"certainty", diagnose::to_string(sign.certainty)},
                                {"size", rounded(sign.size)},
                                {"unit", sign.unit},
                                {"strength", rounded(sign.strength)},
                                {"text", sign.text},
                                {"remedy", sign.remedy}});
  }
}

void doubt_signs(const std::vector<diagnose::Sign>& signs, std::vector<Doubt>& reasons) {
  for (const diagnose::Sign& sign : signs) {
    if (sign.certainty == diagnose::Certainty::kCertain)
      reasons.push_back({Doubt::About::kRecording, diagnose::sentence(sign)});
  }
}

}  // namespace plumbline::pipeline
