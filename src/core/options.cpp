// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string_view>

namespace plumbline::core {
namespace {

using Kind = ConfigNode::Kind;

/// value_in_base = value * numerator / denominator; kept apart so that "5 mm" gives exactly 0.005.
struct Unit {
  std::string_view name;
  std::string_view quantity;
  double numerator;
  double denominator;
};
constexpr double kPi = 3.14159265358979323846;
constexpr std::array<Unit, 13> kUnits{{{"m", "length", 1.0, 1.0},
                                       {"cm", "length", 1.0, 100.0},
                                       {"mm", "length", 1.0, 1000.0},
                                       {"um", "length", 1.0, 1e6},
                                       {"s", "time", 1.0, 1.0},
                                       {"ms", "time", 1.0, 1000.0},
                                       {"rad", "angle", 1.0, 1.0},
                                       {"deg", "angle", kPi, 180.0},
                                       {"px", "pixels", 1.0, 1.0},
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
  const Unit* own = find_unit(unit);
  if (own == nullptr) return "a number in " + unit;
  std::vector<std::string_view> names;
  for (const Unit& other : kUnits) {
    if (other.quantity == own->quantity && other.name != "ratio") names.push_back(other.name);
  }
  return fmt::format("a number{}{}", own->name == "ratio" ? " without unit or in " : " in ",
                     fmt::join(names, ", "));
}

struct Parsed {
  double value = 0.0;
  std::string wrong;  ///< "" = fine
};

std::string describe(const ConfigNode& node) {
  switch (node.kind) {
    case Kind::kNull:
      return "nothing";
    case Kind::kSequence:
      return "a list";
    case Kind::kMap:
      return "a map";
    case Kind::kScalar:
      break;
  }
  constexpr std::size_t kShown = 40;
  const bool longer = node.scalar.size() > kShown;
  return fmt::format("'{}{}'", node.scalar.substr(0, kShown), longer ? "..." : "");
}

/// "5 mm" in `unit`. The text is a decimal number, optionally followed by a unit.
Parsed parse_number(const ConfigNode& node, const std::string& unit) {
  if (node.kind != Kind::kScalar)
    return {0.0, fmt::format("{} is not {}", describe(node), allowed_units(unit))};
  if (node.quoted) return {0.0, fmt::format("{} is text; write the number without quotes", describe(node))};
  std::string_view text = node.scalar;
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  Parsed parsed;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), parsed.value);
  if (code != std::errc() || !std::isfinite(parsed.value)) {
    return {0.0, fmt::format("{} is not {}", describe(node), allowed_units(unit))};
  }
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  if (text.empty() || text == unit) return parsed;  // a bare number is in the option's own unit
  const Unit* from = find_unit(text);
  const Unit* to = find_unit(unit);
  if (from == nullptr || to == nullptr || from->quantity != to->quantity) {
    return {0.0, fmt::format("{}: the unit '{}' does not fit (allowed: {})", describe(node), text,
                             unit.empty() ? "a number without unit" : allowed_units(unit))};
  }
  parsed.value = parsed.value * (from->numerator * to->denominator) / (from->denominator * to->numerator);
  return parsed;
}

std::string with_unit(double value, const std::string& unit) {
  if (unit.empty() || unit == "ratio") return fmt::format("{}", value);
  return fmt::format("{} {}", value, unit);
}

std::string range_text(double min, double max, const std::string& unit) {
  const bool below = min <= std::numeric_limits<int>::lowest();
  const bool above = max >= std::numeric_limits<int>::max();
  if (below && above) return "any number";
  if (above) return "at least " + with_unit(min, unit);
  if (below) return "at most " + with_unit(max, unit);
  return fmt::format("{} to {}", with_unit(min, unit), with_unit(max, unit));
}

Parsed parse_in_range(const ConfigNode& node, double min, double max, const std::string& unit) {
  Parsed parsed = parse_number(node, unit);
  if (parsed.wrong.empty() && !(parsed.value >= min && parsed.value <= max)) {
    parsed.wrong = fmt::format("{} is out of range (allowed: {})", node.scalar, range_text(min, max, unit));
  }
  return parsed;
}

std::optional<bool> parse_boolean(const ConfigNode& node) {
  if (node.kind != Kind::kScalar || node.quoted) return std::nullopt;
  for (const char* word : {"true", "on", "yes"}) {
    if (node.scalar == word) return true;
  }
  for (const char* word : {"false", "off", "no"}) {
    if (node.scalar == word) return false;
  }
  return std::nullopt;
}

/// Text as YAML that reads back as the same text.
std::string quoted_if_needed(const std::string& text) {
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '/' || c == '.' || c == '-';
  });
  if (plain && text.front() != '-' && text != "null") return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n') {
      out += "\\n";
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string joined_path(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

std::string suggestion(const std::string& word, const std::vector<std::string>& allowed) {
  const std::string near = did_you_mean(word, allowed);
  return fmt::format("(allowed: {}{})",
                     allowed.empty() ? "nothing" : fmt::format("{}", fmt::join(allowed, ", ")),
                     near.empty() ? "" : fmt::format("; did you mean {}?", near));
}

}  // namespace

