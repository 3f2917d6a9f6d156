// SPDX-License-Identifier: BSD-3-Clause
#include "guarded.hpp"
#include "plumbline/core/config.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/session/background.hpp"
#include "plumbline/session/filter_chains.hpp"
#include "plumbline/session/map.hpp"

namespace plumbline {

core::Result<cloud::FilterChain> session::load_chain(const std::string& chain,
                                                     const cloud::FilterRegistry& filters,
                                                     const std::filesystem::path& pipelines_folder) {
  // A text that begins with a bracket is a list of filters, any other one names a file
  if (chain.rfind('[', 0) != 0) {
    return find_pipelines(pipelines_folder)
        .and_then(
            [&](const auto& folder) { return core::find_yaml("filter chain", chain, folder / "filters"); })
        .and_then([&](const auto& file) { return cloud::FilterChain::load(file, filters); });
  }

  // The list may come from a user, so all its problems are reported
  const auto list = core::parse_yaml(chain, "filters");
  if (!list) return tl::unexpected(list.error());
  core::ConfigProblems problems;
  cloud::FilterChain parsed = cloud::FilterChain::parse_list(*list, "filters", filters, problems);
  if (!problems.empty()) return tl::unexpected(core::to_error(problems));
  return parsed;
}

core::Result<cloud::CloudPtr> filter(const cloud::CloudConstPtr& cloud, const std::string& chain,
                                     const RunOptions& options) {
  // Exceptions of the libraries become errors of the result
  return session::guarded([&]() -> core::Result<cloud::CloudPtr> {
    const auto filters = session::load_chain(chain, options.filters, options.pipelines_folder);
    if (!filters) return tl::unexpected(filters.error());
    const session::OpenCvThreads one;
    const core::Executor executor(options.threads);
    cloud::FilterContext context;
    context.executor = &executor;
    return filters->apply(cloud, context);
  });
}

}  // namespace plumbline
