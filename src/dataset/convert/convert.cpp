// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/convert.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <set>
#include <system_error>

#include "convert/copy_target.hpp"
#include "layout.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/own_files.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

/// Endings of recordings, archives and films, which are not written.
const std::set<std::string> kNotWritten{".bag", ".db3", ".mcap", ".zip", ".tar", ".gz",  ".tgz",
                                        ".7z",  ".rar", ".mp4",  ".mkv", ".avi", ".mov", ".r3d",
                                        ".oni", ".klg", ".svo",  ".txt", ".ply", ".pcd", ".yaml"};

core::Result<void> check_folder_name(const fs::path& out) {
  const std::string ending = core::ending_of(out.has_filename() ? out : out.parent_path());
  if (kNotWritten.count(ending) == 0) return {};
  return core::usage_error(
      fmt::format("{}: copies are a folder or a file that ends in .mcap; choose another name", out.string()));
}

/// First bytes of a file; fewer if it is shorter.
std::string beginning_of(const fs::path& file, std::size_t count) {
  std::string text(count, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(text.data(), static_cast<std::streamsize>(count));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  return text;
}

/// Files of a copy in a folder; its images are named by their stamps.
const core::FileNames kPartsOfACopy{"rgb/*.*", "depth/*.*", "camera.yaml", "groundtruth.txt",
                                    "associations.txt"};

/// The list of a copy that is being written (core::OutputFile).
bool is_unfinished_list(const fs::path& file) {
  return file.filename().string().rfind(".associations.txt.", 0) == 0;
}

/// True for "1305031102.175304000.png" and for its temporary file.
bool is_image_of_a_copy(const std::string& name) {
  constexpr std::size_t kDecimals = 9;
  const std::size_t begin = name.find_first_not_of(".-");
  const std::size_t point = name.find('.', begin);
  const std::size_t end = point == std::string::npos ? point : name.find('.', point + 1);
  return end != std::string::npos && end - point == kDecimals + 1 &&
         name.find_first_not_of(".0123456789", begin) > end;
}

/// True if the folder has no more in it than what a copy consists of, finished or not.
bool only_parts_of_a_copy(const fs::path& folder) {
  const std::vector<std::string> files = core::files_below(folder);
  return core::foreign_files(folder, kPartsOfACopy).empty() &&
         std::all_of(files.begin(), files.end(), [](const std::string& file) {
           const bool image = file.rfind("rgb/", 0) == 0 || file.rfind("depth/", 0) == 0;
           return !image || file.back() == '/' || is_image_of_a_copy(fs::path(file).filename().string());
         });
}

/// True if convert_recording() wrote the existing copy: no other recording may be replaced.
bool is_copy(const fs::path& there, bool file) {
  std::error_code ec;
  if (file) {
    constexpr std::size_t kHead = 64;  // the magic bytes, and the record with the maker
    const std::string head = beginning_of(there, kHead);
    return fs::is_regular_file(there, ec) && head.rfind("\x89MCAP", 0) == 0 &&
           head.find(kCopyMaker) != std::string::npos;
  }
  const std::string title = std::string(kCopyTitle) + "\n";
  return only_parts_of_a_copy(there) && beginning_of(there / "associations.txt", title.size()) == title;
}

/// Checks that nothing is at `out`, or an earlier copy that may be replaced.
core::Result<void> make_room(const fs::path& out, bool file, bool replace) {
  std::error_code ec;
  if (!fs::exists(out, ec)) return {};
  if (!file && fs::is_directory(out, ec) && fs::is_empty(out, ec)) return {};
  if (!is_copy(out, file)) {
    return core::usage_error(fmt::format(
        "{}: exists already and was not written by plumbline convert; choose another name (only copies that "
        "it wrote, with nothing else in them, are ever replaced)",
        out.string()));
  }
  if (replace) return {};
  return core::usage_error(fmt::format("{}: exists already; --force replaces an earlier copy", out.string()));
}

/// Removes what an interrupted copy left where the folder is first written, and nothing else.
core::Result<void> clear_leftover(const fs::path& partial, bool replace) {
  std::error_code ec;
  if (!fs::exists(partial, ec)) return {};
  const bool complete = is_copy(partial, false);

  // A complete copy is dropped only with --force
  if (complete && !replace) {
    return core::usage_error(fmt::format(
        "{}: holds a complete copy that was not moved to its place; rename it, or --force drops it",
        partial.string()));
  }

  // Folders that are not leftovers stay untouched
  const bool unfinished =
      std::any_of(fs::directory_iterator(partial, ec), fs::directory_iterator(),
                  [](const fs::directory_entry& entry) { return is_unfinished_list(entry.path()); });
  if (!complete && !(unfinished && only_parts_of_a_copy(partial)) && !fs::is_empty(partial, ec)) {
    return core::usage_error(
        fmt::format("{}: is in the way: the copy is first written there; move it or choose another name",
                    partial.string()));
  }
  return core::remove_own_files(partial, kPartsOfACopy);
}

/// Checks the place before a frame is read, and clears it of an interrupted copy.
core::Result<void> check_place(const fs::path& out, const fs::path& partial, bool file, bool replace) {
  if (!file) {
    if (auto fit = check_folder_name(out); !fit) return fit;
  }
  if (auto room = make_room(out, file, replace); !room) return room;
  return file ? core::check_writable(out) : clear_leftover(partial, replace);
}

/// Checks again that `out` may be written: it may have appeared while the copy was made. `written`: the place
/// of the copy, "" if it is not written yet.
core::Result<void> make_room_again(const fs::path& out, bool file, bool replace, const fs::path& written) {
  const auto room = make_room(out, file, replace);
  if (room) return {};
  const std::string where = written.empty() ? "the copy is not written"
                                            : fmt::format("the copy is complete in {}", written.string());
  return core::output_error(fmt::format("{}; {}", room.error().message, where));
}

/// Moves a folder, which was written next to its destination, there.
core::Result<void> put_in_place(const fs::path& written, const fs::path& out, bool replace) {
  if (auto room = make_room_again(out, false, replace, written); !room) return room;
  std::error_code problem;
  fs::path old = out.has_filename() ? out : out.parent_path();
  old += ".replaced";
  const bool replaces = fs::exists(out, problem) && !fs::is_empty(out, problem);
  if (replaces) fs::rename(out, old, problem);
  if (!problem) fs::rename(written, out, problem);
  if (!problem) return replaces ? core::remove_own_files(old, kPartsOfACopy) : core::Result<void>();
  return core::output_error(fmt::format("{}: cannot be written ({}); the copy is complete in {}",
                                        out.string(), problem.message(), written.string()));
}

/// Refuses images that a link brings into the recording's folder: others are not the recording's.
core::Result<void> check_links(const StoredPair& pair) {
  for (const StoredImage* image : {&pair.color, &pair.depth}) {
    if (!image->linked_out) continue;
    return core::input_error(
        fmt::format("{}: is behind a link that leads out of the recording's folder; put the file itself "
                    "there if it is to be copied",
                    image->name));
  }
  return {};
}

core::Result<ConvertSummary> copy_frames(const FrameSource& source, CopyTarget& target,
                                         const ConvertOptions& options, core::Log& log) {
  constexpr std::size_t kReportedOneByOne = 5;
  ConvertSummary summary;
  std::string first_error;
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (options.stop && options.stop()) {
      summary.stopped = true;
      break;
    }

    // Stamps as measured, without the delay of depth
    const PairInfo info = source.info(i);
    const auto pair = source.stored(i);
    core::Result<void> added;
    if (pair) added = check_links(*pair);
    if (pair && added) {
      added = target.add(nanoseconds(info.stamp),
                         nanoseconds(info.depth_stamp - source.camera().depth_delay_s), *pair);
    }

    // Unreadable frames are skipped; a full disk ends the copy
    const core::Error* problem = !pair ? &pair.error() : !added ? &added.error() : nullptr;
    if (problem != nullptr && problem->kind != core::ErrorKind::kInput) return tl::unexpected(*problem);
    if (problem == nullptr) {
      ++summary.written;
    } else if (summary.unreadable++ < kReportedOneByOne) {
      if (first_error.empty()) first_error = problem->message;
      log.warning(fmt::format("frame {} is left out: {}", i, problem->message));
    }

    // Unreadable frames count as progress, too
    if (options.progress) options.progress(i + 1);
  }

  // A copy needs at least one frame
  if (summary.written > 0) return summary;
  return core::input_error(
      fmt::format("{}: no frame can be copied; the first: {}", source.name(), first_error));
}

}  // namespace

