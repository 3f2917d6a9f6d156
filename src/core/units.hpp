// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Numbers with units, as option values are written: "5 mm", "10 deg", "30 %".
#include <string>
#include <vector>

#include "plumbline/core/config.hpp"

namespace plumbline::core {

struct ParsedNumber {
  double value = 0.0;
  std::string wrong;  ///< what is wrong with the value and what is allowed; "" = fine
};

/// Converts "5 mm" to `unit`; a bare number is in `unit` already. Refuses values outside [min, max].
ParsedNumber parse_in_range(const ConfigNode& node, double min, double max, const std::string& unit);

/// Units that convert to `unit`, itself among them; "" (no unit) has none.
std::vector<std::string> units_like(const std::string& unit);

/// "0.005 m", "3".
std::string with_unit(double value, const std::string& unit);

/// "0.1 m to 5 m", "at least 0 s", "any number".
std::string range_text(double min, double max, const std::string& unit);

/// True if a limit of a range is set: open ranges end at the type's own limits.
bool is_lower_limit(double min);
bool is_upper_limit(double max);

/// Description of a value for messages: "'5 foo'", "a list", "a map", "nothing".
std::string describe(const ConfigNode& node);

}  // namespace plumbline::core
