// SPDX-License-Identifier: BSD-3-Clause
#include "graph/export_entry.hpp"

#include <nlohmann/json.hpp>

#include "plumbline/core/option_schema.hpp"
#include "plumbline/exports/options.hpp"

namespace plumbline::pipeline {

void ExportEntry::declare(core::OptionTable& table) {
  table.text("file", file, "File or folder below the result folder");
  table.text("format", format, "A format of plumbline export; empty: by the file's ending",
             core::EmptyValue::kAllowed);
  table.choice("what", what, {"cloud", "mesh", "trajectory", "keyframes", "lines"},
               "Part of the map to write, if the ending does not determine it");
}

nlohmann::ordered_json exports_definition() {
  using Json = nlohmann::ordered_json;
  ExportEntry words;
  exports::ExportOptions options;
  core::OptionTable table;
  words.declare(table);
  options.declare(table);
  Json entry = {{"type", "object"},
                {"additionalProperties", false},
                {"required", Json::array({"file"})},
                {"properties", core::options_schema(table.specs())}};
  return {{"type", "array"},
          {"items", {{"anyOf", Json::array({Json{{"type", "string"}}, std::move(entry)})}}}};
}

}  // namespace plumbline::pipeline
