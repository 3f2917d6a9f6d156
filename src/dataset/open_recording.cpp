// SPDX-License-Identifier: BSD-3-Clause
// How a recording on disk is opened: layout, camera, part of it, depth scale.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "depth_statistics.hpp"
#include "layout.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "plumbline/dataset/summary.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDepthSamples = 5;
// Structured light and time of flight measure hardly anything beyond; with millimetres taken for TUM's unit
// the median of a desk is still that of a room (1.3 m for 6.3 m), but its background lies far outside.
constexpr double kSensorReach_m = 10.0;
constexpr double kMaxShareBeyondReach = 0.1;

constexpr std::array<const char*, 3> kCameraFiles = {"camera.yaml", "camera_intrinsic.json",
                                                     "intrinsic.json"};

bool has_camera_file(const fs::path& folder) {
  std::error_code ignored;
  return std::any_of(kCameraFiles.begin(), kCameraFiles.end(),
                     [&](const char* name) { return fs::exists(folder / name, ignored); });
}

core::Result<sensor::Camera> choose_camera(const fs::path& folder, const OpenOptions& options) {
  if (options.known) return *options.known;
  if (!options.camera.empty()) return sensor::find_camera(options.camera, options.cameras_folder);
  std::error_code ignored;
  for (const char* name : kCameraFiles) {
    if (!fs::exists(folder / name, ignored)) continue;
    return name == kCameraFiles.front() ? sensor::read_camera(folder / name)
                                        : sensor::read_open3d_camera(folder / name);
  }
  return core::usage_error(
      fmt::format("{}: no camera.yaml in the folder; put one there or name a calibration with --camera "
                  "(shipped: tum_fr1, tum_fr2, tum_fr3, icl_nuim, seven_scenes; or a file)",
                  folder.string()));
}

/// Typical values of the devices that take images of this size, in the unit of depth that the layout's own
/// recordings have. Nothing better is known without a file.
std::optional<sensor::Camera> guessed_camera(const Layout& layout) {
  struct Device {
    const char* name;
    int width;
    int height;
    double focal_px;
  };
  constexpr std::array<Device, 4> kDevices = {{
      {"Kinect or Xtion", 640, 480, 525.0},  // as their drivers and 7-Scenes, TUM and Redwood assume
      {"RealSense D400", 1280, 720, 920.0},  // 69 x 42 degrees by its data sheet
      {"RealSense D400", 848, 480, 610.0},   // the same, scaled
      {"Kinect v2", 960, 540, 540.0},        // libfreenect2's default of 1081 px at 1920 x 1080, halved
  }};
  for (const PairInfo& pair : layout.pairs) {
    const auto image = read_image(pair.color_file);
    if (!image) continue;
    for (const Device& device : kDevices) {
      if (image->cols != device.width || image->rows != device.height) continue;
      sensor::Camera camera;
      camera.name = device.name;
      camera.color = {image->cols,
                      image->rows,
                      device.focal_px,
                      device.focal_px,
                      0.5 * (image->cols - 1),
                      0.5 * (image->rows - 1)};
      camera.depth_scale = layout.format == "tum" ? 5000.0 : 1000.0;
      camera.guess = true;
      return camera;
    }
    break;
  }
  return std::nullopt;
}

/// Looks one level down: a scene's folder is easily given in place of one of its sequences.
std::string recordings_inside(const fs::path& folder) {
  std::vector<std::string> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path& path = entry.path();
    if (!fs::is_directory(path, ignored)) continue;
    if (looks_like_tum(path) || looks_like_seven_scenes(path) || looks_like_redwood(path)) {
      found.push_back(path.string());
    }
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
  if (format == "tum" || (any && looks_like_tum(folder))) return read_tum(folder, options, log);
  if (format == "7scenes" || (any && looks_like_seven_scenes(folder))) {
    return read_seven_scenes(folder, options, log);
  }
  if (format == "redwood" || (any && looks_like_redwood(folder))) return read_redwood(folder, options, log);
  if (!any) {
    return core::usage_error(
        fmt::format("format '{}' is not known (allowed: auto, tum, 7scenes, redwood)", format));
  }
  const std::string inside = recordings_inside(folder);
  if (!inside.empty()) {
    return core::input_error(
        fmt::format("{}: holds no recording itself; give one of its folders: {}", folder.string(), inside));
  }
  std::error_code ignored;
  return core::input_error(fmt::format(
      "{}: {}; looked for associations.txt or rgb.txt and depth.txt (TUM), frame-000000.color.png "
      "(7-Scenes), color/ or image/ or rgb/ beside depth/ (Redwood, Open3D)",
      folder.string(), fs::is_empty(folder, ignored) ? "the folder is empty" : "no recording found"));
}

