// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The option `filters`: a filter chain's file, or the list of filters itself.
#include <string>
#include <vector>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

class ChainOption {
 public:
  /// `file`: used unless the pipeline says otherwise; empty: no filters.
  explicit ChainOption(const std::string& file);

  void declare(core::OptionTable& table, const std::string& help) {
    table.text_or_list("filters", value_, "filters", help, core::EmptyValue::kAllowed);
  }
  /// Reads the chain; its problems are reported among those of the pipeline, each in the file it stands in;
  /// so are files that its filters need and do not find. From then on the option's value is the list with
  /// every option spelt out.
  void check(const CheckContext& context, const std::string& path, core::ConfigProblems& problems);
  [[nodiscard]] const cloud::FilterChain& chain() const { return chain_; }
  /// Files that the filters write, absolute.
  [[nodiscard]] std::vector<std::string> files() const;

 private:
  core::ConfigNode value_;
  cloud::FilterChain chain_;
};

/// Adds what filters took from the merged cloud to the section `cloud`.
void report_left_out_of_map(const std::vector<cloud::FilterReport>& reports, nlohmann::ordered_json& cloud);

}  // namespace plumbline::pipeline
