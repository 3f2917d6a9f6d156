// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/filters/filter_schema.hpp"

#include <nlohmann/json.hpp>

#include "plumbline/core/json.hpp"
#include "plumbline/core/option_schema.hpp"

namespace plumbline::cloud {
namespace {

using Json = nlohmann::ordered_json;

Json filter_schema(const FilterInfo& info) {
  const auto filter = info.make();
  core::OptionTable table;
  filter->declare(table);

  // The type is fixed; everything else is an option
  Json properties;
  properties["type"] = {{"const", info.type}};
  properties.update(core::options_schema(table.specs()));
  return {{"description", info.summary},
          {"type", "object"},
          {"additionalProperties", false},
          {"properties", std::move(properties)}};
}

}  // namespace

Json filter_definitions(const FilterRegistry& registry) {
  Json entry;
  entry["type"] = "object";
  entry["required"] = Json::array({"type"});
  entry["properties"]["type"]["enum"] = registry.types();

  Json definitions;
  Json cases = Json::array();
  for (const FilterInfo& info : registry.filters()) {
    const std::string name = "filter." + info.type;
    definitions[name] = filter_schema(info);

    // if/then instead of oneOf: an editor then reports what is wrong with this filter, not with all of them.
    Json rule;
    rule["if"] = {{"properties", {{"type", {{"const", info.type}}}}}, {"required", Json::array({"type"})}};
    rule["then"] = {{"$ref", "#/definitions/" + name}};
    cases.push_back(std::move(rule));
  }

  entry["allOf"] = std::move(cases);
  definitions["filters"] = {{"type", "array"}, {"items", std::move(entry)}};
  return definitions;
}

std::string filter_chain_schema(const FilterRegistry& registry) {
  Json schema;
  schema["$schema"] = "http://json-schema.org/draft-07/schema#";
  schema["title"] = "Plumbline filter chain";
  schema["type"] = "object";
  schema["required"] = Json::array({"chain", "filters"});
  schema["additionalProperties"] = false;
  schema["properties"]["chain"] = {{"type", Json::array({"string", "number"})},
                                   {"pattern", "^[A-Za-z0-9_.-]+$"}};
  schema["properties"]["description"] = {{"type", "string"}};
  schema["properties"]["filters"] = {{"$ref", "#/definitions/filters"}};
  schema["definitions"] = filter_definitions(registry);
  return core::json_text(schema);
}

}  // namespace plumbline::cloud
