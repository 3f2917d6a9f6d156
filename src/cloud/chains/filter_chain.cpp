// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/filters/filter_chain.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>

#include "filters/filter_tools.hpp"
#include "plumbline/cloud/columns.hpp"
#include "plumbline/cloud/filters/filter_plugin.hpp"

namespace plumbline::cloud {
namespace {

using core::ConfigNode;
using core::ConfigProblems;

constexpr const char* kNoRange =
    "there is no filter 'range' any more; depth has its limits, in metres, by "
    "{type: pass_through, field: z, min: 0.3, max: 4}";
constexpr const char* kNameCharacters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.";

/// Reports keys of `map` that are not in `known`.
void refuse_unknown_keys(const ConfigNode& map, const std::string& path,
                         const std::vector<std::string>& known, ConfigProblems& problems) {
  for (std::size_t i = 0; i < map.entries.size(); ++i) {
    const std::string& key = map.entries[i].first;
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    problems.push_back({map.key_marks[i], path.empty() ? key : fmt::format("{}.{}", path, key),
                        "unknown key" + core::hint(key, known)});
  }
}

std::filesystem::path normal(const std::string& file) {
  return std::filesystem::path(file).lexically_normal();
}

std::string entry_yaml(const std::string& type, const core::OptionTable& table) {
  std::string text = fmt::format("  - type: {}\n", type);
  for (const auto& option : table.specs())
    text += fmt::format("    {}: {}\n", option.key, table.value(option.key));
  return text;
}

const FilterInfo* find_type(const ConfigNode& entry, const std::string& path, const FilterRegistry& registry,
                            ConfigProblems& problems) {
  if (entry.kind != ConfigNode::Kind::kMap) {
    problems.push_back({entry.mark, path, "is not a filter (a map that begins with type: NAME)"});
    return nullptr;
  }

  // Every filter names its type
  const ConfigNode* type = entry.find("type");
  if (type == nullptr) {
    problems.push_back({entry.mark, path, "has no type" + core::hint("", registry.types())});
    return nullptr;
  }

  // The type must be registered
  const FilterInfo* info = registry.find(type->scalar);
  if (info == nullptr || type->kind != ConfigNode::Kind::kScalar) {
    problems.push_back({type->mark, path + ".type",
                        type->scalar == "range"
                            ? kNoRange
                            : fmt::format("'{}' is not a filter{}", type->scalar.substr(0, 40),
                                          missing_filter_hint(type->scalar, registry))});
    return nullptr;
  }

  return info;
}

}  // namespace

FilterChain FilterChain::parse(const ConfigNode& node, const std::string& path,
                               const FilterRegistry& registry, ConfigProblems& problems) {
  FilterChain chain;
  if (node.kind != ConfigNode::Kind::kMap) {
    problems.push_back({node.mark, path, "is not a filter chain (a map with the keys chain and filters)"});
    return chain;
  }

  refuse_unknown_keys(node, path, {"chain", "description", "filters"}, problems);
  const std::string prefix = path.empty() ? "" : path + ".";

  // The name, of permitted characters only
  const ConfigNode* name = node.find("chain");
  if (name == nullptr || name->kind != ConfigNode::Kind::kScalar || name->scalar.empty()) {
    problems.push_back(
        {name == nullptr ? node.mark : name->mark, prefix + "chain", "the chain needs a name"});
  } else if (name->scalar.find_first_not_of(kNameCharacters) != std::string::npos) {
    problems.push_back({name->mark, prefix + "chain", "a name is made of letters, digits, '_', '-' and '.'"});
  } else {
    chain.name_ = name->scalar;
  }

  // The filters, in the order in which they run
  const ConfigNode* filters = node.find("filters");
  if (filters == nullptr || filters->kind != ConfigNode::Kind::kSequence) {
    problems.push_back(
        {filters == nullptr ? node.mark : filters->mark, prefix + "filters", "must be a list of filters"});
    return chain;
  }

  chain.filters_ = parse_list(*filters, path, registry, problems).filters_;
  return chain;
}

FilterChain FilterChain::parse_list(const ConfigNode& list, const std::string& path,
                                    const FilterRegistry& registry, ConfigProblems& problems) {
  FilterChain chain;
  chain.name_ = path.substr(path.rfind('.') + 1);

  std::vector<std::filesystem::path> written;
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const ConfigNode& entry = list.items[i];
    const std::string place = fmt::format("{}{}filters[{}]", path, path.empty() ? "" : ".", i);
    const FilterInfo* info = find_type(entry, place, registry, problems);
    if (info == nullptr) continue;

    // Options from the entry, with all of their problems
    const std::shared_ptr<Filter> filter = info->make();
    core::OptionTable table;
    filter->declare(table);
    const std::size_t before = problems.size();
    table.set_all(entry, place, problems, {"type"});

    // Options may be valid alone but not together
    if (problems.size() == before) {
      const std::string wrong = filter->check();
      if (!wrong.empty()) problems.push_back({entry.mark, place, wrong});
    }

    chain.filters_.push_back({info->type, filter, entry_yaml(info->type, table)});

    // Two filters must not write the same file
    if (const std::string file = filter->writes(); !file.empty()) {
      const bool taken = std::find(written.begin(), written.end(), normal(file)) != written.end();
      if (taken) problems.push_back({entry.mark, place, file + " is written by an earlier filter already"});
      written.push_back(normal(file));
    }
  }

