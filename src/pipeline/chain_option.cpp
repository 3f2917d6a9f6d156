// SPDX-License-Identifier: BSD-3-Clause
#include "chain_option.hpp"

#include <fmt/format.h>

#include <utility>

namespace plumbline::pipeline {

void ChainOption::check(const CheckContext& context, const core::ConfigMark& mark, const std::string& path,
                        core::ConfigProblems& problems) {
  if (file_.empty()) return;
  const std::filesystem::path file = context.find(file_);
  if (file.empty()) {
    problems.push_back(
        {mark, path + ".filters",
         fmt::format("{}: no such file beside the pipeline or among the shipped ones", file_)});
    return;
  }
  auto chain = cloud::FilterChain::load(file, cloud::builtin_filters());
  if (!chain) {
    problems.push_back({mark, path + ".filters", chain.error().message});
    return;
  }
  chain_ = std::move(*chain);
}

}  // namespace plumbline::pipeline
