// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Common base of all taps: a file below the result folder, with a '*' for the number if there are many.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "stages/stages.hpp"

namespace plumbline::pipeline {

class Tap : public Stage {
 public:
  /// Files that are written; kFrames: one for every n-th frame (option every).
  enum class Count { kOne, kMany, kFrames };
  /// `endings`: what the name may end with, e.g. {".ply", ".pcd"}.
  Tap(Count count, std::vector<std::string> endings) : count_(count), endings_(std::move(endings)) {}

  void declare(core::OptionTable& table) override;
  /// Reports a path that is absolute, leaves the result folder, has a wrong ending or number of '*'.
  void check(const CheckContext& context, const core::ConfigMark& mark, const std::string& path,
             core::ConfigProblems& problems) override;
  [[nodiscard]] std::vector<std::string> files() const override { return {file_}; }
  /// Makes the folder of the file.
  core::Result<void> start(const RunContext& context) override;

 protected:
  [[nodiscard]] std::string ending() const { return std::filesystem::path(file_).extension().string(); }
  /// The file's path with `middle` before the ending: "a/*.png", ".depth" -> "a/*.depth.png".
  [[nodiscard]] std::string with(const std::string& middle) const;
  [[nodiscard]] bool skips(std::size_t frame) const { return frame % static_cast<std::size_t>(every_) != 0; }
  /// Path of the file; `number` replaces the '*', with six digits. `middle` as in with().
  [[nodiscard]] std::filesystem::path path(std::size_t number = 0, const std::string& middle = "") const;

 private:
  Count count_;
  std::vector<std::string> endings_;
  std::string file_;
  int every_ = 1;
  std::filesystem::path result_folder_;
};

/// The stage type of the tap T, which has the name of the port's type.
template <typename T>
StageType tap_type(const PortType& port, std::string help, Mode mode) {
  return stage_type<T>(port.name, std::move(help), mode, {{"in", port}}, {}, true);
}

}  // namespace plumbline::pipeline
