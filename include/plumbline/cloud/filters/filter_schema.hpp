// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// JSON Schema (draft 7) of filter chain files, made from the filters' own declarations.
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "plumbline/cloud/filters/filter.hpp"

namespace plumbline::cloud {

/// "filters" (the list of a chain) and "filter.<type>" for every type; for "#/definitions" of a schema.
nlohmann::ordered_json filter_definitions(const FilterRegistry& registry);

/// The schema of a chain's file, for editors and validators.
std::string filter_chain_schema(const FilterRegistry& registry);

}  // namespace plumbline::cloud