std::int64_t nanoseconds(double seconds) {
  const std::int64_t rounded = 1000 * std::llroundl(static_cast<long double>(seconds) * 1e6L);
  if (seconds_of(rounded) == seconds) return rounded;
  return std::llroundl(static_cast<long double>(seconds) * 1e9L);
}

core::Result<ConvertSummary> convert_recording(const FrameSource& source, const fs::path& out,
                                               const ConvertOptions& options, core::Log& log) {
  const bool file = out.extension() == ".mcap";

  // The copy is moved to its place when complete
  fs::path folder = out.has_filename() ? out : out.parent_path();  // where it is first written
  folder += ".partial";
  if (auto free = check_place(out, folder, file, options.replace); !free) return tl::unexpected(free.error());
  auto target = file ? make_mcap_target(out, source.camera(), options.body, log)
                     : make_tum_target(folder, source.camera());
  if (!target) return tl::unexpected(target.error());

  auto summary = copy_frames(source, **target, options, log);
  core::Result<void> done;

  // The recorder's poses are not ground truth
  const bool odometry = source.truth_is_odometry();
  if (odometry)
    log.warning("the poses that the recorder kept are not in the copy: it is tracked without them");
  if (file && !odometry && source.truth())
    log.warning("the ground truth is not in the copy: a bag has no place for it; a folder has");
  if (summary && file) done = make_room_again(out, true, options.replace, "");
  if (summary && done) done = (*target)->finish(odometry ? std::nullopt : source.truth());

  // A failed copy leaves nothing
  if (!summary || !done) {
    target->reset();
    const auto removed = file ? core::Result<void>() : core::remove_own_files(folder, kPartsOfACopy);
    (void)removed;  // the next copy recognises what is left
    return tl::unexpected(summary ? done.error() : summary.error());
  }

  // A folder appears complete
  if (!file) done = put_in_place(folder, out, options.replace);
  if (!done) return tl::unexpected(done.error());
  return summary;
}

}  // namespace plumbline::dataset
