// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The verdict on a result: `verdict` in summary.json, and `trustworthy` and `reason`, which follow from it.
// Nothing else writes them, but for the empty sections that a run begins with. Whether a path is right is
// judged by check/verdict.cpp; exit code 4 is given by the command (cli/app.cpp).
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

/// Writes all three from the stages' doubts and the sections `check`, `frames`, `components` and `unchecked`.
void set_verdict(std::vector<Doubt> doubts, nlohmann::ordered_json& summary);

/// Adds what came to light after the run; empty: nothing.
void add_to_verdict(const std::string& doubt, nlohmann::ordered_json& summary);

/// Why the result must not be trusted; empty: it may be.
std::string reason_of(const nlohmann::ordered_json& summary);

/// "Shape ± 8 mm (95 %: 15 mm), lengths 0.4 %; scale unchecked." or "Not trustworthy: ...". Empty: a summary
/// without a verdict.
std::string sentence_of(const nlohmann::ordered_json& summary);

}  // namespace plumbline::pipeline
