// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/output_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <system_error>
#include <utility>

namespace plumbline::maps {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMegabyte = 1'000'000;
constexpr std::uintmax_t kLeastFreeMb = 64;
/// File in every OUT.partial, locked by its run: it distinguishes the remains of an interrupted run from
/// anything else, and from a run that is still active.
const char* const kMarker = ".plumbline-unfinished";

fs::path with_ending(const fs::path& folder, const char* ending) {
  fs::path path = folder;
  path += ending;
  return path;
}

/// Absolute, without "." or a trailing slash, links followed: what can be renamed.
fs::path normal(const fs::path& out) {
  std::error_code ec;
  fs::path path = fs::weakly_canonical(fs::absolute(out), ec);
  if (ec) path = fs::absolute(out).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

core::Result<void> check_target(const fs::path& target, bool replace, OutputFolder::IsEarlier is_earlier) {
  std::error_code ec;
  if (!fs::exists(target, ec)) return {};
  if (!fs::is_directory(target, ec)) {
    return core::usage_error(
        fmt::format("{}: is a file; name a folder that does not exist yet", target.string()));
  }

  if (fs::is_empty(target, ec)) return {};
  if (!is_earlier(target)) {
    return core::usage_error(fmt::format(
        "{}: exists, is not empty and is not an earlier result; name a folder that does not exist "
        "yet (only earlier results are ever replaced)",
        target.string()));
  }

  if (!replace) {
    return core::usage_error(fmt::format(
        "{}: holds an earlier result; name another folder or add --force to replace it", target.string()));
  }

  return {};
}

/// Descriptor of the locked marker, -1 when it cannot be had.
int lock_marker(const fs::path& partial, int flags) {
  const int descriptor = open((partial / kMarker).c_str(), flags | O_CLOEXEC, 0644);
  if (descriptor < 0) return -1;
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  close(descriptor);
  return -1;
}

tl::unexpected<core::Error> another_run(const fs::path& partial) {
  return core::usage_error(
      fmt::format("{}: another run is writing there; wait or name another output folder", partial.string()));
}

/// True if an interrupted run has left a map, or a hub those of robots.
bool holds_map(const fs::path& partial) {
  std::error_code ec;
  const fs::path robots = partial / "robots";
  return fs::exists(partial / "map.db", ec) || (fs::is_directory(robots, ec) && !fs::is_empty(robots, ec));
}

/// Removes the remains of an interrupted run, and nothing else; its map only with `replace`. With
/// `takes_over` only checks that they are such.
core::Result<void> clear_leftover(const fs::path& partial, bool replace, bool takes_over) {
  std::error_code ec;
  if (!fs::exists(partial, ec)) return {};
  if (!fs::is_empty(partial, ec) && !fs::exists(partial / kMarker, ec)) {
    return core::usage_error(fmt::format(
        "{}: is in the way: results are first written there; remove it or name another output folder",
        partial.string()));
  }
  if (takes_over) return {};

  const int lock = lock_marker(partial, O_RDONLY);
  if (lock < 0 && !fs::is_empty(partial, ec)) return another_run(partial);
  if (!replace && holds_map(partial)) {
    if (lock >= 0) close(lock);
    return core::usage_error(
        fmt::format("{}: holds the map of an interrupted run; --resume continues it, --force drops it",
                    partial.string()));
  }

  fs::remove_all(partial, ec);
  if (lock >= 0) close(lock);
  if (ec)
    return core::output_error(fmt::format("{}: cannot be removed ({})", partial.string(), ec.message()));
  return {};
}

}  // namespace

bool is_result_folder(const fs::path& folder) {
  std::error_code ec;
  return fs::is_regular_file(folder / "summary.json", ec) && fs::is_regular_file(folder / "config.yaml", ec);
}

OutputFolder::OutputFolder(fs::path target, fs::path partial, int lock, IsEarlier is_earlier)
    : target_(std::move(target)), partial_(std::move(partial)), lock_(lock), is_earlier_(is_earlier) {}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : target_(std::move(other.target_)),
      partial_(std::exchange(other.partial_, {})),
      lock_(std::exchange(other.lock_, -1)),
      is_earlier_(other.is_earlier_),
      kept_(other.kept_) {}

OutputFolder::~OutputFolder() {
  if (!partial_.empty() && !kept_) {
    std::error_code ignored;
    fs::remove_all(partial_, ignored);
  }
  if (lock_ >= 0) close(lock_);
}

fs::path OutputFolder::partial_of(const fs::path& out) { return with_ending(normal(out), ".partial"); }

core::Result<OutputFolder> OutputFolder::prepare(const fs::path& out, bool replace, bool takes_over,
                                                 IsEarlier is_earlier) {
  if (out.empty()) return core::usage_error("the output folder has no name");
  const fs::path target = normal(out);
  if (auto checked = check_target(target, replace, is_earlier); !checked)
    return tl::unexpected(checked.error());

  const fs::path partial = with_ending(target, ".partial");
  if (auto cleared = clear_leftover(partial, replace, takes_over); !cleared)
    return tl::unexpected(cleared.error());

  std::error_code ec;
  fs::create_directories(partial, ec);
  if (ec) {
    return core::output_error(fmt::format("{}: cannot be created ({}); name a folder where you may write",
                                          target.string(), ec.message()));
  }

  const int lock = lock_marker(partial, O_CREAT | O_WRONLY);
  if (lock < 0) {
    std::error_code gone;
    if (fs::exists(partial / kMarker, gone))
      return another_run(partial);  // it began a moment before this one
    return core::output_error(
        fmt::format("{}: cannot be written; name a folder where you may write", target.string()));
  }

  OutputFolder folder(target, partial, lock, is_earlier);
  const fs::space_info space = fs::space(partial, ec);
  if (!ec && space.available < kLeastFreeMb * kMegabyte) {
    return core::output_error(fmt::format("{}: only {} MB are free there; at least {} MB are needed",
                                          target.string(), space.available / kMegabyte, kLeastFreeMb));
  }

  folder.kept_ = takes_over;
  return folder;
}

core::Result<void> OutputFolder::commit() {
  std::error_code ec;
  fs::remove(partial_ / kMarker, ec);
  const fs::path old = with_ending(target_, ".replaced");

  const bool replaces = fs::exists(target_, ec) && !fs::is_empty(target_, ec);
  if (replaces) {
    if (is_earlier_(old)) fs::remove_all(old, ec);
    fs::rename(target_, old, ec);
    if (ec)
      return core::output_error(fmt::format("{}: cannot be replaced ({})", target_.string(), ec.message()));
  }

  fs::rename(partial_, target_, ec);
  if (ec) {
    std::error_code ignored;
    if (replaces) fs::rename(old, target_, ignored);
    return core::output_error(fmt::format("{}: cannot be created ({})", target_.string(), ec.message()));
  }

  partial_.clear();
  if (replaces) fs::remove_all(old, ec);
  return {};
}

}  // namespace plumbline::maps
