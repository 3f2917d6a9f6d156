// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The option `exports` of the stage output: forms that other programs read, written when the result is there.
#include <string>
#include <vector>

#include "plumbline/exports/export.hpp"
#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

class ExportsOption {
 public:
  ExportsOption() { value_.kind = core::ConfigNode::Kind::kSequence; }
  void declare(core::OptionTable& table) {
    table.text_or_list(
        "exports", value_, "exports",
        "Further files to write in the formats of plumbline export: names of files, such as [grid.yaml, "
        "plan.svg], or maps of file, format, what and the format's options");
  }
  /// Checks every entry; problems are reported with its position.
  void check(const std::string& path, core::ConfigProblems& problems);
  /// Below the result folder.
  [[nodiscard]] std::vector<std::string> files() const;
  [[nodiscard]] const std::vector<exports::ExportRequest>& requests() const { return requests_; }

 private:
  void add(const core::ConfigNode& entry, const std::string& path, core::ConfigProblems& problems);
  core::ConfigNode value_;
  std::vector<exports::ExportRequest> requests_;
};

}  // namespace plumbline::pipeline
