// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Words and endings whose capitals do not matter.
#include <filesystem>
#include <string>

namespace plumbline::core {

/// The text with ASCII's capitals as small letters.
std::string lower(std::string text);

/// The ending of a file's name in small letters, with its point: ".ply"; "": it has none.
std::string ending_of(const std::filesystem::path& file);

}  // namespace plumbline::core
