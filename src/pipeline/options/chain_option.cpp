// SPDX-License-Identifier: BSD-3-Clause
#include "options/chain_option.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/graph_parts.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

using core::ConfigNode;
using Kind = ConfigNode::Kind;

ChainOption::ChainOption(const std::string& file) {
  value_.kind = file.empty() ? Kind::kSequence : Kind::kScalar;
  value_.scalar = file;
}

void ChainOption::check(const CheckContext& context, const std::string& path,
                        core::ConfigProblems& problems) {
  const std::size_t before = problems.size();
  if (value_.kind == Kind::kSequence) {
    chain_ = cloud::FilterChain::parse_list(value_, path, *context.filters, problems);
  } else if (!value_.scalar.empty()) {
    const std::filesystem::path file = context.find(value_.scalar, value_.mark);

    if (file.empty()) {
      problems.push_back({value_.mark, path + ".filters",
                          fmt::format("{}: no such file {} or among the shipped ones", value_.scalar,
                                      value_.mark.file == kCommandLineFile ? "here, beside the pipeline"
                                                                           : "beside the pipeline")});
      return;
    }

    const auto tree = core::read_yaml(file, problems);
    if (tree) chain_ = cloud::FilterChain::parse(*tree, "", *context.filters, problems);
  }
  if (problems.size() != before) return;

  if (auto fit = chain_.ready(); !fit)
    problems.push_back({value_.mark, path + ".filters", fit.error().message});

  // With all options spelt out, config.yaml repeats the run without the file of the filters.
  const core::ConfigMark mark = value_.mark;
  auto spelt_out = core::parse_yaml(chain_.to_yaml(), "");
  const ConfigNode* list = spelt_out ? spelt_out->find("filters") : nullptr;
  if (list != nullptr) value_ = *list;
  value_.mark = mark;
}

std::vector<std::string> ChainOption::files() const {
  std::vector<std::string> files;
  for (const std::string& file : chain_.writes()) files.push_back(std::filesystem::absolute(file).string());
  return files;
}

void report_left_out_of_map(const std::vector<cloud::FilterReport>& reports, Json& cloud) {
  for (const cloud::FilterReport& report : reports) {
    const std::size_t points = report.points_in - std::min(report.points_in, report.points_out);
    cloud["left_out_of_map"].push_back({{"by", report.type}, {"points", points}});
  }
}

}  // namespace plumbline::pipeline
