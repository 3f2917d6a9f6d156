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
#include "images/image_decoders.hpp"
#include "layout.hpp"
#include "plumbline/core/output_file.hpp"
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

/// The list of a copy that is being written (core::OutputFile).
bool is_unfinished_list(const fs::path& file) {
  return file.filename().string().rfind(".associations.txt.", 0) == 0;
}

/// True if the folder has no more in it than what a copy consists of, finished or not.
bool only_parts_of_a_copy(const fs::path& folder) {
  const std::set<std::string> parts{"rgb", "depth", "camera.yaml", "groundtruth.txt", "associations.txt"};
  std::error_code ec;
  for (fs::directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec)) {
    if (parts.count(it->path().filename().string()) == 0 && !is_unfinished_list(it->path())) return false;
  }
  return !ec;
}

/// True if convert_recording() wrote what is there: no other recording may be replaced.
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
core::Result<void> clear_leftover(const fs::path& partial) {
  std::error_code ec;
  if (!fs::exists(partial, ec)) return {};
  const bool unfinished =
      std::any_of(fs::directory_iterator(partial, ec), fs::directory_iterator(),
                  [](const fs::directory_entry& entry) { return is_unfinished_list(entry.path()); });
  if (!unfinished || !only_parts_of_a_copy(partial)) {
    return core::usage_error(
        fmt::format("{}: is in the way: the copy is first written there; move it or choose another name",
                    partial.string()));
  }
  fs::remove_all(partial, ec);
  return {};
}

/// Checks the place before a frame is read, and clears it of an interrupted copy.
core::Result<void> check_place(const fs::path& out, const fs::path& partial, bool file, bool replace) {
  if (!file) {
    if (auto fit = check_folder_name(out); !fit) return fit;
  }
  if (auto room = make_room(out, file, replace); !room) return room;
  return file ? core::check_writable(out) : clear_leftover(partial);
}

/// Moves a folder, which was written beside its destination, to it.
core::Result<void> put_in_place(const fs::path& written, const fs::path& out) {
  std::error_code problem;
  fs::remove_all(out, problem);
  if (!problem) fs::rename(written, out, problem);
  if (!problem) return {};
  return core::output_error(fmt::format("{}: cannot be written: {}", out.string(), problem.message()));
}

core::Result<ConvertSummary> copy_frames(const FrameSource& source, CopyTarget& target,
                                         const ConvertOptions& options) {
  ConvertSummary summary;
  std::string first_error;
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (options.stop && options.stop()) {
      summary.stopped = true;
      break;
    }

    const PairInfo info = source.info(i);
    const auto pair = source.stored(i);
    core::Result<void> added;
    if (pair) {
      added = target.add(nanoseconds(info.stamp),
                         nanoseconds(info.depth_stamp - source.camera().depth_delay_s), *pair);
    }

    const core::Error* problem = !pair ? &pair.error() : !added ? &added.error() : nullptr;
    if (problem != nullptr && problem->kind != core::ErrorKind::kInput) return tl::unexpected(*problem);
    if (problem != nullptr && summary.unreadable++ == 0) first_error = problem->message;
    if (problem == nullptr) ++summary.written;
    if (options.progress) options.progress(i + 1);
  }

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

core::Result<cv::Mat> pixels_of(const StoredImage& image) {
  if (image.ending.empty()) return image.pixels;
  if (image.bytes.empty()) return core::input_error("an empty image");
  auto decoded = is_png(image.bytes)    ? decode_png(image.bytes)
                 : is_jpeg(image.bytes) ? decode_jpeg(image.bytes)
                                        : decode_other(image.bytes);
  if (decoded) return std::move(*decoded);
  return core::input_error("a damaged image: " + decoded.error());
}

core::Result<ConvertSummary> convert_recording(const FrameSource& source, const fs::path& out,
                                               const ConvertOptions& options, core::Log& log) {
  const bool file = out.extension() == ".mcap";
  fs::path folder = out.has_filename() ? out : out.parent_path();  // where it is first written
  folder += ".partial";
  if (auto free = check_place(out, folder, file, options.replace); !free) return tl::unexpected(free.error());
  auto target = file ? make_mcap_target(out, source.camera(), log) : make_tum_target(folder, source.camera());
  if (!target) return tl::unexpected(target.error());

  auto summary = copy_frames(source, **target, options);
  core::Result<void> done;
  const bool odometry = source.truth_is_odometry();
  if (odometry)
    log.warning("the poses that the recorder kept are not in the copy: it is tracked without them");
  if (file && !odometry && source.truth())
    log.warning("the ground truth is not in the copy: a bag has no place for it; a folder has");
  if (summary) done = (*target)->finish(odometry ? std::nullopt : source.truth());
  if (summary && done && !file) done = put_in_place(folder, out);

  if (!summary || !done) {
    std::error_code ignored;
    if (!file) fs::remove_all(folder, ignored);
    return tl::unexpected(summary ? done.error() : summary.error());
  }

  return summary;
}

}  // namespace plumbline::dataset
