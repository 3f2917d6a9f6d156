// SPDX-License-Identifier: BSD-3-Clause
#include "results/folder_marker.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>

namespace plumbline::maps {
namespace {

namespace fs = std::filesystem;

const char* const kReplaces = "# replaces an earlier result";

bool is_file(const fs::path& file) {
  std::error_code ec;
  return fs::is_regular_file(fs::symlink_status(file, ec));
}

}  // namespace

FileLock::~FileLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

bool has_marker(const fs::path& folder) { return is_file(folder / kUnfinished) || is_file(folder / kFiles); }

FileLock lock_marker(const fs::path& folder, bool creates) {
  const auto opened = [&folder](const char* marker, int flags) {
    return open((folder / marker).c_str(), flags | O_CLOEXEC, 0644);
  };

  // The marker's name tells whether the run was complete
  int descriptor = opened(kUnfinished, O_RDWR);
  if (descriptor < 0) descriptor = opened(kFiles, O_RDWR);
  if (descriptor < 0) descriptor = opened(kUnfinished, O_RDONLY);  // a copy from a medium that is read-only
  if (descriptor < 0 && creates) descriptor = opened(kUnfinished, O_RDWR | O_CREAT);

  // Another run's lock is not waited for
  FileLock lock(descriptor);
  if (descriptor >= 0 && flock(descriptor, LOCK_EX | LOCK_NB) != 0) return {};
  return lock;
}

/// Notes of an unfinished or of a complete run.
FolderNotes read_notes(const fs::path& folder) {
  FolderNotes notes;
  for (const char* marker : {kUnfinished, kFiles}) {
    if (!is_file(folder / marker)) continue;
    std::ifstream in(folder / marker);
    for (std::string line; std::getline(in, line);) {
      if (line == kReplaces) notes.replaces = true;
      if (!line.empty() && line.front() != '#') notes.files.push_back(line);
    }
  }
  return notes;
}

core::Result<void> write_notes(int descriptor, const fs::path& folder, const FolderNotes& notes) {
  // One note per line; comments begin with #
  std::string text;
  if (notes.replaces) text += std::string(kReplaces) + "\n";
  if (!notes.files.empty()) text += "# Files of this folder whose names its user chose\n";
  for (const std::string& file : notes.files) text += file + "\n";

  struct stat now {};
  if (text.empty() && fstat(descriptor, &now) == 0 && now.st_size == 0)
    return {};  // even if the disk is full
  const auto size = static_cast<ssize_t>(text.size());
  if (ftruncate(descriptor, 0) == 0 && pwrite(descriptor, text.data(), text.size(), 0) == size) return {};
  return core::output_error(fmt::format("{}: cannot be written ({}); free space or choose another disk",
                                        folder.string(), std::strerror(errno)));
}

core::FileNames files_of(const fs::path& folder, const FolderKind& kind) {
  core::FileNames files = kind.files;
  const FolderNotes notes = read_notes(folder);
  files.insert(files.end(), notes.files.begin(), notes.files.end());
  files.insert(files.end(), {kUnfinished, kFiles, kReplaced});
  return files;
}

bool is_complete(const fs::path& partial, const FolderKind& kind) {
  return !is_file(partial / kUnfinished) && kind.is_earlier(partial);
}

bool is_replaced(const fs::path& folder, const FolderKind& kind) {
  return (is_file(folder / kUnfinished) || is_file(folder / kReplaced)) &&
         core::foreign_files(folder, files_of(folder, kind)).empty();
}

core::Result<void> discard(const fs::path& folder, const FolderKind& kind) {
  core::FileNames files = files_of(folder, kind);
  const auto lost = std::remove_if(files.begin(), files.end(), [](const std::string& file) {
    return file == kUnfinished || file == kFiles;
  });
  files.erase(lost, files.end());

  // The marker goes last, with the names that it holds.
  std::error_code ec;
  if (is_file(folder / kFiles)) fs::rename(folder / kFiles, folder / kUnfinished, ec);
  if (!is_file(folder / kUnfinished)) std::ofstream(folder / kUnfinished).flush();
  if (auto removed = core::remove_own_files(folder, files); !removed) return removed;
  fs::remove(folder / kUnfinished, ec);
  fs::remove(folder, ec);
  return {};
}

}  // namespace plumbline::maps
