// SPDX-License-Identifier: BSD-3-Clause
// Opening a recording on disk: layout, camera, selected part, depth scale.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "bags/bag_recording.hpp"
#include "body/body_tables.hpp"
#include "depth_check.hpp"
#include "frame_images.hpp"
#include "layout.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/recording_poses.hpp"
#include "plumbline/dataset/selection.hpp"
#include "plumbline/dataset/summary.hpp"
#include "recording_camera.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

/// Recordings one level down: a scene's folder is easily given instead of one of its sequences.
std::string recordings_inside(const fs::path& folder) {
  std::vector<std::string> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path& path = entry.path();
    if (layout_of(path) != nullptr) found.push_back(path.string());
  }

  std::sort(found.begin(), found.end());
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(found.size(), 3); ++i)
    text += (i > 0 ? ", " : "") + found[i];
  if (found.size() > 3) text += fmt::format(" and {} more", found.size() - 3);
  return text;
}

core::Result<Layout> read_layout(const fs::path& folder, const std::string& format,
                                 const LayoutOptions& options, core::Log& log) {
  const bool any = format.empty() || format == "auto";

  // A named format is not guessed
  for (const LayoutFormat* known : layout_formats()) {
    if (!any && format == known->name) return known->read(folder, options, log);
  }
  if (!any) {
    return core::usage_error(
        fmt::format("format '{}' is not known (allowed: {})", format, fmt::join(layout_names(), ", ")));
  }

  // Without a name the files tell the layout
  if (const LayoutFormat* found = layout_of(folder)) return found->read(folder, options, log);

  // The folder may hold several recordings
  const std::string inside = recordings_inside(folder);
  if (!inside.empty()) {
    return core::input_error(
        fmt::format("{}: holds no recording itself; give one of its folders: {}", folder.string(), inside));
  }
  return core::input_error(not_a_recording(folder));
}

/// Bags are recognised by their content; `--format` applies to folders only.
core::Result<Layout> read_any(const fs::path& path, const OpenOptions& open, const LayoutOptions& options,
                              core::Log& log) {
  const bool any = open.format.empty() || open.format == "auto";
  if (any && is_bag(path)) return read_bag(path, open.topics, options, log);
  if (open.topics.any()) {
    return core::usage_error(
        fmt::format("{}: is not a bag, and --topic is for bags only; leave it out", path.string()));
  }
  if (!is_folder(path) && layout_of(path) == nullptr) return core::input_error(not_a_recording_file(path));
  return read_layout(path, open.format, options, log);
}

/// Rounds stamps to whole nanoseconds, like those of messages, so that copies of a recording have the same
/// stamps.
void round_stamps(std::vector<PairInfo>& pairs) {
  constexpr double kMost_s = 9e9;  // above this, nanoseconds do not fit into 64 bits
  for (PairInfo& pair : pairs) {
    for (double* stamp : {&pair.stamp, &pair.depth_stamp}) {
      if (std::abs(*stamp) < kMost_s)
        *stamp = seconds_of(std::llroundl(static_cast<long double>(*stamp) * 1e9L));
    }
  }
}

/// Keeps only the first of several frames with the same stamp in microseconds, the unit of written
/// trajectories: their poses could not be distinguished there. Pairs are sorted by stamp.
void drop_same_stamps(const std::string& folder, Layout& layout, core::Log& log) {
  std::vector<PairInfo>& pairs = layout.pairs;
  const auto microseconds = [](const PairInfo& pair) { return std::llrint(pair.stamp * 1e6); };
  const auto same = [&](const PairInfo& a, const PairInfo& b) { return microseconds(a) == microseconds(b); };
  const auto first = std::adjacent_find(pairs.begin(), pairs.end(), same);
  if (first == pairs.end()) return;

  const double stamp = first->stamp;
  const std::string dropped = layout.images->describe((first + 1)->color);
  const auto end = std::unique(pairs.begin(), pairs.end(), same);
  log.warning(fmt::format(
      "{}: {} of {} frames have the stamp of the frame before and are dropped (the first at {:.6f}: {})",
      folder, pairs.end() - end, pairs.size(), stamp, dropped));
  pairs.erase(end, pairs.end());
}

