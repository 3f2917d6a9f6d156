// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/output_folder.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <system_error>
#include <utility>

#include "results/folder_marker.hpp"

namespace plumbline::maps {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMegabyte = 1'000'000;
constexpr std::uintmax_t kLeastFreeMb = 64;

fs::path with_ending(const fs::path& folder, const char* ending) {
  fs::path path = folder;
  path += ending;
  return path;
}
fs::path replaced_of(const fs::path& target) { return with_ending(target, ".replaced"); }

/// Absolute, without "." or a trailing slash, links followed: what can be renamed.
fs::path normal(const fs::path& out) {
  std::error_code ec;
  fs::path path = fs::weakly_canonical(fs::absolute(out), ec);
  if (ec) path = fs::absolute(out).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

bool is_there(const fs::path& folder) {
  std::error_code ec;
  return fs::exists(fs::symlink_status(folder, ec)) &&
         !(fs::is_directory(folder, ec) && fs::is_empty(folder, ec));
}

/// Checks that nothing is at the target, or what may be replaced.
core::Result<void> check_target(const fs::path& target, bool replace, const FolderKind& kind) {
  // A free name needs no check
  std::error_code ec;
  if (!is_there(target)) return {};
  if (!fs::is_directory(target, ec)) {
    return core::usage_error(
        fmt::format("{}: is a file; name a folder that does not exist yet", target.string()));
  }

  // A foreign folder is never replaced
  if (!kind.is_earlier(target)) {
    return core::usage_error(fmt::format(
        "{}: exists, is not empty and is not an earlier result; name a folder that does not exist "
        "yet (only earlier results are ever replaced)",
        target.string()));
  }

  // Replacing an earlier result must be demanded
  if (!replace) {
    return core::usage_error(fmt::format(
        "{}: holds an earlier result; name another folder or add --force to replace it", target.string()));
  }

  // Files of the user must not be lost
  const auto foreign = core::foreign_files(target, files_of(target, kind));
  if (foreign.empty()) return {};
  return core::usage_error(
      fmt::format("{}: holds files that are not of the earlier result and would be lost with it: {}; move "
                  "them elsewhere, or name another folder",
                  target.string(), core::list_of_files(foreign)));
}

/// Checks that the earlier result at `target` can be moved to OUT.replaced.
core::Result<void> check_replaced(const fs::path& target, const FolderKind& kind) {
  const fs::path old = replaced_of(target);
  if (!is_there(target) || !is_there(old) || is_replaced(old, kind)) return {};
  return core::usage_error(
      fmt::format("{}: is in the way: the earlier result waits there while it is replaced; move it elsewhere",
                  old.string()));
}

tl::unexpected<core::Error> another_run(const fs::path& partial) {
  return core::usage_error(
      fmt::format("{}: another run is writing there; wait or name another output folder", partial.string()));
}

/// Locks the OUT.partial of an earlier run, if it has a marker. Error: another run is active, or the folder
/// is somebody else's.
core::Result<FileLock> lock_leftover(const fs::path& partial, const FolderKind& kind) {
  if (!is_there(partial)) return FileLock();
  FileLock lock = lock_marker(partial, false);
  if (!lock && has_marker(partial)) return another_run(partial);
  if (!lock && !kind.is_earlier(partial)) {
    return core::usage_error(fmt::format(
        "{}: is in the way: results are first written there; move it or name another output folder",
        partial.string()));
  }
  return lock;
}

/// True if an interrupted run has left a map, or a hub those of robots.
bool holds_map(const fs::path& partial) {
  std::error_code ec;
  const fs::path robots = partial / "robots";
  return fs::exists(partial / "map.db", ec) || (fs::is_directory(robots, ec) && !fs::is_empty(robots, ec));
}

/// Removes the remains of an interrupted run, and nothing else; its map or complete result only with
/// `replace`.
core::Result<void> clear_leftover(const fs::path& target, const fs::path& partial, bool replace,
                                  const FolderKind& kind) {
  // A complete result awaits only its renaming
  if (!is_there(partial)) return {};
  if (!replace && is_complete(partial, kind)) {
    return core::usage_error(fmt::format(
        "{}: holds a complete result; its run was ended before that was renamed to {}. Rename it, "
        "or --resume does (map, hub, robot); --force drops it",
        partial.string(), target.filename().string()));
  }

  // An interrupted run's map can be continued
  if (!replace && holds_map(partial)) {
    return core::usage_error(
        fmt::format("{}: holds the map of an interrupted run; --resume continues it, --force drops it",
                    partial.string()));
  }

  // Files of the user must not be lost
  const auto foreign = core::foreign_files(partial, files_of(partial, kind));
  if (!foreign.empty()) {
    return core::usage_error(
        fmt::format("{}: holds files that are not of the interrupted run: {}; move them "
                    "elsewhere, or name another output folder",
                    partial.string(), core::list_of_files(foreign)));
  }
  return discard(partial, kind);
}

/// Moves an earlier result back that was waiting to be replaced when its run was killed.
void put_back(const fs::path& target, const fs::path& partial, const FolderKind& kind) {
  const fs::path old = replaced_of(target);
  std::error_code ec;
  const bool waits = fs::exists(old / kReplaced, ec) || is_complete(partial, kind);
  if (is_there(target) || !waits || !kind.is_earlier(old) || fs::exists(old / kUnfinished, ec)) return;
  fs::rename(old, target, ec);
  fs::remove(target / kReplaced, ec);
}

/// Removes the marker of a complete result, unless it is needed to recognise its files.
void drop_marker(const fs::path& target, const FolderKind& kind) {
  std::error_code ignored;
  if (!kind.stays_marked && read_notes(target).files.empty()) fs::remove(target / kFiles, ignored);
}

/// Removes the earlier result that a run has replaced.
void drop_replaced(const fs::path& target, const FolderKind& kind) {
  const fs::path old = replaced_of(target);
  std::error_code not_empty;
  if (!is_replaced(old, kind)) {
    if (!is_there(old)) fs::remove(old, not_empty);  // the end of a removal that was interrupted
    return;
  }

  const auto dropped = discard(old, kind);
  (void)dropped;  // the next run that replaces the result tries it again
}

/// The reason why a result cannot be moved to its target, and where it is instead.
core::Error not_moved(const core::Error& why, const fs::path& target, const fs::path& partial) {
  return {core::ErrorKind::kOutput,
          fmt::format("{}. The complete result is in {}: when {} is free, rename it to that", why.message,
                      partial.string(), target.string())};
}

}  // namespace

OutputFolder::OutputFolder(fs::path target, int lock, bool replace, const FolderKind& kind)
    : target_(std::move(target)),
      partial_(with_ending(target_, ".partial")),
      lock_(lock),
      replace_(replace),
      kind_(&kind) {}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : target_(std::move(other.target_)),
      partial_(std::exchange(other.partial_, {})),
      lock_(std::exchange(other.lock_, -1)),
      replace_(other.replace_),
      kind_(other.kind_),
      kept_(other.kept_) {}

OutputFolder::~OutputFolder() {
  if (!partial_.empty() && !kept_ && check_there()) {
    const auto discarded = discard(partial_, *kind_);
    (void)discarded;  // what cannot be removed is recognised by its marker
  }
  if (lock_ >= 0) close(lock_);
}

fs::path OutputFolder::partial_of(const fs::path& out) { return with_ending(normal(out), ".partial"); }

core::Result<OutputFolder> OutputFolder::prepare(const fs::path& out, bool replace, bool takes_over,
                                                 const FolderKind& kind) {
  if (out.empty()) return core::usage_error("the output folder has no name");
  const fs::path target = normal(out);
  const fs::path partial = with_ending(target, ".partial");

  // While this is locked no other run moves anything.
  auto leftover = lock_leftover(partial, kind);
  if (!leftover) return tl::unexpected(leftover.error());
  if (takes_over && is_complete(partial, kind) && read_notes(partial).replaces) replace = true;
  if (!takes_over || !is_complete(partial, kind)) put_back(target, partial, kind);

  auto free = check_target(target, replace, kind);
  if (free) free = check_replaced(target, kind);
  if (free && !takes_over) free = clear_leftover(target, partial, replace, kind);
  if (!free) return tl::unexpected(free.error());
  return begin(target, takes_over ? std::move(*leftover) : FileLock(), replace, takes_over, kind);
}

core::Result<OutputFolder> OutputFolder::begin(const fs::path& target, FileLock lock, bool replace,
                                               bool takes_over, const FolderKind& kind) {
  // The run writes beside its target
  const fs::path partial = with_ending(target, ".partial");
  std::error_code ec;
  fs::create_directories(partial, ec);
  if (ec) {
    return core::output_error(fmt::format("{}: cannot be created ({}); name a folder where you may write",
                                          target.string(), ec.message()));
  }

  // A taken-over folder counts as unfinished again
  if (fs::exists(partial / kFiles, ec)) fs::rename(partial / kFiles, partial / kUnfinished, ec);
  if (!lock) lock = lock_marker(partial, true);
  if (!lock) {
    if (has_marker(partial)) return another_run(partial);  // it began a moment before this one
    return core::output_error(
        fmt::format("{}: cannot be written; name a folder where you may write", target.string()));
  }

  OutputFolder folder(target, lock.release(), replace, kind);
  folder.kept_ = takes_over;  // whatever follows: what is there already is somebody's map

  // A full disk is reported before the work
  const fs::space_info space = fs::space(partial, ec);
  if (!ec && space.available < kLeastFreeMb * kMegabyte) {
    return core::output_error(fmt::format("{}: only {} MB are free there; at least {} MB are needed",
                                          target.string(), space.available / kMegabyte, kLeastFreeMb));
  }
  return folder;
}

core::Result<bool> OutputFolder::finish(const fs::path& out, bool replace, const FolderKind& kind) {
  const fs::path target = normal(out);
  const fs::path partial = with_ending(target, ".partial");

  // The renaming was done, perhaps not the tidying
  if (!is_there(partial)) {
    if (!kind.is_earlier(target)) return false;
    drop_marker(target, kind);
    drop_replaced(target, kind);
    return true;
  }

  // The rest of an interrupted put_in_place()
  auto lock = lock_leftover(partial, kind);
  if (!lock || !is_complete(partial, kind)) return false;  // prepare() tells why
  OutputFolder folder(target, lock->release(), replace || read_notes(partial).replaces, kind);
  folder.kept_ = true;
  if (auto placed = folder.put_in_place(); !placed) return tl::unexpected(placed.error());
  return true;
}

core::Result<void> OutputFolder::expect(const core::FileNames& files) {
  // Names beyond those of every run are noted
  FolderNotes notes = read_notes(partial_);
  for (const std::string& file : files) {
    const bool known = core::is_own_file(file, kind_->files) || fs::path(file).is_absolute();
    if (!known) notes.files.push_back(file);
  }
  return write_notes(lock_, partial_, notes);
}

core::Result<void> OutputFolder::check_there() const {
  // The folder still has the inode that was locked
  struct stat locked {};
  if (lock_ < 0 || fstat(lock_, &locked) != 0) return {};
  for (const char* marker : {kUnfinished, kFiles}) {
    struct stat found {};
    if (lstat((partial_ / marker).c_str(), &found) == 0 && found.st_dev == locked.st_dev &&
        found.st_ino == locked.st_ino)
      return {};
  }
  return core::output_error(
      fmt::format("{}: was removed or moved away while the run was writing there; start the run again, and "
                  "leave that folder alone until it is renamed to {}",
                  partial_.string(), target_.filename().string()));
}

core::Error OutputFolder::explained(const core::Error& error) const {
  const auto there = check_there();
  return there ? error : there.error();
}

core::Result<void> OutputFolder::mark_complete() {
  // The user's own files, for a later --force
  FolderNotes notes;
  notes.replaces = replace_;
  const core::FileNames all = files_of(partial_, *kind_);
  for (const std::string& file : core::files_below(partial_)) {
    const bool marker = file.rfind(".plumbline-", 0) == 0;
    if (!marker && core::is_own_file(file, all) && !core::is_own_file(file, kind_->files))
      notes.files.push_back(file);
  }
  if (auto noted = write_notes(lock_, partial_, notes); !noted) return noted;

  // The marker's name is the sign of completeness
  std::error_code ec;
  fs::rename(partial_ / kUnfinished, partial_ / kFiles, ec);
  if (!ec) return {};
  return core::output_error(fmt::format("{}: cannot be written ({})", partial_.string(), ec.message()));
}

core::Result<void> OutputFolder::commit() {
  if (auto there = check_there(); !there) return there;
  kept_ = true;
  if (auto marked = mark_complete(); !marked) return marked;
  return put_in_place();
}

core::Result<void> OutputFolder::put_in_place() {
  // The target may have changed during the run
  auto free = check_target(target_, replace_, *kind_);
  if (free) free = check_replaced(target_, *kind_);
  if (!free) return tl::unexpected(not_moved(free.error(), target_, partial_));

  // The earlier result steps aside, marked as replaced
  std::error_code ec;
  const bool replaces = is_there(target_);
  const fs::path old = replaced_of(target_);
  if (replaces) {
    drop_replaced(target_, *kind_);
    std::ofstream(target_ / kReplaced).flush();
    fs::rename(target_, old, ec);
  }

  // Two renames, undone if the second fails
  if (!ec) fs::rename(partial_, target_, ec);
  if (ec) {
    std::error_code ignored;
    if (replaces && !is_there(target_)) fs::rename(old, target_, ignored);
    if (replaces) fs::remove(target_ / kReplaced, ignored);
    const std::string why = fmt::format("{}: cannot be written ({})", target_.string(), ec.message());
    return tl::unexpected(not_moved({core::ErrorKind::kOutput, why}, target_, partial_));
  }

  // The result is in place; leftovers may go
  partial_.clear();
  drop_marker(target_, *kind_);
  drop_replaced(target_, *kind_);
  return {};
}

}  // namespace plumbline::maps
