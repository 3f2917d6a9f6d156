// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace plumbline::cli {

/// summary.json as a page to read: lines such as "frames.tracked: 83" of at most 110 characters. Longer texts
/// are wrapped, and of lists that do not fit the number of entries is given.
std::string result_page(const nlohmann::ordered_json& summary);

}  // namespace plumbline::cli
