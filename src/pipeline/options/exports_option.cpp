// SPDX-License-Identifier: BSD-3-Clause
#include "options/exports_option.hpp"

#include <fmt/format.h>

#include "graph/export_entry.hpp"

namespace plumbline::pipeline {
namespace {

using Kind = core::ConfigNode::Kind;

exports::Content content_of(const std::string& what) {
  if (what == "mesh") return exports::Content::kMesh;
  if (what == "trajectory") return exports::Content::kTrajectory;
  if (what == "keyframes") return exports::Content::kKeyframes;
  return what == "lines" ? exports::Content::kLines : exports::Content::kCloud;
}

bool leaves_folder(const std::filesystem::path& file) {
  const std::filesystem::path normal = file.lexically_normal();
  return file.is_absolute() || normal.empty() || *normal.begin() == "..";
}

}  // namespace

void ExportsOption::add(const core::ConfigNode& entry, const std::string& path,
                        core::ConfigProblems& problems) {
  exports::ExportRequest request;
  ExportEntry words;
  core::OptionTable table;
  words.declare(table);
  const std::size_t own = table.specs().size();
  request.options.declare(table);
  const std::size_t before = problems.size();

  if (entry.kind == Kind::kScalar) {
    words.file = entry.scalar;
  } else {
    table.set_all(entry, path, problems);
  }
  if (problems.size() != before) return;

  // An option that was set must belong to the format; defaults need not, so they are not listed.
  for (std::size_t i = own; i < table.specs().size(); ++i) {
    if (entry.find(table.specs()[i].key) != nullptr) request.given.insert(table.specs()[i].key);
  }

  request.output = words.file;
  request.format = words.format;
  request.content = content_of(words.what);

  // Exports are part of the result, which appears whole or not at all: none may lie outside of its folder.
  if (words.file.empty() || leaves_folder(request.output)) {
    problems.push_back(
        {entry.mark, path, "an export names a file below the result folder, such as grid.yaml"});
    return;
  }

  if (auto fits = exports::check_export(request); !fits) {
    problems.push_back({entry.mark, path, fits.error().message});
    return;
  }

  requests_.push_back(std::move(request));
}

void ExportsOption::check(const std::string& path, core::ConfigProblems& problems) {
  requests_.clear();
  const std::string own = path + ".exports";
  if (value_.kind == Kind::kScalar) {
    if (!value_.scalar.empty()) add(value_, own, problems);
    return;
  }
  for (std::size_t i = 0; i < value_.items.size(); ++i)
    add(value_.items[i], fmt::format("{}[{}]", own, i), problems);
}

std::vector<std::string> ExportsOption::files() const {
  std::vector<std::string> files;
  for (const exports::ExportRequest& request : requests_) {
    std::filesystem::path file = request.output;
    files.push_back(file.generic_string());
    const std::string ending = file.extension().string();
    if (ending == ".yaml") files.push_back(file.replace_extension(".pgm").generic_string());
    if (ending == ".pgm") files.push_back(file.replace_extension(".yaml").generic_string());
  }
  return files;
}

}  // namespace plumbline::pipeline
