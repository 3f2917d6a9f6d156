// SPDX-License-Identifier: BSD-3-Clause
#include "units.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

namespace plumbline::core {
namespace {

/// value_in_base = value * numerator / denominator; the two are kept apart so that "5 mm" is exactly 0.005.
struct Unit {
  std::string_view name;
  std::string_view quantity;
  double numerator;
  double denominator;
};
constexpr double kPi = 3.14159265358979323846;
constexpr std::array<Unit, 17> kUnits{{{"m", "length", 1.0, 1.0},
                                       {"cm", "length", 1.0, 100.0},
                                       {"mm", "length", 1.0, 1000.0},
                                       {"um", "length", 1.0, 1e6},
                                       {"s", "time", 1.0, 1.0},
                                       {"ms", "time", 1.0, 1000.0},
                                       {"min", "time", 60.0, 1.0},
                                       {"rad", "angle", 1.0, 1.0},
                                       {"deg", "angle", kPi, 180.0},
                                       {"rad/s", "turn rate", 1.0, 1.0},
                                       {"deg/s", "turn rate", kPi, 180.0},
                                       {"px", "pixels", 1.0, 1.0},
                                       {"bit", "bits", 1.0, 1.0},
                                       {"Hz", "frequency", 1.0, 1.0},
                                       {"ratio", "ratio", 1.0, 1.0},
                                       {"%", "ratio", 1.0, 100.0},
                                       {"", "number", 1.0, 1.0}}};

const Unit* find_unit(std::string_view name) {
  for (const Unit& unit : kUnits) {
    if (unit.name == name) return &unit;
  }
  return nullptr;
}

std::string allowed_units(const std::string& unit) {
  if (unit.empty()) return "a number";
  return fmt::format("a number {} {}", unit == "ratio" ? "without unit or in" : "in",
                     fmt::join(units_like(unit), ", "));
}

/// A number in the option's unit; the text may carry another unit of the same quantity.
ParsedNumber parse_number(const ConfigNode& node, const std::string& unit) {
  const auto wrong = [](std::string what) { return ParsedNumber{0.0, std::move(what)}; };
  const auto no_number = [&] {
    return wrong(fmt::format("{} is not {}", describe(node), allowed_units(unit)));
  };
  if (node.kind != ConfigNode::Kind::kScalar) return no_number();
  if (node.quoted) return wrong(describe(node) + " is text; write the number without quotes");

  // std::from_chars accepts no plus sign
  std::string_view text = node.scalar;
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  ParsedNumber parsed;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), parsed.value);
  if (code != std::errc() || !std::isfinite(parsed.value)) return no_number();

  // A bare number has the option's unit
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  if (text.empty() || text == unit) return parsed;

  // A frequent slip deserves advice by itself
  if (text.size() > 1 && text[0] == ',' && text[1] >= '0' && text[1] <= '9')
    return wrong(describe(node) + ": decimal comma; write numbers with a point");

  // Units must be of the same quantity
  const Unit* from = find_unit(text);
  const Unit* to = find_unit(unit);
  if (from == nullptr || to == nullptr || from->quantity != to->quantity) {
    return wrong(fmt::format("{}: the unit '{}' does not fit (allowed: {})", describe(node), text,
                             unit.empty() ? "a number without unit" : allowed_units(unit)));
  }

  // One division rounds once
  parsed.value = parsed.value * (from->numerator * to->denominator) / (from->denominator * to->numerator);
  return parsed;
}

}  // namespace

ParsedNumber parse_in_range(const ConfigNode& node, double min, double max, const std::string& unit) {
  ParsedNumber parsed = parse_number(node, unit);
  if (parsed.wrong.empty() && !(parsed.value >= min && parsed.value <= max)) {
    parsed.wrong = fmt::format("{} is out of range (allowed: {})", node.scalar, range_text(min, max, unit));
  }
  return parsed;
}

/// Units of the same quantity; a ratio is written without a unit.
std::vector<std::string> units_like(const std::string& unit) {
  if (unit.empty()) return {};
  const Unit* own = find_unit(unit);
  if (own == nullptr) return {unit};
  std::vector<std::string> names;
  for (const Unit& other : kUnits) {
    if (other.quantity == own->quantity && other.name != "ratio") names.emplace_back(other.name);
  }
  return names;
}

std::string with_unit(double value, const std::string& unit) {
  if (unit.empty() || unit == "ratio") return fmt::format("{}", value);
  return fmt::format("{} {}", value, unit);
}

bool is_lower_limit(double min) { return min > std::numeric_limits<int>::lowest(); }
bool is_upper_limit(double max) { return max < std::numeric_limits<int>::max(); }

std::string range_text(double min, double max, const std::string& unit) {
  if (!is_lower_limit(min) && !is_upper_limit(max)) return "any number";
  if (!is_upper_limit(max)) return "at least " + with_unit(min, unit);
  if (!is_lower_limit(min)) return "at most " + with_unit(max, unit);
  return fmt::format("{} to {}", with_unit(min, unit), with_unit(max, unit));
}

std::string describe(const ConfigNode& node) {
  switch (node.kind) {
    case ConfigNode::Kind::kNull:
      return "nothing";
    case ConfigNode::Kind::kSequence:
      return "a list";
    case ConfigNode::Kind::kMap:
      return "a map";
    case ConfigNode::Kind::kScalar:
      break;
  }

  // Long texts are cut to stay readable
  constexpr std::size_t kShown = 40;
  const bool longer = node.scalar.size() > kShown;
  return fmt::format("'{}{}'", node.scalar.substr(0, kShown), longer ? "..." : "");
}

}  // namespace plumbline::core
