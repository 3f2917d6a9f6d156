// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/convert.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <system_error>

#include "convert/copy_target.hpp"
#include "images/image_decoders.hpp"
#include "layout.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

/// Checks that nothing is at `out`, or an earlier copy that may be replaced.
core::Result<void> make_room(const fs::path& out, bool file, bool replace) {
  std::error_code ignored;
  if (!fs::exists(out, ignored)) return {};
  if (!replace)
    return core::usage_error(
        fmt::format("{}: exists already; --force replaces an earlier copy", out.string()));
  const bool copy =
      file ? fs::is_regular_file(out, ignored)
           : fs::is_regular_file(out / "associations.txt", ignored) || fs::is_empty(out, ignored);
  if (copy) return {};
  return core::usage_error(
      fmt::format("{}: exists already and is not a copy of a recording; name another place", out.string()));
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
  if (auto room = make_room(out, file, options.replace); !room) return tl::unexpected(room.error());
  const fs::path folder = file ? fs::path() : fs::path(out.string() + ".partial");
  std::error_code ignored;
  if (!file) fs::remove_all(folder, ignored);
  auto target = file ? make_mcap_target(out, source.camera(), log) : make_tum_target(folder, source.camera());
  if (!target) return tl::unexpected(target.error());

  auto summary = copy_frames(source, **target, options);
  core::Result<void> done;
  const bool odometry = source.truth_is_odometry();
  if (odometry)
    log.warning("the poses that the recorder kept are not in the copy: it is tracked without them");
  if (summary) done = (*target)->finish(odometry ? std::nullopt : source.truth());
  if (summary && done && !file) done = put_in_place(folder, out);

  if (!summary || !done) {
    if (!file) fs::remove_all(folder, ignored);
    return tl::unexpected(summary ? done.error() : summary.error());
  }

  return summary;
}

}  // namespace plumbline::dataset
