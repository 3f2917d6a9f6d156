// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "graph/export_entry.hpp"
#include "plumbline/cloud/filters/filter_schema.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/option_schema.hpp"
#include "plumbline/pipeline/reference.hpp"

namespace plumbline::pipeline {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kDraft = "http://json-schema.org/draft-07/schema#";
constexpr const char* kPortPattern = "^[a-z][a-z0-9_]*(\\.[a-z][a-z0-9_]*)?$";

Json inputs_schema(const StageType& type) {
  Json properties = Json::object();
  Json required = Json::array();
  for (const Port& port : type.inputs) {
    properties[port.name] = {{"type", "string"},
                             {"pattern", kPortPattern},
                             {"description", "stage or stage.port that gives a " + port.type.name}};
    if (port.required) required.push_back(port.name);
  }
  Json inputs = {{"type", "object"}, {"additionalProperties", false}, {"properties", std::move(properties)}};
  if (!required.empty()) inputs["required"] = std::move(required);
  return inputs;
}

/// Schema of a stage; one that changes an included stage has no required keys.
Json stage_body(const StageType& type, bool alone) {
  Json properties;
  properties["type"] = {{"const", type.name}};
  properties["inputs"] = inputs_schema(type);
  const bool needs_inputs = properties["inputs"].contains("required");
  if (!alone) properties["inputs"].erase("required");
  properties.update(core::options_schema(type.options()));
  Json body = {{"description", type.help},
               {"type", "object"},
               {"additionalProperties", false},
               {"properties", std::move(properties)}};
  body["required"] = Json::array({"type"});
  if (alone && needs_inputs) body["required"].push_back("inputs");
  return body;
}

/// The right definition by `type`: an editor then reports what is wrong with this stage, not with all of
/// them.
Json stage_rule(const StageRegistry& registry, bool alone) {
  Json cases = Json::array();
  for (const std::string& name : registry.names()) {
    Json rule;
    rule["if"] = {{"properties", {{"type", {{"const", name}}}}}, {"required", Json::array({"type"})}};
    rule["then"] = {{"$ref", "#/definitions/" + std::string(alone ? "stage." : "change.") + name}};
    cases.push_back(std::move(rule));
  }
  Json entry;
  entry["type"] = "object";
  if (alone) entry["required"] = Json::array({"type"});
  entry["properties"]["type"] = {{"enum", registry.names()}};
  entry["allOf"] = std::move(cases);
  return entry;
}

Json stages_of(const std::string& definition) {
  return {{"type", "object"},
          {"minProperties", 1},
          {"propertyNames", {{"pattern", "^[a-z][a-z0-9_]*$"}}},
          {"additionalProperties", {{"$ref", "#/definitions/" + definition}}}};
}

Json taps_schema(const StageRegistry& registry) {
  Json properties;
  properties["port"] = {{"type", "string"},
                        {"pattern", kPortPattern},
                        {"description", "stage or stage.port whose values are written"}};
  for (const StageTypePtr& tap : registry.taps()) {
    for (const core::OptionSpec& spec : tap->options()) {
      if (!properties.contains(spec.key)) properties[spec.key] = core::option_schema(spec);
    }
  }
  properties["file"]["description"] =
      "File below the result folder; a * stands for the number if there are many";
  Json tap = {{"type", "object"}, {"additionalProperties", false}, {"properties", std::move(properties)}};
  tap["required"] = Json::array({"port", "file"});
  return {{"type", "array"}, {"items", std::move(tap)}};
}

Json names_schema(const std::string& description) {
  const Json name = {{"type", "string"}, {"minLength", 1}};
  return {{"description", description},
          {"anyOf", Json::array({name, Json{{"type", "array"}, {"items", name}}})}};
}

/// Rules that depend on whether the file includes another one's stages.
Json with_or_without_include() {
  Json alone;
  alone["required"] = Json::array({"stages"});
  alone["properties"]["stages"] = stages_of("stage");
  alone["properties"]["remove"] = false;
  Json including;
  including["properties"]["stages"] = stages_of("change");
  return {{"if", {{"required", Json::array({"include"})}}},
          {"then", std::move(including)},
          {"else", std::move(alone)}};
}

Json definitions(const StageRegistry& registry) {
  Json all = cloud::filter_definitions(registry.filters());
  for (const StageTypePtr& type : registry.types()) {
    all["stage." + type->name] = stage_body(*type, true);
    all["change." + type->name] = stage_body(*type, false);
  }
  all["exports"] = exports_definition();
  all["stage"] = stage_rule(registry, true);
  all["change"] = stage_rule(registry, false);
  return all;
}

}  // namespace

std::string pipeline_schema(const StageRegistry& registry) {
  Json schema;
  schema["$schema"] = kDraft;
  schema["title"] = "Plumbline pipeline";
  schema["type"] = "object";
  schema["additionalProperties"] = false;
  Json& keys = schema["properties"];
  keys["description"] = {{"type", Json::array({"string", "number", "boolean"})},
                         {"description", "Purpose of the pipeline"}};
  keys["include"] = names_schema("Pipelines to begin with: files beside this one, or shipped ones");
  keys["remove"] = names_schema("Included stages to leave out");
  keys["stages"] = {{"type", "object"}};
  keys["taps"] = taps_schema(registry);
  keys["run"] = {
      {"description", "Information on the run in a result's config.yaml; it is not used as configuration"}};
  schema["allOf"] = Json::array({with_or_without_include()});
  schema["definitions"] = definitions(registry);
  return core::json_text(schema);
}

std::string stage_schema(const StageType& type, const StageRegistry& registry) {
  Json schema;
  schema["$schema"] = kDraft;
  schema["title"] = "Plumbline stage " + type.name;
  schema.update(stage_body(type, true));
  Json filters = cloud::filter_definitions(registry.filters());
  if (schema["properties"].contains("filters")) schema["definitions"] = std::move(filters);
  if (schema["properties"].contains("exports")) schema["definitions"]["exports"] = exports_definition();
  return core::json_text(schema);
}

}  // namespace plumbline::pipeline
