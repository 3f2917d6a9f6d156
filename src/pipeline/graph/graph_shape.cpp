// SPDX-License-Identifier: BSD-3-Clause
// The graph as a whole: order, cycles, sources, stages that no other one reads from.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "graph/graph_parts.hpp"

namespace plumbline::pipeline {
namespace {

using core::ConfigProblems;

void report_cycle(const StageSpecs& specs, const std::vector<bool>& placed, ConfigProblems& problems) {
  // Every stage that is left reads from one that is left: walking back must come round.
  std::size_t at = static_cast<std::size_t>(std::find(placed.begin(), placed.end(), false) - placed.begin());
  std::vector<std::size_t> walk;
  while (std::find(walk.begin(), walk.end(), at) == walk.end()) {
    walk.push_back(at);
    const auto& from = specs[at].reads_from;
    at = *std::find_if(from.begin(), from.end(), [&](std::size_t f) { return !placed[f]; });
  }
  walk.erase(walk.begin(), std::find(walk.begin(), walk.end(), at));
  std::rotate(walk.begin(), std::min_element(walk.begin(), walk.end()), walk.end());
  std::vector<std::string> names;
  for (const std::size_t w : walk) names.push_back(specs[w].node.name);
  names.push_back(names.front());
  problems.push_back(
      {specs[walk.front()].mark, specs[walk.front()].path,
       fmt::format("the stages read from each other in a circle ({})", fmt::join(names, " <- "))});
}

/// Kahn's algorithm; of the stages that could be next, the first in the file.
std::vector<std::size_t> sorted(const StageSpecs& specs, ConfigProblems& problems) {
  std::vector<std::size_t> order;
  std::vector<bool> placed(specs.size(), false);
  while (order.size() < specs.size()) {
    std::size_t next = 0;
    for (; next < specs.size(); ++next) {
      const auto& from = specs[next].reads_from;
      if (!placed[next] && std::all_of(from.begin(), from.end(), [&](std::size_t f) { return placed[f]; }))
        break;
    }

    if (next == specs.size()) {
      report_cycle(specs, placed, problems);
      break;
    }

    placed[next] = true;
    order.push_back(next);
  }

  // Taps come last, so that their writing counts as export and delays no stage.
  std::stable_partition(order.begin(), order.end(), [&](std::size_t d) { return !specs[d].node.tap; });
  return order;
}

void check_sources(const StageSpecs& specs, ConfigProblems& problems) {
  std::vector<std::size_t> sources;
  bool all_known = true;
  for (std::size_t d = 0; d < specs.size(); ++d) {
    all_known = all_known && specs[d].node.type != nullptr;
    if (specs[d].node.type != nullptr && specs[d].node.type->is_source()) sources.push_back(d);
  }
  if (sources.empty() && all_known && !specs.empty()) {
    problems.push_back({specs.front().mark, "stages", "no stage gives frames; add one of type read"});
  }
  for (std::size_t i = 1; i < sources.size(); ++i) {
    problems.push_back({specs[sources[i]].mark, specs[sources[i]].path,
                        fmt::format("a pipeline has one stage that gives frames; {} is one already",
                                    specs[sources[0]].node.name)});
  }
}

void check_uses(const StageSpecs& specs, ConfigProblems& problems) {
  // One wrong word leaves the stage that was meant without reader; the word alone is reported.
  const auto unclear = [](const StageSpec& spec) { return spec.dangling || spec.node.type == nullptr; };
  if (std::any_of(specs.begin(), specs.end(), unclear)) return;
  std::set<std::size_t> used;
  for (const StageSpec& spec : specs) used.insert(spec.reads_from.begin(), spec.reads_from.end());
  for (std::size_t d = 0; d < specs.size(); ++d) {
    const StageTypePtr& type = specs[d].node.type;
    if (type == nullptr || type->outputs.empty() || used.count(d) != 0) continue;
    problems.push_back(
        {specs[d].mark, specs[d].path, "nothing reads from this stage; connect it or remove it"});
  }
}

}  // namespace

std::vector<std::size_t> checked_order(const StageSpecs& specs, ConfigProblems& problems) {
  std::vector<std::size_t> order = sorted(specs, problems);
  check_uses(specs, problems);
  check_sources(specs, problems);
  return order;
}

}  // namespace plumbline::pipeline
