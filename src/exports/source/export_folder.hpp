// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "plumbline/maps/output_folder.hpp"

namespace plumbline::exports {

/// File in every folder that an export made: it names the content and its frame.
inline constexpr const char* kExportNote = "plumbline_export.txt";

/// A folder that appears whole or not at all, as maps::OutputFolder; only an earlier export is ever replaced.
core::Result<maps::OutputFolder> prepare_export(const std::filesystem::path& folder, bool replace);

}  // namespace plumbline::exports
