// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A result folder that appears whole or not at all.
#include <filesystem>

#include "plumbline/core/error.hpp"

namespace plumbline::maps {

/// True if a folder holds the result of an earlier run.
bool is_result_folder(const std::filesystem::path& folder);

/// Results are written to OUT.partial, which commit() renames to OUT; an earlier result is replaced only
/// then. A run that fails leaves OUT as it was, and no OUT.partial.
class OutputFolder {
 public:
  /// Checks and makes OUT.partial. kUsage: OUT exists and `replace` is false, or OUT is neither empty nor an
  /// earlier result (then `replace` does not help: nothing else is ever deleted), or another run is writing
  /// there, or an interrupted one left its map in OUT.partial and neither `replace` nor `takes_over` is true.
  /// kOutput: cannot be created or written, or less than 64 MB are free. `is_earlier` recognises an
  /// earlier result, which alone may be deleted.
  using IsEarlier = bool (*)(const std::filesystem::path&);
  /// `takes_over`: continues an interrupted run from OUT.partial, which stays there again unless committed.
  static core::Result<OutputFolder> prepare(const std::filesystem::path& out, bool replace,
                                            bool takes_over = false, IsEarlier is_earlier = is_result_folder);
  /// Folder in which results are written until they are complete.
  static std::filesystem::path partial_of(const std::filesystem::path& out);

  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  [[nodiscard]] const std::filesystem::path& path() const { return partial_; }  ///< folder to write to
  core::Result<void> commit();
  /// Keeps the files if this object ends without commit(), for another run to continue.
  void keep() { kept_ = true; }

 private:
  OutputFolder(std::filesystem::path target, std::filesystem::path partial, int lock, IsEarlier is_earlier);
  std::filesystem::path target_;
  std::filesystem::path partial_;  ///< empty: nothing to clean up
  int lock_ = -1;                  ///< descriptor of the locked marker file
  IsEarlier is_earlier_;
  bool kept_ = false;
};

}  // namespace plumbline::maps