core::Result<void> select(const OpenOptions& options, const std::string& folder,
                          std::vector<PairInfo>& pairs) {
  if (options.every < 1) {
    return core::usage_error(fmt::format("every {} makes no sense (allowed: 1 and more)", options.every));
  }
  const double start = pairs.front().stamp;
  const double duration = pairs.back().stamp - start;
  std::vector<PairInfo> kept;
  std::size_t inside = 0;
  for (PairInfo& pair : pairs) {
    const double t = pair.stamp - start;
    if (!(t >= options.from_s && t <= options.to_s)) continue;
    if (inside++ % static_cast<std::size_t>(options.every) == 0) kept.push_back(std::move(pair));
  }
  if (kept.empty()) {
    return core::usage_error(
        fmt::format("{}: nothing lies between {} s and {} s: the recording is {:.2f} s long", folder,
                    options.from_s, options.to_s, duration));
  }
  pairs = std::move(kept);
  return {};
}

/// Depth of a few frames; of the first readable frame with depth when none of those can be used. Never
/// without a measurement.
core::Result<DepthStatistics> sample_depth(const FrameSource& source, const std::string& folder) {
  DepthStatistics statistics;
  bool readable = false;
  std::string first_error;
  const auto add = [&](std::size_t i) {
    if (const auto frame = source.read(i)) {
      readable = true;
      statistics.add(frame->depth);
    } else if (first_error.empty()) {
      first_error = frame.error().message;
    }
  };
  for (const std::size_t i : spread(source.size(), kDepthSamples)) add(i);
  for (std::size_t i = 0; i < source.size() && !statistics.median(); ++i) add(i);
  if (statistics.median()) return statistics;
  if (!readable) {
    return core::input_error(fmt::format("{}: none of the {} pairs can be read; the first: {}", folder,
                                         source.size(), first_error));
  }
  return core::input_error(
      fmt::format("{}: the depth images hold no measurement at all (raw 0 and 65535 are none)", folder));
}

core::Result<void> check_depth_scale(const FrameSource& source, const std::string& folder, core::Log& log) {
  const auto depth = sample_depth(source, folder);
  if (!depth) return tl::unexpected(depth.error());
  const auto median = depth->median();
  const double scale = source.camera().depth_scale;
  const double fit = fitting_depth_scale(*median * scale);
  const double beyond = depth->share_beyond(kSensorReach_m);
  const bool too_far = beyond > kMaxShareBeyondReach && fit > scale;
  if (*median >= 0.7 && *median <= 7.0 && !too_far) return {};
  const std::string what = fmt::format(
      "{}: with depth_scale {} the median depth is {:.4g} m; depth_scale {} would fit (median {:.2g} m)",
      folder, scale, *median, fit, *median * scale / fit);
  if (*median < 0.35 || *median > 20.0) return core::input_error(what + "; correct the camera file");
  log.warning(what + "; correct the camera file unless the scene is like that");
  return {};
}

}  // namespace

core::Result<std::unique_ptr<FrameSource>> open_recording(const fs::path& folder, const OpenOptions& options,
                                                          core::Log& log) {
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) {
    return core::input_error(
        fmt::format("{}: no such folder; give the folder of a recording", folder.string()));
  }
  if (!fs::is_directory(folder, ignored)) {
    return core::input_error(fmt::format("{}: is a file; give the recording's folder", folder.string()));
  }
  // A missing camera must not hide that there is no recording; a layout without stamps needs the camera's
  // fps.
  auto camera = choose_camera(folder, options);
  LayoutOptions layout_options;
  layout_options.max_pair_gap_s = options.max_pair_gap_s;
  if (camera) layout_options.fps = camera->fps;
  if (camera) layout_options.depth_delay_s = camera->depth_delay_s;
  auto layout = read_layout(folder, options.format, layout_options, log);
  if (!layout) return tl::unexpected(layout.error());
  const bool none_is_there = !camera && options.camera.empty() && !has_camera_file(folder);
  if (const auto guess = none_is_there ? guessed_camera(*layout) : std::nullopt) {
    log.warning(
        fmt::format("{}: no camera.yaml; taken for a {} by the size of its images, with fx = fy = {:g}: a "
                    "guess; put a camera.yaml there or name one with --camera",
                    folder.string(), guess->name, guess->color.fx));
    camera = *guess;
  }
  if (!camera) return tl::unexpected(camera.error());
  if (auto selected = select(options, folder.string(), layout->pairs); !selected)
    return tl::unexpected(selected.error());
  for (PairInfo& pair : layout->pairs) pair.depth_stamp += camera->depth_delay_s;

  fs::path place = fs::weakly_canonical(folder, ignored);  // "." and "room/" have names too
  if (place.filename().empty()) place = folder;
  auto source = make_folder_source(place.filename().string(), std::move(*layout), *camera);
  if (auto scale = check_depth_scale(*source, folder.string(), log); !scale)
    return tl::unexpected(scale.error());
  return source;
}

}  // namespace plumbline::dataset
