// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Mistakes made with a recording, in summary.json and among the doubts.
#include <string>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/diagnose/signs.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

/// Adds the signs of a recording to those of others, and warns of the ones that are likely. `robot`: its
/// name, "" if there is one recording only.
void add_signs(const std::string& robot, std::vector<diagnose::Sign> found, core::Log& log,
               std::vector<diagnose::Sign>& all);
/// Section `signs` of summary.json: those that were tested.
void report_signs(const std::vector<diagnose::Sign>& signs, Json& summary);
/// Signs that are certain end trust.
void doubt_signs(const std::vector<diagnose::Sign>& signs, std::vector<Doubt>& reasons);

}  // namespace plumbline::pipeline