/// The frames that a recording names, with those that exist.
struct ListedFrames {
  std::vector<double> stamps;
  std::vector<std::optional<std::size_t>> places;  ///< among the layout's pairs; none: a file is missing
};

/// The first of a pair's files that does not exist; "": both do, or all images are in one file.
std::string missing_file(const Layout& layout, const PairInfo& pair) {
  for (const ImageId id : {pair.color, pair.depth}) {
    const fs::path file = layout.images->file(id);
    std::error_code ignored;
    if (!file.empty() && fs::status(file, ignored).type() == fs::file_type::not_found) return file.string();
  }
  return "";
}

/// Leaves out the pairs whose files do not exist, with a warning. Error (kInput): no pair is left.
core::Result<ListedFrames> leave_out_missing(const std::string& folder, Layout& layout, core::Log& log) {
  ListedFrames listed;
  std::vector<PairInfo> there;
  std::string first;

  // Numbers of the listed frames among those that exist.
  for (PairInfo& pair : layout.pairs) {
    listed.stamps.push_back(pair.stamp);
    const std::string missing = missing_file(layout, pair);
    listed.places.push_back(missing.empty() ? std::optional(there.size()) : std::nullopt);
    if (missing.empty()) there.push_back(std::move(pair));
    if (first.empty()) first = missing;
  }

  // At least one frame must be complete
  const std::size_t all = layout.pairs.size();
  layout.pairs = std::move(there);
  if (layout.pairs.empty()) {
    return core::input_error(fmt::format(
        "{}: none of its {} frames has both its files; the first that is missing: {}", folder, all, first));
  }

  // Frames without both files are reported
  if (layout.pairs.size() < all) {
    log.warning(
        fmt::format("{}: {} of {} frames are missing and left out: their files do not exist (the first: {})",
                    folder, all - layout.pairs.size(), all, first));
  }
  return listed;
}

/// Keeps the part that the options name, of all frames that are listed; those of it that are missing are
/// counted.
core::Result<void> select(const OpenOptions& options, const std::string& folder, const ListedFrames& listed,
                          Layout& layout) {
  const auto selected = selected_frames(folder, listed.stamps, options);
  if (!selected) return tl::unexpected(selected.error());
  std::vector<PairInfo> kept;
  for (const std::size_t i : *selected) {
    if (listed.places[i]) kept.push_back(std::move(layout.pairs[*listed.places[i]]));
  }

  layout.missing = selected->size() - kept.size();
  if (kept.empty()) {
    return core::input_error(
        fmt::format("{}: the files of all {} frames that --from, --to and --every name are missing", folder,
                    selected->size()));
  }
  layout.pairs = std::move(kept);
  return {};
}

/// True for the folder of a result, also of an interrupted run, and for its map.db.
bool is_result(const fs::path& path) {
  return path.filename() == "map.db" || is_file(path / "map.db") ||
         (is_file(path / "summary.json") && is_file(path / "config.yaml"));
}

/// Name of a recording: a folder's name, or a bag's without its extensions.
std::string name_of(const fs::path& place, const fs::path& given) {
  const fs::path named = place.filename().empty() ? given : place;
  if (is_folder(named)) return named.filename().string();
  fs::path name = named.filename();
  if (name.extension() == ".zstd") name = name.stem();
  return name.stem().string();
}

}  // namespace

bool is_recording_file(const fs::path& file) {
  return is_file(file) && (layout_of(file) != nullptr || file.extension() == ".r3d");
}

