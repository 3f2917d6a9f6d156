// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "plumbline/cloud/filters/filter.hpp"

namespace plumbline::cloud {
namespace {

constexpr const char* kIntroduction =
    "<!-- Made from the filters' own declarations by plumbline::cloud::filters_reference(); a test compares. "
    "-->\n"
    "# Filters\n\n"
    "A filter chain is a YAML file: a name and a list of filters, applied from top to bottom. Lengths and "
    "angles may\n"
    "carry a unit (`5 mm`, `75 deg`). All problems of a file are reported at once, with line and column.\n\n"
    "```yaml\nchain: keyframe\nfilters:\n  - type: pass_through\n    max: 3.5\n  - type: voxel_grid\n    "
    "leaf: 1 cm\n```\n\n"
    "`plumbline filter CHAIN IN... OUT` runs a chain on files (several inputs are merged), `plumbline "
    "filters list`,\n"
    "`describe NAME` and `check CHAIN` describe and check them; pipelines name chains in the `filters` of "
    "their stages. Every\n"
    "filter has an example chain in `pipelines/filters/examples` that can be run by name: `plumbline filter "
    "examples/mls\n"
    "IN OUT`. In the pictures the cloud before the example's last filter is on the left, after it on the "
    "right.\n"
    "Filters of your own are loaded with `--plugin`; see "
    "[examples/plugin_filter](../../examples/plugin_filter).\n\n"
    "Filters that only choose points keep an organised cloud (one that still has the rows and columns of the "
    "depth\n"
    "picture) organised: rejected points become NaN. The others give a list of points without NaN.\n\n"
    "Further columns of a file besides position, normal, colour and curvature are kept: `confidence`,\n"
    "`observations`, `robot` and columns of other names (`intensity`, `label`; kept as 32 bit floats). "
    "Points that\n"
    "filters choose or move keep theirs; voxel_grid averages; other new points have those of the nearest "
    "point of\n"
    "the filter's input.\n\n"
    "Coordinates with more digits than a 32 bit float has, such as UTM's, are reduced by whole metres "
    "(the `shift` that\n"
    "is printed) and written as doubles with it again; options in metres refer to the coordinates of the "
    "file. Inputs that lie\n"
    "more than 10 km apart are refused, since floats cannot hold both. A chain that\n"
    "leaves no point ends with exit code 4 and names the filter that removed the last one.\n";

// The values that an option accepts, for the table.
std::string allowed(const core::OptionSpec& option) {
  if (!option.choices.empty()) return fmt::format("{}", fmt::join(option.choices, ", "));
  switch (option.type) {
    case core::OptionType::kBoolean:
      return "on, off";
    case core::OptionType::kNumbers:
      return fmt::format("{} numbers, {:g} to {:g}", option.length, option.min, option.max);
    case core::OptionType::kInteger:
    case core::OptionType::kNumber:
      return fmt::format("{:g} to {:g}", option.min, option.max);
    default:
      return "text";
  }
}

// A filter's section: summary, details, example and table of options.
std::string entry(const FilterInfo& info) {
  std::string text = fmt::format(
      "\n## {0}\n\n{1}\n\n![{0}: before and after](pictures/{0}.png)\n\n{2} "
      "([example](../../pipelines/filters/examples/{0}.yaml))\n\n",
      info.type, info.summary, info.details);
  text += fmt::format("```yaml\n{}```\n\n| option | default | allowed | unit | |\n|---|---|---|---|---|\n",
                      info.example);
  const auto filter = info.make();
  core::OptionTable table;
  filter->declare(table);
  for (const auto& option : table.specs()) {
    text += fmt::format("| `{}` | {} | {} | {} | {} |\n", option.key, option.default_value, allowed(option),
                        option.unit, option.help);
  }
  return text;
}

}  // namespace

std::string filters_reference(const FilterRegistry& registry) {
  std::string text = kIntroduction;
  for (const auto& info : registry.filters()) text += entry(info);
  return text;
}

}  // namespace plumbline::cloud