void OptionTable::add(OptionSpec spec, Binding binding) {
  for (const OptionSpec& other : specs_) {
    if (other.key == spec.key) throw std::logic_error("option declared twice: " + spec.key);
  }
  spec.default_value = binding.print();
  specs_.push_back(std::move(spec));
  bindings_.push_back(std::move(binding));
}

OptionTable& OptionTable::boolean(std::string key, bool& value, std::string help) {
  OptionSpec spec;
  spec.key = std::move(key);
  spec.type = OptionType::kBoolean;
  spec.help = std::move(help);
  add(std::move(spec), {[&value](const ConfigNode& node) -> std::string {
                          const std::optional<bool> parsed = parse_boolean(node);
                          if (!parsed) return describe(node) + " is neither on nor off (allowed: on, off)";
                          value = *parsed;
                          return "";
                        },
                        [&value]() -> std::string { return value ? "on" : "off"; }});
  return *this;
}

OptionTable& OptionTable::integer(std::string key, int& value, Range<int> range, std::string unit,
                                  std::string help) {
  OptionSpec spec;
  spec.key = std::move(key);
  spec.type = OptionType::kInteger;
  spec.unit = unit;
  spec.min = range.min;
  spec.max = range.max;
  spec.help = std::move(help);
  add(std::move(spec), {[&value, range, unit](const ConfigNode& node) -> std::string {
                          const Parsed parsed = parse_in_range(node, range.min, range.max, unit);
                          if (!parsed.wrong.empty()) return parsed.wrong;
                          if (parsed.value != std::floor(parsed.value)) {
                            return fmt::format("{} is not a whole number (allowed: {})", node.scalar,
                                               range_text(range.min, range.max, unit));
                          }
                          value = static_cast<int>(parsed.value);
                          return "";
                        },
                        [&value, unit]() { return with_unit(value, unit); }});
  return *this;
}

OptionTable& OptionTable::number(std::string key, double& value, Range<double> range, std::string unit,
                                 std::string help) {
  OptionSpec spec;
  spec.key = std::move(key);
  spec.type = OptionType::kNumber;
  spec.unit = unit;
  spec.min = range.min;
  spec.max = range.max;
  spec.help = std::move(help);
  add(std::move(spec), {[&value, range, unit](const ConfigNode& node) {
                          const Parsed parsed = parse_in_range(node, range.min, range.max, unit);
                          if (parsed.wrong.empty()) value = parsed.value;
                          return parsed.wrong;
                        },
                        [&value, unit]() { return with_unit(value, unit); }});
  return *this;
}

