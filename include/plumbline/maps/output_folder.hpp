// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A result folder that appears whole or not at all.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/own_files.hpp"

namespace plumbline::maps {

/// True if a folder holds the result of an earlier run.
bool is_result_folder(const std::filesystem::path& folder);

/// File that stays in folders of kinds that are marked, and in those with files whose names the user chose.
inline constexpr const char* kFilesMarker = ".plumbline-files";

/// The files of an output folder: nothing else is ever removed.
struct FolderKind {
  bool (*is_earlier)(const std::filesystem::path&);  ///< recognises a complete one, which may be replaced
  core::FileNames files;                             ///< all names that files of such a folder may have
  bool stays_marked = false;  ///< keeps `.plumbline-files`, by which `is_earlier` recognises it
};
const FolderKind& result_kind();  ///< of map, fuse, hub and robot

class FileLock;

/// Results are written to OUT.partial, which commit() renames to OUT; an earlier result is replaced only
/// then, and waits in OUT.replaced meanwhile. A run that fails leaves OUT as it was, and no OUT.partial. A
/// run that is killed at any moment leaves folders that the next one recognises: OUT.partial has the marker
/// `.plumbline-unfinished`, which is called `.plumbline-files` as soon as the result is complete.
class OutputFolder {
 public:
  /// Checks and makes OUT.partial. kUsage: OUT exists and `replace` is false, or OUT is neither empty nor an
  /// earlier result, or has files that are none of a result (then `replace` does not help), or another run is
  /// writing there, or an interrupted one left its map in OUT.partial and neither `replace` nor `takes_over`
  /// is true. kOutput: cannot be created or written, or less than 64 MB are free. An earlier result that
  /// waits in OUT.replaced, because its run was killed, is moved back first. `takes_over`: continues an
  /// interrupted run from OUT.partial, which stays there again unless committed.
  static core::Result<OutputFolder> prepare(const std::filesystem::path& out, bool replace,
                                            bool takes_over = false, const FolderKind& kind = result_kind());
  /// Finishes the commit of a run that was killed in it. True: OUT is complete, and nothing is left to do;
  /// false: there is no complete OUT, or an OUT.partial that is to be continued. Errors as of prepare().
  static core::Result<bool> finish(const std::filesystem::path& out, bool replace,
                                   const FolderKind& kind = result_kind());
  /// Folder in which results are written until they are complete.
  static std::filesystem::path partial_of(const std::filesystem::path& out);

  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  [[nodiscard]] const std::filesystem::path& path() const { return partial_; }  ///< folder to write to
  /// Announces files that this run will write besides those of FolderKind.
  core::Result<void> expect(const core::FileNames& files);
  /// `error`, unless it comes from OUT.partial being gone: then that is reported (kOutput).
  [[nodiscard]] core::Error explained(const core::Error& error) const;
  /// Checks again whether OUT may be replaced. After an error (kOutput) OUT.partial stays.
  core::Result<void> commit();
  /// Keeps the files if this object ends without commit(), for another run to continue.
  void keep() { kept_ = true; }

 private:
  static core::Result<OutputFolder> begin(const std::filesystem::path& target, FileLock lock, bool replace,
                                          bool takes_over, const FolderKind& kind);
  OutputFolder(std::filesystem::path target, int lock, bool replace, const FolderKind& kind);
  [[nodiscard]] core::Result<void> check_there() const;
  core::Result<void> mark_complete();
  core::Result<void> put_in_place();

  std::filesystem::path target_;
  std::filesystem::path partial_;  ///< empty: nothing to clean up
  int lock_ = -1;                  ///< descriptor of the locked marker file
  bool replace_ = false;
  const FolderKind* kind_;
  bool kept_ = false;
};

}  // namespace plumbline::maps
