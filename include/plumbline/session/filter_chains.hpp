// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/core/error.hpp"

namespace plumbline::session {

/// `chain`: a shipped name, a file, or the list of filters itself as YAML, which begins with "[". Errors
/// (kUsage): all mistakes of the chain.
core::Result<cloud::FilterChain> load_chain(const std::string& chain, const cloud::FilterRegistry& filters,
                                            const std::filesystem::path& pipelines_folder = {});

}  // namespace plumbline::session