OptionTable& OptionTable::text(std::string key, std::string& value, std::string help) {
  OptionSpec spec;
  spec.key = std::move(key);
  spec.type = OptionType::kText;
  spec.help = std::move(help);
  add(std::move(spec), {[&value](const ConfigNode& node) -> std::string {
                          if (node.kind != Kind::kScalar) return describe(node) + " is not a text";
                          value = node.scalar;
                          return "";
                        },
                        [&value]() { return quoted_if_needed(value); }});
  return *this;
}

OptionTable& OptionTable::choice(std::string key, std::string& value, std::vector<std::string> allowed,
                                 std::string help) {
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const std::string& name : allowed) pairs.emplace_back(name, name);
  return choice<std::string>(std::move(key), value, std::move(pairs), std::move(help));
}

OptionTable& OptionTable::numbers(std::string key, std::vector<double>& value, std::size_t length,
                                  Range<double> range, std::string unit, std::string help) {
  OptionSpec spec;
  spec.key = std::move(key);
  spec.type = OptionType::kNumbers;
  spec.unit = unit;
  spec.min = range.min;
  spec.max = range.max;
  spec.length = length;
  spec.help = std::move(help);
  const auto parse = [&value, length, range, unit](const ConfigNode& node) -> std::string {
    if (node.kind != Kind::kSequence) return describe(node) + " is not a list of numbers, like [1, 2, 3]";
    if (length != 0 && node.items.size() != length) {
      return fmt::format("has {} numbers (allowed: {})", node.items.size(), length);
    }
    std::vector<double> read;
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      const Parsed parsed = parse_in_range(node.items[i], range.min, range.max, unit);
      if (!parsed.wrong.empty()) return fmt::format("number {}: {}", i + 1, parsed.wrong);
      read.push_back(parsed.value);
    }
    value = std::move(read);
    return "";
  };
  add(std::move(spec), {parse, [&value, unit]() {
                          std::vector<std::string> texts;
                          for (const double v : value) texts.push_back(with_unit(v, unit));
                          return fmt::format("[{}]", fmt::join(texts, ", "));
                        }});
  return *this;
}

void OptionTable::set(const std::string& key, const ConfigNode& value, const std::string& path,
                      ConfigProblems& problems) {
  const std::string full_path = joined_path(path, key);
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    if (specs_[i].key != key) continue;
    std::string wrong = bindings_[i].parse(value);
    if (!wrong.empty() && specs_[i].type == OptionType::kChoice) {
      wrong = fmt::format("{} is not one of the choices {}", describe(value),
                          suggestion(value.scalar, specs_[i].choices));
    }
    if (!wrong.empty()) problems.push_back({value.mark, full_path, std::move(wrong)});
    return;
  }
  std::vector<std::string> keys;
  for (const OptionSpec& spec : specs_) keys.push_back(spec.key);
  problems.push_back({value.mark, full_path, "unknown key " + suggestion(key, keys)});
}

void OptionTable::set_all(const ConfigNode& map, const std::string& path, ConfigProblems& problems,
                          const std::vector<std::string>& reserved) {
  if (map.kind == Kind::kNull) return;
  if (map.kind != Kind::kMap) {
    problems.push_back({map.mark, path, describe(map) + " is not a map of options (key: value)"});
    return;
  }
  std::vector<std::string> keys = reserved;
  for (const OptionSpec& spec : specs_) keys.push_back(spec.key);
  for (std::size_t i = 0; i < map.entries.size(); ++i) {
    const auto& [key, value] = map.entries[i];
    if (std::find(reserved.begin(), reserved.end(), key) != reserved.end()) continue;
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      problems.push_back({map.key_marks[i], joined_path(path, key), "unknown key " + suggestion(key, keys)});
    } else {
      set(key, value, path, problems);
    }
  }
}

std::string OptionTable::value(const std::string& key) const {
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    if (specs_[i].key == key) return bindings_[i].print();
  }
  throw std::logic_error("no such option: " + key);
}

}  // namespace plumbline::core
