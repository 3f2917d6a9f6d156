// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// "--set key=value" of the benchmarks: the options of the pipeline's track stage.
#include <algorithm>
#include <string>
#include <vector>

#include "plumbline/core/config.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/mapping/slam.hpp"

namespace plumbline::benchmarks {

/// The defaults with every "key=value" of `texts`; all problems are told together.
inline core::Result<mapping::SlamOptions> slam_options(const std::vector<std::string>& texts) {
  mapping::SlamOptions options;
  core::OptionTable table;
  options.declare(table);
  core::ConfigProblems problems;
  for (const std::string& text : texts) {
    const std::size_t equals = std::min(text.find('='), text.size());
    const auto value = core::parse_yaml(equals < text.size() ? text.substr(equals + 1) : "", text);
    if (!value) return tl::unexpected<core::Error>(value.error());
    table.set(text.substr(0, equals), *value, "--set " + text, problems);
  }
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return options;
}

}  // namespace plumbline::benchmarks
