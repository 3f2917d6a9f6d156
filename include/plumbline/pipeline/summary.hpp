// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Summary of a finished run.
#include <string>

namespace plumbline::pipeline {

struct RunSummary {
  std::string reason;  ///< reason not to trust the result; empty: there is none
  std::string json;    ///< summary.json (docs/reference/files.md)
  std::string text;    ///< a few lines of text for the user
};

/// Most memory this process ever held, MB.
double peak_rss_mb();

/// Memory this process holds now, MB; NaN if the system does not report it.
double rss_mb();

}  // namespace plumbline::pipeline
