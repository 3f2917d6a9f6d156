// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Options that had other names in earlier versions; pipeline files and --set may still use these.
#include <string>
#include <vector>

namespace plumbline::core {

struct RenamedOption {
  const char* stage;   ///< type of the stage
  const char* before;  ///< key
  const char* now;
};
const std::vector<RenamedOption>& renamed_options();

/// What `key` of a stage of type `stage` is called now; else the key itself.
std::string renamed_option(const std::string& stage, const std::string& key);

/// "stage.key" of the option that another stage has now instead; empty: none has.
std::string moved_option(const std::string& stage, const std::string& key);

/// The same for "stage.key" of --set, with the stages that are gone.
std::string renamed_setting(const std::string& stage, const std::string& key);

}  // namespace plumbline::core
