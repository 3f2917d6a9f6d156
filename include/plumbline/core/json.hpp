// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// JSON that others wrote is read here and nowhere else: bounded in size, depth and keys, so that no file can
// crash the reader or keep it busy. Text of JSON is made here, too, and is always valid UTF-8.
#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "plumbline/core/error.hpp"

namespace plumbline::core {

/// Limits of JSON that is read: bytes of a file, nested lists and objects, keys of one object.
struct JsonLimits {
  static constexpr std::size_t kBytes = 64'000'000;
  static constexpr std::size_t kDepth = 64;
  static constexpr std::size_t kKeys = 1000;
};

/// The value in a text; `name` is that of its file. Errors (kInput): file, line, column and what is wrong.
Result<nlohmann::ordered_json> parse_json(std::string_view text, const std::string& name);

/// The value in a file. Errors (kInput): as above, or the file cannot be read.
Result<nlohmann::ordered_json> read_json(const std::filesystem::path& file);

/// The value as text, with an end of line if it is indented. Bytes that are not UTF-8, as names of files may
/// be, become U+FFFD. indent < 0: all on one line
std::string json_text(const nlohmann::ordered_json& json, int indent = 2);

}  // namespace plumbline::core
