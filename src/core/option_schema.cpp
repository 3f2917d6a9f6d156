// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/option_schema.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "empty_value.hpp"
#include "units.hpp"

namespace plumbline::core {
namespace {

using Json = nlohmann::ordered_json;

/// Words that YAML 1.1 readers, many editors among them, read as booleans.
Json words(const std::vector<std::string>& choices) {
  Json list = Json::array();
  for (const std::string& choice : choices) {
    list.push_back(choice);
    if (choice == "on" || choice == "yes" || choice == "true") list.push_back(true);
    if (choice == "off" || choice == "no" || choice == "false") list.push_back(false);
  }
  return list;
}

/// A text that a regular expression matches literally.
std::string escaped_for_pattern(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (std::string_view("%/").find(c) == std::string_view::npos &&
        std::string_view("\\^$.|?*+()[]{}").find(c) != std::string_view::npos) {
      out += '\\';
    }
    out += c;
  }
  return out;
}

/// A bare number in range, or a text of number and unit. The unit may be missing in the text, because
/// YAML 1.1 reads "1e3" as text.
Json number_schema(const OptionSpec& spec) {
  Json number;
  number["type"] = spec.type == OptionType::kInteger ? "integer" : "number";
  if (is_lower_limit(spec.min)) number["minimum"] = spec.min;
  if (is_upper_limit(spec.max)) number["maximum"] = spec.max;
  std::vector<std::string> units;
  for (const std::string& unit : units_like(spec.unit)) units.push_back(escaped_for_pattern(unit));
  Json text;
  text["type"] = "string";
  text["pattern"] = fmt::format("^[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?{}$",
                                units.empty() ? "" : fmt::format("( *({}))?", fmt::join(units, "|")));
  return {{"anyOf", Json::array({number, text})}};
}

Json numbers_schema(const OptionSpec& spec) {
  Json list;
  list["type"] = "array";
  list["items"] = number_schema(spec);
  if (spec.length != 0) list["minItems"] = list["maxItems"] = spec.length;
  return list;
}

Json type_schema(const OptionSpec& spec) {
  switch (spec.type) {
    case OptionType::kBoolean:
      return {{"enum", Json::array({true, false, "on", "off", "yes", "no"})}};
    case OptionType::kInteger:
    case OptionType::kNumber:
      return number_schema(spec);

    case OptionType::kText: {
      // an unquoted 12 is a text here, but not to JSON
      Json text = {{"type", Json::array({"string", "number", "boolean"})}};
      if (!takes_empty(spec)) text["minLength"] = 1;
      return text;
    }

    case OptionType::kChoice:
      return {{"enum", words(spec.choices)}};
    case OptionType::kNumbers:
      return numbers_schema(spec);
    case OptionType::kTextOrList:
      return {{"anyOf",
               Json::array({Json{{"type", "string"}}, Json{{"$ref", "#/definitions/" + spec.list_of}}})}};
  }

  return Json::object();
}

std::string table_cell(std::string text) {
  for (std::size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2)) {
    text.insert(at, "\\");
  }
  return text;
}

}  // namespace

Json option_schema(const OptionSpec& spec) {
  Json schema = type_schema(spec);
  schema["description"] =
      fmt::format("{} ({}; default: {})", spec.help, allowed_text(spec), spec.default_value);
  return schema;
}

Json options_schema(const std::vector<OptionSpec>& specs) {
  Json properties = Json::object();
  for (const OptionSpec& spec : specs) properties[spec.key] = option_schema(spec);
  return properties;
}

std::string allowed_text(const OptionSpec& spec) {
  switch (spec.type) {
    case OptionType::kBoolean:
      return "on, off";
    case OptionType::kInteger:
    case OptionType::kNumber:
      return range_text(spec.min, spec.max, spec.unit);
    case OptionType::kText:
      return spec.empty == EmptyValue::kAllowed ? "text, may be empty" : "text";
    case OptionType::kChoice:
      return fmt::format("{}", fmt::join(spec.choices, ", "));
    case OptionType::kNumbers:
      return fmt::format("{}numbers, {}", spec.length == 0 ? "" : std::to_string(spec.length) + " ",
                         range_text(spec.min, spec.max, spec.unit));
    case OptionType::kTextOrList:
      return "file, or list of " + spec.list_of;
  }
  return "";
}

/// A Markdown table of options, for the reference pages.
std::string options_as_markdown(const std::vector<OptionSpec>& specs) {
  if (specs.empty()) return "";
  std::string text = "| option | default | allowed | |\n|---|---|---|---|\n";
  for (const OptionSpec& spec : specs) {
    text += fmt::format("| `{}` | {} | {} | {} |\n", spec.key, table_cell(spec.default_value),
                        table_cell(allowed_text(spec)), table_cell(spec.help));
  }
  return text;
}

}  // namespace plumbline::core