core::Result<TrajectoryReading> recording_poses(const fs::path& folder, core::Log& log) {
  // Numbered layouts need the camera's rate
  const auto chosen = choose_camera(folder, {}, log);
  LayoutOptions options;
  if (chosen && *chosen) options.fps = (*chosen)->reading.camera.fps;

  auto layout = read_layout(folder, "auto", options, log);
  if (!layout) return tl::unexpected(layout.error());
  if (!layout->truth || layout->truth->empty()) {
    return core::input_error(
        fmt::format("{}: is a recording ({}) without poses", folder.string(), layout->format));
  }

  TrajectoryReading reading;
  reading.poses = std::move(*layout->truth);
  reading.format = layout->format;

  for (const geometry::StampedPose& pose : reading.poses) reading.rows.push_back(pose.stamp);

  // Odometry must not pass for ground truth
  if (layout->truth_is_odometry) {
    reading.notes.push_back(
        fmt::format("the {} poses to compare with are those of the recorder's own odometry, not ground truth",
                    reading.poses.size()));
  }

  return reading;
}

namespace {

/// The frames that a recording lists, and what else it says, with the tables of a body beside it.
core::Result<Layout> read_with_body(const fs::path& folder, const OpenOptions& options,
                                    const LayoutOptions& layout_options, core::Log& log) {
  auto layout = read_any(folder, options, layout_options, log);
  if (!layout && is_result(folder)) {
    return core::input_error(fmt::format(
        "{}: is a result of plumbline map, not a recording; give the recording that it was made of",
        folder.string()));
  }
  if (!layout) return layout;

  layout->folder = folder;
  if (layout_options.body && layout->body == nullptr && is_folder(folder))
    layout->body = read_body_tables(folder, !layout->truth_is_odometry, log);
  return layout;
}

}  // namespace

core::Result<std::unique_ptr<FrameSource>> open_recording(const fs::path& folder, const OpenOptions& options,
                                                          core::Log& log) {
  if (folder.empty()) return core::usage_error("the path of the recording is empty");
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) {
    return core::input_error(
        fmt::format("{}: no such folder or file; give the folder of a recording, or a bag", folder.string()));
  }

  // A missing camera must not hide that there is no recording; a layout without stamps needs the camera's
  // fps.
  const auto chosen = choose_camera(folder, options, log);
  LayoutOptions layout_options;
  layout_options.max_pair_gap_s = options.max_pair_gap_s;
  layout_options.body = options.poses == PoseUse::kPrior;

  if (chosen && *chosen) {
    layout_options.fps = (*chosen)->reading.camera.fps;
    layout_options.depth_delay_s = (*chosen)->reading.camera.depth_delay_s;
  }

  // The frames that the recording lists, and its other data
  auto layout = read_with_body(folder, options, layout_options, log);
  if (!layout) return tl::unexpected(layout.error());

  // Frames with different stamps, whose files exist
  round_stamps(layout->pairs);
  drop_same_stamps(folder.string(), *layout, log);
  const auto listed = leave_out_missing(folder.string(), *layout, log);
  if (!listed) return tl::unexpected(listed.error());
  if (!chosen) return tl::unexpected(chosen.error());

  // The camera, from its file, the layout or the images.
  auto camera = complete_camera(folder, *chosen, *layout, log);
  if (!camera) return tl::unexpected(camera.error());
  if (auto likely = check_focal_lengths(*camera, folder.string()); !likely)
    return tl::unexpected(likely.error());
  layout->color_reduction = stored_reduction(*layout, *camera);
  layout->gives_odometry = layout->truth_is_odometry && options.poses == PoseUse::kPrior;
  if (auto kinds = check_image_kinds(*layout, *camera, log); !kinds) return tl::unexpected(kinds.error());

  if (auto selected = select(options, folder.string(), *listed, *layout); !selected)
    return tl::unexpected(selected.error());

  for (PairInfo& pair : layout->pairs) pair.depth_stamp += camera->depth_delay_s;

  const fs::path place = fs::weakly_canonical(folder, ignored);  // gives "." and "room/" a name
  const std::string name = name_of(place, folder);
  auto source = make_folder_source(name, *layout, *camera);

  // Depth whose unit is unlikely makes any map doubtful.
  const auto scale = check_depth_scale(*source, folder.string());
  if (!scale) return tl::unexpected(scale.error());
  if (!scale->text.empty()) log.warning(scale->text);
  if (!scale->doubted) return source;
  return make_folder_source(name, std::move(*layout), *camera, scale->text);
}

}  // namespace plumbline::dataset