  return chain;
}

core::Result<FilterChain> FilterChain::load(const std::filesystem::path& file,
                                            const FilterRegistry& registry) {
  const auto node = core::read_yaml(file);
  if (!node) return tl::unexpected<core::Error>(node.error());

  // All problems of the file in one error
  ConfigProblems problems;
  FilterChain chain = parse(*node, "", registry, problems);
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  return chain;
}

std::string FilterChain::to_yaml() const {
  std::string text = fmt::format("chain: {}\nfilters:{}\n", name_, filters_.empty() ? " []" : "");
  for (const auto& step : filters_) text += step.yaml;
  return text;
}

core::Error FilterChain::at(std::size_t step, const core::Error& error) const {
  return {error.kind,
          fmt::format("chain {}: filters[{}] ({}): {}", name_, step, filters_[step].type, error.message)};
}

core::Result<void> FilterChain::ready(const FilterContext& context) const {
  // The error names the filter's place in the chain
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    if (auto fit = filters_[i].filter->ready(context); !fit) {
      return tl::unexpected<core::Error>(at(i, fit.error()));
    }
  }
  return {};
}

core::Result<double> FilterChain::reach_m() const {
  // Each filter widens the border that tiles need
  double sum = 0.0;
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    const auto reach = filters_[i].filter->reach_m();
    if (!reach) {
      return tl::unexpected<core::Error>(
          at(i, {core::ErrorKind::kUsage,
                 "needs the whole cloud, not tiles; leave --tiles out, or run it by itself"}));
    }
    sum += *reach;
  }
  return sum;
}

std::vector<std::string> FilterChain::writes() const {
  std::vector<std::string> files;
  for (const Step& step : filters_) {
    if (std::string file = step.filter->writes(); !file.empty()) files.push_back(std::move(file));
  }
  return files;
}

std::vector<std::string> FilterChain::types() const {
  std::vector<std::string> types;
  types.reserve(filters_.size());
  for (const Step& step : filters_) types.push_back(step.type);
  return types;
}

core::Result<FusedCloud> FilterChain::run(CloudConstPtr input, CloudColumns columns, FilterContext context,
                                          std::vector<FilterReport>* reports,
                                          const ChainProgress& progress) const {
  if (auto fit = ready(context); !fit) return tl::unexpected<core::Error>(fit.error());
  CloudConstPtr current = std::move(input);
  CloudPtr output;

  std::size_t points = count_finite(*current);
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    const Step& step = filters_[i];
    if (progress) progress(i, filters_.size(), step.type);
    output.reset();  // `current` alone holds the input

    // The filter sees the columns of its input
    CloudColumns made;
    context.columns = &columns;
    context.made_columns = &made;
    const auto start = std::chrono::steady_clock::now();
    auto result = step.filter->apply(current, context);
    const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - start;
    if (!result) return tl::unexpected<core::Error>(at(i, result.error()));

    // Columns that the filter did not make follow its points
    output = std::move(*result);
    if (made.empty()) made = carry_columns(*current, columns, *output);
    std::swap(columns, made);
    current = output;

    // Remaining points and time, for the report
    const std::size_t left = count_finite(*current);
    if (reports != nullptr) reports->push_back({step.type, points, left, elapsed.count()});
    points = left;
  }

  if (progress) progress(filters_.size(), filters_.size(), "");
  if (output == nullptr) output = std::make_shared<Cloud>(*current);  // an empty chain
  return FusedCloud{std::move(output), std::move(columns)};
}

core::Result<CloudPtr> FilterChain::apply(CloudConstPtr input, const FilterContext& context,
                                          std::vector<FilterReport>* reports,
                                          const ChainProgress& progress) const {
  // Columns only if the caller also takes them back
  const bool columned = context.columns != nullptr && context.made_columns != nullptr;
  auto filtered =
      run(std::move(input), columned ? *context.columns : CloudColumns(), context, reports, progress);
  if (!filtered) return tl::unexpected<core::Error>(filtered.error());
  if (columned) *context.made_columns = std::move(filtered->columns);
  return std::move(filtered->cloud);
}

std::string to_table(const std::vector<FilterReport>& reports) {
  std::string text = fmt::format("{:<24}{:>12}{:>12}{:>10}\n", "filter", "points in", "points out", "ms");
  for (const auto& r : reports) {
    text += fmt::format("{:<24}{:>12}{:>12}{:>10.1f}\n", r.type, r.points_in, r.points_out, r.ms);
  }
  return text;
}

core::Result<FusedCloud> FilterChain::apply(FusedCloud fused, double spacing_m,
                                            const core::Executor& executor,
                                            std::vector<FilterReport>* reports) const {
  if (filters_.empty()) return fused;
  FilterContext context;
  context.executor = &executor;
  context.spacing_m = spacing_m;
  return run(std::move(fused.cloud), std::move(fused.columns), context, reports, {});
}

}  // namespace plumbline::cloud
