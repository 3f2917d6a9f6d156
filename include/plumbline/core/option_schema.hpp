// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Texts made of option declarations for other programs and for people: JSON Schema (draft 7, what editors
// understand) and Markdown.
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "plumbline/core/options.hpp"

namespace plumbline::core {

/// Schema of one value: its type, range, choices, unit and help. A value with unit is a text for JSON; its
/// range is beyond a schema and left to the program. Lists of text_or_list refer to
/// "#/definitions/<list_of>".
nlohmann::ordered_json option_schema(const OptionSpec& spec);

/// "properties" of a map that holds these options.
nlohmann::ordered_json options_schema(const std::vector<OptionSpec>& specs);

/// Values that an option takes: "0.1 m to 5 m", "on, off", "3 numbers, -1 m to 1 m".
std::string allowed_text(const OptionSpec& spec);

/// A Markdown table of options: key, default, allowed values, help; "" when there are none.
std::string options_as_markdown(const std::vector<OptionSpec>& specs);

}  // namespace plumbline::core
