// SPDX-License-Identifier: BSD-3-Clause
#include "scene/settings.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace plumbline::synth {

core::Result<void> read_settings(const std::string& option, const std::string& text,
                                 const std::vector<Setting>& settings) {
  core::OptionTable table;
  for (const Setting& s : settings) table.number(s.key, *s.value, s.range, s.unit, "");

  // The text becomes a map of keys.
  core::ConfigNode map;
  map.kind = core::ConfigNode::Kind::kMap;
  std::istringstream pieces(text);
  std::string piece;

  // One setting between commas.
  while (std::getline(pieces, piece, ',')) {
    const auto trim = [](const std::string& s) {
      const auto first = s.find_first_not_of(' ');
      return first == std::string::npos ? "" : s.substr(first, s.find_last_not_of(' ') - first + 1);
    };
    const auto equals = piece.find('=');
    const std::string key = trim(piece.substr(0, equals));
    if (key.empty()) continue;

    // A key alone has its usual strength; the table refuses one that has none.
    const auto named =
        std::find_if(settings.begin(), settings.end(), [&](const Setting& s) { return key == s.key; });
    if (equals == std::string::npos && named != settings.end() && !std::isnan(named->strength)) {
      *named->value = named->strength;
      continue;
    }

    core::ConfigNode value;
    value.kind = core::ConfigNode::Kind::kScalar;
    value.scalar = equals == std::string::npos ? "" : trim(piece.substr(equals + 1));
    map.entries.emplace_back(key, value);
    map.key_marks.emplace_back();
  }

  // The table checks keys, units and ranges.
  core::ConfigProblems problems;
  table.set_all(map, option, problems);
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return {};
}

}  // namespace plumbline::synth
