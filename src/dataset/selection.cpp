// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/selection.hpp"

#include <fmt/format.h>

namespace plumbline::dataset {

core::Result<std::vector<std::size_t>> selected_frames(const std::string& name,
                                                       const std::vector<double>& stamps,
                                                       const OpenOptions& options) {
  if (options.every < 1) {
    return core::usage_error(fmt::format("every: {} is out of range (allowed: 1 or more)", options.every));
  }

  // Counting begins with the first frame in the span
  std::vector<std::size_t> selected;
  std::size_t inside = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const double elapsed_s = stamps[i] - stamps.front();
    if (!(elapsed_s >= options.from_s && elapsed_s <= options.to_s)) continue;
    if (inside++ % static_cast<std::size_t>(options.every) == 0) selected.push_back(i);
  }
  if (!selected.empty()) return selected;

  // The error names the recording's true end
  const double duration_s = stamps.back() - stamps.front();
  if (options.to_s == OpenOptions().to_s) {
    return core::usage_error(
        fmt::format("{}: nothing lies after {} s (--from); the recording ends at {:.2f} s", name,
                    options.from_s, duration_s));
  }
  return core::usage_error(
      fmt::format("{}: nothing lies between {} s and {} s (--from, --to): the recording is {:.2f} s long",
                  name, options.from_s, options.to_s, duration_s));
}

}  // namespace plumbline::dataset
