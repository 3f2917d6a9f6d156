// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "bindings.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::python {

using OptionValues =
    std::map<std::string, std::string>;  ///< by key, values as a pipeline file would have them

/// Sets declared options. Throws Failure (kUsage) with all problems at once.
template <typename Options>
void set_options(Options& options, const OptionValues& values, const std::string& what) {
  core::OptionTable table;
  options.declare(table);
  core::ConfigNode map;
  map.kind = core::ConfigNode::Kind::kMap;
  for (const auto& [key, text] : values) {
    map.entries.emplace_back(key, value_of(core::parse_yaml(text, what)));
    map.key_marks.emplace_back();
  }
  core::ConfigProblems problems;
  table.set_all(map, what, problems);
  if (!problems.empty()) throw Failure(core::to_error(problems));
}

}  // namespace plumbline::python
