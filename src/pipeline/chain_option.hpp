// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// An option that names a filter chain's file.
#include <string>

#include "plumbline/cloud/filter_chain.hpp"
#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

class ChainOption {
 public:
  explicit ChainOption(std::string file) : file_(std::move(file)) {}

  void declare(core::OptionTable& table, const std::string& help) { table.text("filters", file_, help); }
  /// Loads the chain; its problems are told among those of the pipeline.
  void check(const CheckContext& context, const core::ConfigMark& mark, const std::string& path,
             core::ConfigProblems& problems);
  [[nodiscard]] const cloud::FilterChain& chain() const { return chain_; }

 private:
  std::string file_;
  cloud::FilterChain chain_;
};

}  // namespace plumbline::pipeline
