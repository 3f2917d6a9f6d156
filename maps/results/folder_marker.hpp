// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The file in an output folder that tells whose it is, how far its run came, and which files it wrote.
#include <filesystem>
#include <utility>

#include "plumbline/maps/output_folder.hpp"
#include "plumbline/maps/unfinished_run.hpp"

namespace plumbline::maps {

/// In OUT.partial while its run writes there, locked by it.
inline constexpr const char* kUnfinished = kUnfinishedMarker;
/// The same file once the result is complete. It stays if it names files that are none of FolderKind.
inline constexpr const char* kFiles = kFilesMarker;

/// In an earlier result that waits in OUT.replaced: it distinguishes it from what a user has named so.
inline constexpr const char* kReplaced = ".plumbline-replaced";

/// A locked file; the lock ends with the object.
class FileLock {
 public:
  FileLock() = default;
  explicit FileLock(int descriptor) : descriptor_(descriptor) {}
  FileLock(FileLock&& other) noexcept : descriptor_(other.release()) {}
  FileLock& operator=(FileLock&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  ~FileLock();

  explicit operator bool() const { return descriptor_ >= 0; }
  [[nodiscard]] int release() { return std::exchange(descriptor_, -1); }

 private:
  int descriptor_ = -1;
};

bool has_marker(const std::filesystem::path& folder);

/// The locked marker of a folder, none if another run has locked it or there is none. `creates`: makes it.
FileLock lock_marker(const std::filesystem::path& folder, bool creates);

/// The content of a marker.
struct FolderNotes {
  core::FileNames files;  ///< besides those of FolderKind
  bool replaces = false;  ///< the user has asked to replace an earlier result
};
FolderNotes read_notes(const std::filesystem::path& folder);
/// Replaces the text of the marker that `descriptor` has locked. Error (kOutput), naming `folder`.
core::Result<void> write_notes(int descriptor, const std::filesystem::path& folder, const FolderNotes& notes);

/// Names of all files that belong to `folder`.
core::FileNames files_of(const std::filesystem::path& folder, const FolderKind& kind);

/// True if a run has finished the result in OUT.partial, but not renamed it.
bool is_complete(const std::filesystem::path& partial, const FolderKind& kind);

/// True for an earlier result that a run has moved away, complete or partly removed, and with no other files
/// in it.
bool is_replaced(const std::filesystem::path& folder, const FolderKind& kind);

/// Removes a folder's own files, and the folder if nothing else is in it. If this is interrupted, the marker
/// is left. Error (kOutput): something cannot be removed.
core::Result<void> discard(const std::filesystem::path& folder, const FolderKind& kind);

}  // namespace plumbline::maps
