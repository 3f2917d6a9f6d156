// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pictures of what the tracker sees, one a frame: plumbline map --debug-video DIR.
#include <cstddef>
#include <filesystem>
#include <optional>

#include "plumbline/core/error.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/maps/output_folder.hpp"

namespace plumbline::pipeline {

/// The folder of the pictures. Like a result it appears whole or not at all; inside the result folder it
/// appears with that.
class DebugFolder {
 public:
  /// `out`: the result folder as the user named it, `out_path`: where its files are written until then.
  /// kUsage: `folder` is `out` or holds it, exists with earlier pictures and `replace` is false, or holds
  /// anything else. kOutput: cannot be created.
  static core::Result<DebugFolder> prepare(const std::filesystem::path& folder,
                                           const std::filesystem::path& out,
                                           const std::filesystem::path& out_path, bool replace);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }  ///< folder to write to
  /// Names of the pictures within the result folder; none if they have a folder of their own.
  [[nodiscard]] core::FileNames files() const;
  core::Result<void> commit() { return own_ ? own_->commit() : core::Result<void>(); }

 private:
  std::filesystem::path path_;
  std::filesystem::path within_;           ///< the result folder
  std::optional<maps::OutputFolder> own_;  ///< none inside the result folder
};

/// Writes FOLDER/<number, six digits>.png: `frame` as it was tracked in `map`. Errors are kOutput.
core::Result<void> write_debug_picture(const std::filesystem::path& folder, std::size_t number,
                                       const sensor::RgbdFrame& frame,
                                       const features::FrameFeatures& features, const maps::Map& map,
                                       const mapping::FrameReport& report, const sensor::Pinhole& camera);

}  // namespace plumbline::pipeline
