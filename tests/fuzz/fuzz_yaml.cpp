// SPDX-License-Identifier: BSD-3-Clause
// The YAML loader, and a filter chain made of what it read.
#include "fuzz_target.hpp"
#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/core/config.hpp"

using namespace plumbline;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const cloud::FilterRegistry registry = cloud::builtin_filters();
  const std::string text(reinterpret_cast<const char*>(data), size);
  const fuzz::MemoryWatch watch;
  const auto node = core::parse_yaml(text, "fuzzed.yaml");
  if (!node) {
    fuzz::require_message(node.error().message, "fuzzed.yaml");
  } else {
    core::ConfigProblems problems;
    const auto chain = cloud::FilterChain::parse(*node, "", registry, problems);
    if (!problems.empty()) {
      fuzz::require_message(core::to_string(problems).substr(0, 50000), "fuzzed.yaml");
    } else {
      // What is accepted can be spelt out and is accepted again.
      const auto again = core::parse_yaml(chain.to_yaml(), "again.yaml");
      fuzz::require(again.has_value(), "a spelt-out chain is YAML");
      fuzz::require(cloud::FilterChain::parse(*again, "", registry, problems).to_yaml() == chain.to_yaml(),
                    "a spelt-out chain reads back the same");
    }
  }
  fuzz::check_memory(watch, size);
  return 0;
}
