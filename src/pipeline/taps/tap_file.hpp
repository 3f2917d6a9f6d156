// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The file of a tap: a path below the result folder, with a '*' for the number where there are many.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

class TapFile {
 public:
  enum class Count { kOne, kMany, kFrames };  ///< kFrames: one for every n-th frame, which is an option
  /// `endings`: what the name may end with, e.g. {".ply", ".pcd"}.
  TapFile(Count count, std::vector<std::string> endings) : count_(count), endings_(std::move(endings)) {}

  void declare(core::OptionTable& table);
  /// A path that is absolute, leaves the result folder, has another ending or the wrong number of '*'.
  void check(const core::ConfigMark& mark, const std::string& path, core::ConfigProblems& problems) const;
  [[nodiscard]] const std::string& name() const { return file_; }
  [[nodiscard]] std::string ending() const { return std::filesystem::path(file_).extension().string(); }
  /// The name with `middle` before its ending: "a/*.png", ".depth" -> "a/*.depth.png".
  [[nodiscard]] std::string with(const std::string& middle) const;

  [[nodiscard]] bool skips(std::size_t frame) const { return frame % static_cast<std::size_t>(every_) != 0; }

  /// Makes the folders.
  core::Result<void> start(const RunContext& context);
  /// Where to write; `number` replaces the '*', with six digits. `middle` as in with().
  [[nodiscard]] std::filesystem::path path(std::size_t number = 0, const std::string& middle = "") const;
  [[nodiscard]] std::filesystem::path folder() const { return path().parent_path(); }

 private:
  Count count_;
  std::vector<std::string> endings_;
  std::string file_;
  int every_ = 1;
  std::filesystem::path result_folder_;
};

/// What all taps have in common.
class Tap : public Stage {
 public:
  Tap(TapFile::Count count, std::vector<std::string> endings) : file_(count, std::move(endings)) {}
  void declare(core::OptionTable& table) override { file_.declare(table); }
  void check(const CheckContext& /*context*/, const core::ConfigMark& mark, const std::string& path,
             core::ConfigProblems& problems) override {
    file_.check(mark, path, problems);
  }
  [[nodiscard]] std::vector<std::string> files() const override { return {file_.name()}; }
  core::Result<void> start(const RunContext& context) override { return file_.start(context); }
  core::Result<void> process(StageIo& /*io*/) override { return {}; }

 protected:
  TapFile file_;
};

}  // namespace plumbline::pipeline
