// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "empty_value.hpp"
#include "plumbline/core/option_schema.hpp"
#include "units.hpp"

namespace plumbline::core {
namespace {

using Kind = ConfigNode::Kind;

/// The truth value of an unquoted YAML word, if it is one.
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
std::string text_as_yaml(const std::string& text) {
  ConfigNode node;
  node.kind = Kind::kScalar;
  node.scalar = text;
  return to_flow_yaml(node);
}

std::string joined_path(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

OptionSpec spec_of(std::string key, OptionType type, std::string help) {
  OptionSpec spec;
  spec.key = std::move(key);
  spec.type = type;
  spec.help = std::move(help);
  return spec;
}

/// A declaration of a number with its range and unit.
OptionSpec number_spec(std::string key, OptionType type, double min, double max, const std::string& unit,
                       std::string help) {
  OptionSpec spec = spec_of(std::move(key), type, std::move(help));
  spec.unit = unit;
  spec.min = min;
  spec.max = max;
  return spec;
}

}  // namespace

OptionTable& OptionTable::add(OptionSpec spec, Binding binding) {
  for (const OptionSpec& other : specs_) {
    if (other.key == spec.key) throw std::logic_error("option declared twice: " + spec.key);
  }

  // The value at declaration is the default
  spec.default_value = binding.print();
  specs_.push_back(std::move(spec));
  bindings_.push_back(std::move(binding));
  return *this;
}

OptionTable& OptionTable::boolean(std::string key, bool& value, std::string help) {
  const auto parse = [&value](const ConfigNode& node) -> std::string {
    const std::optional<bool> parsed = parse_boolean(node);
    if (!parsed) return describe(node) + " is neither on nor off (allowed: on, off)";
    value = *parsed;
    return "";
  };
  const auto print = [&value]() -> std::string { return value ? "on" : "off"; };
  return add(spec_of(std::move(key), OptionType::kBoolean, std::move(help)), {parse, print});
}

OptionTable& OptionTable::integer(std::string key, int& value, Range<int> range, std::string unit,
                                  std::string help) {
  const auto parse = [&value, range, unit](const ConfigNode& node) -> std::string {
    const ParsedNumber parsed = parse_in_range(node, range.min, range.max, unit);
    if (!parsed.wrong.empty()) return parsed.wrong;

    // Numbers such as 3.0 are accepted, 3.5 is not
    if (parsed.value != std::floor(parsed.value)) {
      return fmt::format("{} is not a whole number (allowed: {})", node.scalar,
                         range_text(range.min, range.max, unit));
    }
    value = static_cast<int>(parsed.value);
    return "";
  };
  const auto print = [&value, unit]() { return with_unit(value, unit); };
  return add(number_spec(std::move(key), OptionType::kInteger, range.min, range.max, unit, std::move(help)),
             {parse, print});
}

OptionTable& OptionTable::number(std::string key, double& value, Range<double> range, std::string unit,
                                 std::string help) {
  const auto parse = [&value, range, unit](const ConfigNode& node) {
    const ParsedNumber parsed = parse_in_range(node, range.min, range.max, unit);
    if (parsed.wrong.empty()) value = parsed.value;
    return parsed.wrong;
  };
  const auto print = [&value, unit]() { return with_unit(value, unit); };
  return add(number_spec(std::move(key), OptionType::kNumber, range.min, range.max, unit, std::move(help)),
             {parse, print});
}

OptionTable& OptionTable::text(std::string key, std::string& value, std::string help, EmptyValue empty) {
  OptionSpec spec = spec_of(std::move(key), OptionType::kText, std::move(help));
  spec.empty = empty;
  const auto parse = [&value](const ConfigNode& node) -> std::string {
    // Numbers and booleans without quotes are texts here
    if (node.kind != Kind::kScalar) return describe(node) + " is not a text";
    value = node.scalar;
    return "";
  };
  const auto print = [&value]() { return text_as_yaml(value); };
  return add(std::move(spec), {parse, print});
}

OptionTable& OptionTable::text_or_list(std::string key, ConfigNode& value, std::string list_of,
                                       std::string help, EmptyValue empty) {
  OptionSpec spec = spec_of(std::move(key), OptionType::kTextOrList, std::move(help));
  spec.empty = empty;
  spec.list_of = list_of;
  const auto parse = [&value, list_of](const ConfigNode& node) -> std::string {
    // The owner reads the tree later and reports its problems
    if (node.kind != Kind::kScalar && node.kind != Kind::kSequence) {
      return fmt::format("{} is neither a file nor a list of {}", describe(node), list_of);
    }
    value = node;
    return "";
  };
  const auto print = [&value]() { return to_flow_yaml(value); };
  return add(std::move(spec), {parse, print});
}

OptionTable& OptionTable::choice(std::string key, std::string& value, std::vector<std::string> allowed,
                                 std::string help) {
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const std::string& name : allowed) pairs.emplace_back(name, name);
  return choice<std::string>(std::move(key), value, std::move(pairs), std::move(help));
}

OptionTable& OptionTable::numbers(std::string key, std::vector<double>& value, std::size_t length,
                                  Range<double> range, std::string unit, std::string help) {
  OptionSpec spec =
      number_spec(std::move(key), OptionType::kNumbers, range.min, range.max, unit, std::move(help));
  spec.length = length;

  // A wrong element is reported with its position
  const auto parse = [&value, length, range, unit](const ConfigNode& node) -> std::string {
    if (node.kind != Kind::kSequence) return describe(node) + " is not a list of numbers, like [1, 2, 3]";
    if (length != 0 && node.items.size() != length) {
      return fmt::format("has {} numbers (allowed: {})", node.items.size(), length);
    }

    std::vector<double> read;
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      const ParsedNumber parsed = parse_in_range(node.items[i], range.min, range.max, unit);
      if (!parsed.wrong.empty()) return fmt::format("number {}: {}", i + 1, parsed.wrong);
      read.push_back(parsed.value);
    }

    value = std::move(read);
    return "";
  };

