// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// An entry of the list `exports`.
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "plumbline/core/options.hpp"

namespace plumbline::pipeline {

/// Fields of an entry that are not options of its format.
struct ExportEntry {
  std::string file;
  std::string format;
  std::string what = "cloud";

  void declare(core::OptionTable& table);
};

/// "exports" of a schema's definitions.
nlohmann::ordered_json exports_definition();

}  // namespace plumbline::pipeline
