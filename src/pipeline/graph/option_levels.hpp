// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which options of stages are shown to whom.
#include <string>
#include <utility>
#include <vector>

namespace plumbline::pipeline {

enum class OptionLevel {
  kBasic,     ///< shown by `plumbline pipelines describe`
  kAdvanced,  ///< shown with --all
  kInternal,  ///< taken from files and --set, and listed nowhere
};

OptionLevel option_level(const std::string& stage, const std::string& key);

/// Stage and key of every option that is not basic: each must be there.
std::vector<std::pair<std::string, std::string>> levelled_options();

}  // namespace plumbline::pipeline
