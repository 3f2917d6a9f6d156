// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One declaration per option (key, type, unit, default, range, help) drives the parser, the validator,
// `describe`, the JSON Schema and the reference pages.
//
//   struct OrbOptions {
//     int count = 1000;
//     double max_depth_m = 5.0;
//     void declare(core::OptionTable& table) {
//       table.integer("count", count, {50, 10000}, "", "ORB points per frame");
//       table.number("max_depth", max_depth_m, {0.1, 50.0}, "m", "Depth beyond this is not used");
//     }
//   };
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/config.hpp"
#include "plumbline/core/error.hpp"

namespace plumbline::core {

template <typename T>
struct Range {
  T min = std::numeric_limits<T>::lowest();
  T max = std::numeric_limits<T>::max();
};

/// Options refuse an empty text, which mostly is a variable of a shell that was not set, unless it is
/// allowed.
enum class EmptyValue { kRefused, kAllowed };

enum class OptionType { kBoolean, kInteger, kNumber, kText, kChoice, kNumbers, kTextOrList };

/// Declaration of one option; values as text in the syntax that the parser accepts.
struct OptionSpec {
  std::string key;
  OptionType type = OptionType::kText;
  EmptyValue empty = EmptyValue::kRefused;
  std::string unit;  ///< unit of the stored value: "m", "s", "rad", "px", "" (none)
  std::string default_value;
  double min = std::numeric_limits<double>::lowest();
  double max = std::numeric_limits<double>::max();
  std::vector<std::string> choices;
  std::size_t length = 0;  ///< required count of numbers (kNumbers), 0 = any
  std::string list_of;     ///< kind of the list's elements (kTextOrList), such as "filters"
  std::string help;
};

/// Binds keys to the fields of one options struct; the struct must outlive the table.
class OptionTable {
 public:
  OptionTable& boolean(std::string key, bool& value, std::string help);
  OptionTable& integer(std::string key, int& value, Range<int> range, std::string unit, std::string help);
  OptionTable& number(std::string key, double& value, Range<double> range, std::string unit,
                      std::string help);
  /// With kAllowed, `help` says what an empty text means.
  OptionTable& text(std::string key, std::string& value, std::string help,
                    EmptyValue empty = EmptyValue::kRefused);
  OptionTable& choice(std::string key, std::string& value, std::vector<std::string> allowed,
                      std::string help);
  OptionTable& numbers(std::string key, std::vector<double>& value, std::size_t length, Range<double> range,
                       std::string unit, std::string help);
  template <typename Enum>
  OptionTable& choice(std::string key, Enum& value, std::vector<std::pair<std::string, Enum>> allowed,
                      std::string help);
  /// Name of a file, or the list that the file would contain. The owner reads the tree.
  OptionTable& text_or_list(std::string key, ConfigNode& value, std::string list_of, std::string help,
                            EmptyValue empty = EmptyValue::kRefused);

  /// Reads one value; `path` is the dotted path of the map that holds the key. Numbers may carry a unit ("5
  /// mm", "10 deg", "0.5 s"), converted to the option's unit; booleans are true/false/on/off/yes/no. The
  /// problem (if any) says what is wrong and what is allowed.
  void set(const std::string& key, const ConfigNode& value, const std::string& path,
           ConfigProblems& problems);

  /// Reads every entry of a map; unknown keys are problems with a suggestion. `reserved` keys are passed
  /// over.
  void set_all(const ConfigNode& map, const std::string& path, ConfigProblems& problems,
               const std::vector<std::string>& reserved = {});

  /// All options; `default_value` is the value at declaration time.
  [[nodiscard]] const std::vector<OptionSpec>& specs() const { return specs_; }
  /// Current value of an option as text that `set` would accept.
  [[nodiscard]] std::string value(const std::string& key) const;

 private:
  struct Binding {
    /// Returns "" or what is wrong with the value.
    std::function<std::string(const ConfigNode&)> parse;
    std::function<std::string()> print;
  };
  OptionTable& add(OptionSpec spec, Binding binding);

  std::vector<OptionSpec> specs_;
  std::vector<Binding> bindings_;
};

template <typename Enum>
OptionTable& OptionTable::choice(std::string key, Enum& value,
                                 std::vector<std::pair<std::string, Enum>> allowed, std::string help) {
  OptionSpec spec;
  spec.key = std::move(key);
  spec.type = OptionType::kChoice;
  spec.help = std::move(help);
  for (const auto& [name, unused] : allowed) spec.choices.push_back(name);

  // Names are parsed and printed through the same pairs
  Binding binding;
  binding.parse = [&value, allowed](const ConfigNode& node) -> std::string {
    for (const auto& [name, v] : allowed) {
      if (node.kind == ConfigNode::Kind::kScalar && node.scalar == name) {
        value = v;
        return "";
      }
    }
    return "is not one of the choices";
  };

  binding.print = [&value, allowed]() -> std::string {
    for (const auto& [name, v] : allowed) {
      if (v == value) return name;
    }
    return "";
  };
  return add(std::move(spec), std::move(binding));
}

}  // namespace plumbline::core