  // Printed as the parser would read it
  const auto print = [&value, unit]() {
    std::vector<std::string> texts;
    for (const double v : value) texts.push_back(with_unit(v, unit));
    return fmt::format("[{}]", fmt::join(texts, ", "));
  };
  return add(std::move(spec), {parse, print});
}

void OptionTable::set(const std::string& key, const ConfigNode& value, const std::string& path,
                      ConfigProblems& problems) {
  const std::string full_path = joined_path(path, key);
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    if (specs_[i].key != key) continue;

    // An empty text mostly is an unset shell variable
    if (value.kind == Kind::kScalar && value.scalar.empty() && !takes_empty(specs_[i])) {
      problems.push_back(
          {value.mark, full_path,
           fmt::format("is empty; give a value or leave it out (allowed: {})", allowed_text(specs_[i]))});
      return;
    }

    // Choices get advice on misspelt names
    std::string wrong = bindings_[i].parse(value);
    if (!wrong.empty() && specs_[i].type == OptionType::kChoice) {
      wrong = describe(value) + " is not one of the choices" + hint(value.scalar, specs_[i].choices);
    }
    if (!wrong.empty()) problems.push_back({value.mark, full_path, std::move(wrong)});
    return;
  }

  // Advice for a misspelt key
  std::vector<std::string> keys;
  for (const OptionSpec& spec : specs_) keys.push_back(spec.key);
  problems.push_back({value.mark, full_path, "unknown key" + hint(key, keys)});
}

void OptionTable::set_all(const ConfigNode& map, const std::string& path, ConfigProblems& problems,
                          const std::vector<std::string>& reserved) {
  if (map.kind == Kind::kNull) return;
  if (map.kind != Kind::kMap) {
    problems.push_back({map.mark, path, describe(map) + " is not a map of options (key: value)"});
    return;
  }

  // Reserved keys are known to the caller
  std::vector<std::string> keys = reserved;
  for (const OptionSpec& spec : specs_) keys.push_back(spec.key);
  for (std::size_t i = 0; i < map.entries.size(); ++i) {
    const auto& [key, value] = map.entries[i];
    if (std::find(reserved.begin(), reserved.end(), key) != reserved.end()) continue;

    // An unknown key is reported where the key stands
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      problems.push_back({map.key_marks[i], joined_path(path, key), "unknown key" + hint(key, keys)});
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
