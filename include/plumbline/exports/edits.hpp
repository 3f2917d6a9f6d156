// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "plumbline/core/error.hpp"

namespace plumbline::exports {

inline constexpr const char* kEditsFile = "edits.yaml";  ///< in a result folder

/// The text of an edits.yaml for a map whose lengths are `scale` times as long. Errors (kUsage): file, line,
/// what is wrong.
core::Result<std::string> edits_text(const std::filesystem::path& file, double scale);

}  // namespace plumbline::exports
