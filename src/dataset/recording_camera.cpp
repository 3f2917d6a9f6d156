// SPDX-License-Identifier: BSD-3-Clause
#include "recording_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "plumbline/core/git_lfs.hpp"
#include "plumbline/dataset/summary.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxScannedBytes = 65536;  // of files that may be camera files by their content

/// Names of camera files in recordings' folders, in the order in which they are tried.
constexpr std::array<const char*, 16> kCameraFiles = {"camera.yaml",
                                                      "camera_intrinsic.json",
                                                      "intrinsic.json",
                                                      "calibration.txt",
                                                      "calib.txt",
                                                      "cameras.txt",
                                                      "cam_params.json",
                                                      "camera.txt",
                                                      "intrinsics.txt",
                                                      "intrinsic.txt",
                                                      "camera_matrix.csv",
                                                      "camera_matrix.txt",
                                                      "camera_intrinsics.txt",
                                                      "camera-intrinsics.txt",
                                                      "intrinsic/intrinsic_color.txt",
                                                      "../cam_params.json"};
constexpr std::size_t kMustBeCameras = 3;  // of these names; the others may be notes of any kind

/// YAML and JSON files of the folder that contain another program's camera; none if there are so many that
/// they are one for each image.
std::vector<fs::path> foreign_camera_files(const fs::path& folder) {
  constexpr std::size_t kFew = 32;
  std::vector<fs::path> candidates;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string ending = entry.path().extension().string();
    if (ending != ".yaml" && ending != ".yml" && ending != ".json") continue;
    std::error_code problem;
    const std::uintmax_t size = entry.file_size(problem);
    if (!problem && size <= kMaxScannedBytes) candidates.push_back(entry.path());
  }
  if (candidates.size() > kFew) return {};
  std::sort(candidates.begin(), candidates.end());
  std::vector<fs::path> found;
  for (const fs::path& file : candidates) {
    if (sensor::is_foreign_camera_file(file, false)) found.push_back(file);
  }
  return found;
}

core::Result<std::optional<fs::path>> find_camera_file(const fs::path& folder, core::Log& log) {
  std::error_code ignored;

  // Usual names, in order of preference
  for (std::size_t i = 0; i < kCameraFiles.size(); ++i) {
    const fs::path file = folder / kCameraFiles[i];
    if (!fs::exists(file, ignored)) continue;
    const bool must = i < kMustBeCameras || core::is_lfs_pointer(file);
    if (must || sensor::is_foreign_camera_file(file, true)) return file;
    log.warning(fmt::format("{}: is not a known camera file; it is not used", file.string()));
  }

  // Other programs choose the name freely
  const std::vector<fs::path> found = foreign_camera_files(folder);
  if (found.empty()) return std::nullopt;

  // Several files may describe the same camera
  const auto first = sensor::read_camera_file(found.front());
  for (const fs::path& file : found) {
    const auto reading = sensor::read_camera_file(file);
    if (!first || !reading || sensor::camera_lines(reading->camera) == sensor::camera_lines(first->camera))
      continue;
    return core::usage_error(
        fmt::format("{} and {} are both camera files, and they differ; name one with --camera",
                    found.front().string(), file.string()));
  }

  return found.front();
}

/// A 4x4 matrix in ScanNet's intrinsic/ folder as a motion; none if it is missing or not rigid.
geometry::Rigid3 scannet_extrinsic(const fs::path& file) {
  return is_file(file) ? read_pose_file(file.string()).value_or(geometry::Rigid3()) : geometry::Rigid3();
}

/// ScanNet has a separate calibration of depth; its size comes from the images.
core::Result<void> add_depth_camera(const fs::path& folder, sensor::Camera& camera) {
  const fs::path file = folder / "intrinsic_depth.txt";
  if (!is_file(file)) return {};
  const auto depth = sensor::read_camera_file(file);
  if (!depth) return tl::unexpected(depth.error());
  camera.depth = depth->camera.color;
  camera.color_from_depth = scannet_extrinsic(folder / "extrinsic_color.txt").inverse() *
                            scannet_extrinsic(folder / "extrinsic_depth.txt");
  return {};
}

/// Size of the first of these images that can be read.
std::optional<cv::Size> image_size(const Layout& layout, ImageId PairInfo::*image) {
  for (const PairInfo& pair : layout.pairs) {
    if (const auto read = layout.images->read(pair.*image)) return read->size();
  }
  return std::nullopt;
}

std::optional<cv::Size> color_size(const Layout& layout) { return image_size(layout, &PairInfo::color); }

double usual_depth_scale(const Layout& layout) { return layout.format == "tum" ? 5000.0 : 1000.0; }

/// Typical values of the devices that take images of this size, in the unit of depth that the layout's own
/// recordings have. Nothing better is known without a file.
std::optional<sensor::Camera> guessed_camera(const Layout& layout) {
  struct Device {
    const char* name;
    int width;
    int height;
    double focal_px;
  };

  // Usual devices by the size of colour
  constexpr std::array<Device, 4> kDevices = {{
      {"Kinect or Xtion", 640, 480, 525.0},  // as their drivers and 7-Scenes, TUM and Redwood assume
      {"RealSense D400", 1280, 720, 920.0},  // 69 x 42 degrees by its data sheet
      {"RealSense D400", 848, 480, 610.0},   // the same, scaled
      {"Kinect v2", 960, 540, 540.0},        // libfreenect2's default of 1081 px at 1920 x 1080, halved
  }};
  const auto size = color_size(layout);
  if (!size) return std::nullopt;

  for (const Device& device : kDevices) {
    if (*size != cv::Size(device.width, device.height)) continue;

    // Without calibration the principal point is the centre
    sensor::Camera camera;
    camera.name = device.name;
    camera.color = {size->width,
                    size->height,
                    device.focal_px,
                    device.focal_px,
                    0.5 * (size->width - 1),
                    0.5 * (size->height - 1)};

    // Depth in the usual unit of the layout
    camera.depth_scale = usual_depth_scale(layout);
    camera.guess = true;
    return camera;
  }

  return std::nullopt;
}

std::string distortion_text(const sensor::Camera& camera) {
  if (!camera.distorted()) return "no distortion";
  const sensor::Distortion& k = camera.distortion;
  if (camera.model == sensor::LensModel::kEquidistant)
    return fmt::format("equidistant (fisheye) k1 {:g} k2 {:g} k3 {:g} k4 {:g}", k[0], k[1], k[2], k[3]);

  // Higher terms only for lenses that have them
  const std::string more = k[5] != 0.0 || k[6] != 0.0 || k[7] != 0.0
                               ? fmt::format(" k4 {:g} k5 {:g} k6 {:g}", k[5], k[6], k[7])
                               : "";
  return fmt::format("distortion k1 {:g} k2 {:g} p1 {:g} p2 {:g} k3 {:g}{}", k[0], k[1], k[2], k[3], k[4],
                     more);
}

/// Text that says how the camera was interpreted and where each number comes from.
std::string understood(const ChosenCamera& chosen, const sensor::Camera& camera, const Layout& layout) {
  const sensor::CameraReading& reading = chosen.reading;
  const sensor::Pinhole& p = camera.color;
  std::string text = fmt::format("{}: camera{} of {}: fx {:g} fy {:g} cx {:g} cy {:g}, {}", chosen.file,
                                 chosen.of_layout ? "" : " file", reading.program, p.fx, p.fy, p.cx, p.cy,
                                 distortion_text(camera));
  text +=
      fmt::format("; size {}x{} {}", p.width, p.height, reading.has_size ? "(file)" : "(from the images)");
  text += fmt::format("; depth scale {:g} {}", camera.depth_scale,
                      reading.has_depth_scale && !chosen.of_layout
                          ? "(file)"
                          : fmt::format("(usual in the layout {})", layout.format));
  if (camera.depth) text += fmt::format("; depth camera {}x{}", camera.depth->width, camera.depth->height);
  for (const std::string& note : reading.notes) text += "; " + note;
  return text;
}

/// If depth has another size it is scaled up to that of colour; colour is first reduced by a whole factor, to
/// at most 960 pixels across.
void reduce_color(sensor::Camera& camera) {
  constexpr int kWidest = 960;
  sensor::Pinhole& color = camera.color;
  if (!camera.depth || camera.depth->width == color.width) return;
  for (int factor = 2; color.width > kWidest && factor <= 16; ++factor) {
    const bool whole = color.width % factor == 0 && color.height % factor == 0;
    if (whole && color.width / factor <= kWidest)
      color = color.resized(color.width / factor, color.height / factor);
  }
}

core::Result<cv::Size> size_in(const Layout& layout, ImageId PairInfo::*image) {
  if (const auto size = image_size(layout, image)) return *size;

  // The first image's error stands for all
  const ImageId first = layout.pairs.front().*image;
  const auto read = layout.images->read(first);
  return core::input_error(fmt::format("{}; no {} image can be read to tell its size, and this is the first",
                                       read ? "" : read.error().message,
                                       first.list == ImageList::kDepth ? "depth" : "colour"));
}

/// Sizes that the camera file lacks, from the images.
core::Result<void> add_sizes(const ChosenCamera& chosen, const Layout& layout, sensor::Camera& camera) {
  if (!chosen.reading.has_size) {
    const auto size = size_in(layout, &PairInfo::color);
    if (!size) return tl::unexpected(size.error());
    camera.color.width = size->width;
    camera.color.height = size->height;
  }
  if (!camera.depth || camera.depth->width != 0) return {};
  const auto size = size_in(layout, &PairInfo::depth);
  if (!size) return tl::unexpected(size.error());
  camera.depth->width = size->width;
  camera.depth->height = size->height;
  return {};
}

/// The most frequent size of a few images, spread over the recording; none if none can be read.
std::optional<cv::Size> usual_size(const Layout& layout, ImageId PairInfo::*image) {
  constexpr std::size_t kLookedAt = 5;
  std::vector<cv::Size> sizes;
  for (const std::size_t i : spread(layout.pairs.size(), kLookedAt)) {
    if (const auto read = layout.images->read(layout.pairs[i].*image)) sizes.push_back(read->size());
  }
  const auto count = [&](const cv::Size& size) { return std::count(sizes.begin(), sizes.end(), size); };
  const auto most = std::max_element(sizes.begin(), sizes.end(),
                                     [&](const auto& a, const auto& b) { return count(a) < count(b); });
  return most == sizes.end() ? std::nullopt : std::optional(*most);
}

/// If colour and depth differ in size but not in shape, and the camera is that of one of them, it is scaled
/// to the other.
void share_calibration(const Layout& layout, sensor::Camera& camera) {
  constexpr double kSameShape = 0.01;
  if (camera.depth) return;
  const auto color = usual_size(layout, &PairInfo::color);
  const auto depth = usual_size(layout, &PairInfo::depth);
  if (!color || !depth || *color == *depth) return;
  const double shape = static_cast<double>(color->width) * depth->height;
  if (std::abs(static_cast<double>(depth->width) * color->height / shape - 1.0) > kSameShape) return;
  const cv::Size own(camera.color.width, camera.color.height);
  if (own != *color && own != *depth) return;
  const sensor::Pinhole pinhole = camera.color;
  camera.color = pinhole.resized(color->width, color->height);
  camera.depth = pinhole.resized(depth->width, depth->height);
  camera.depth_lens = camera.lens();
  camera.color_from_depth = geometry::Rigid3();
}

/// Scales a camera that, according to the layout, may be that of images of another size.
void scale_to_images(const Layout& layout, sensor::Camera& camera) {
  const auto color = usual_size(layout, &PairInfo::color);
  if (!color || color->width == camera.color.width) return;
  if (color->width * camera.color.height != color->height * camera.color.width) return;
  camera.color = camera.color.resized(color->width, color->height);
}

core::Result<sensor::Camera> guess(const fs::path& folder, const Layout& layout, core::Log& log) {
  if (const auto size = size_in(layout, &PairInfo::color); !size) return tl::unexpected(size.error());
  const auto camera = guessed_camera(layout);
  const bool has_place = is_folder(folder);  // for a camera.yaml; bags and live cameras have none
  if (!camera) {
    return core::usage_error(fmt::format(
        "{}: no {}name a calibration with --camera "
        "(shipped: tum_fr1, tum_fr2, tum_fr3, icl_nuim, seven_scenes; or a file, also of another program)",
        folder.string(),
        has_place ? "camera.yaml in the folder; put one there or " : "calibration of its camera; "));
  }

  // The guess is reported with its remedy
  std::string text = fmt::format(
      "{}: no {}; its images have the size of a {}, so fx = fy = {:g} is guessed; {}name one with --camera",
      folder.string(), has_place ? "camera.yaml" : "calibration of its camera", camera->name,
      camera->color.fx, has_place ? "put a camera.yaml there or " : "");

  // The original depth of 7-Scenes is not registered
  if (layout.format == "7scenes") {
    text +=
        "; 7-Scenes as it is published has depth that is not registered to colour: --camera seven_scenes "
        "registers it";
  }

  log.warning(text);
  return *camera;
}

}  // namespace

core::Result<std::optional<ChosenCamera>> choose_camera(const fs::path& folder, const OpenOptions& options,
                                                        core::Log& log) {
  // The user's choice comes first
  if (!options.camera.empty()) {
    auto reading = sensor::find_camera(options.camera, options.cameras_folder);
    if (!reading) return tl::unexpected(reading.error());
    return ChosenCamera{std::move(*reading), options.camera};
  }

  // Only a folder can hold a camera file
  if (!is_folder(folder)) return std::nullopt;
  const auto file = find_camera_file(folder, log);
  if (!file) return tl::unexpected(file.error());
  if (!*file) return std::nullopt;
  auto reading = sensor::read_camera_file(**file);
  if (!reading) return tl::unexpected(reading.error());

  // ScanNet keeps the depth camera in another file
  if ((*file)->filename() == "intrinsic_color.txt") {
    if (auto added = add_depth_camera((*file)->parent_path(), reading->camera); !added)
      return tl::unexpected(added.error());
  }
  return ChosenCamera{std::move(*reading), (**file).string()};
}

int stored_reduction(const Layout& layout, const sensor::Camera& camera) {
  const auto size = camera.depth ? color_size(layout) : std::nullopt;
  if (!size) return 1;

  // Colour may be stored larger by a whole factor
  const int factor = size->width / camera.color.width;
  const bool whole =
      size->width == factor * camera.color.width && size->height == factor * camera.color.height;
  return whole ? std::max(factor, 1) : 1;
}

core::Result<sensor::Camera> complete_camera(const fs::path& folder, const std::optional<ChosenCamera>& given,
                                             Layout& layout, core::Log& log) {
  // Option or camera file, the recording's camera, a guess
  std::optional<ChosenCamera> chosen = given;
  if (!chosen && layout.camera) chosen = ChosenCamera{*layout.camera, folder.string(), true};
  if (!chosen) return guess(folder, layout, log);

  // A given camera replaces those of single frames
  if (!chosen->of_layout) {
    layout.frame_cameras.clear();
    for (PairInfo& pair : layout.pairs) pair.camera = -1;
  }

  // Foreign files may lack sizes and the depth scale
  sensor::Camera camera = chosen->reading.camera;
  const bool foreign = !chosen->reading.program.empty();  // our own is complete, and checked
  if (foreign) {
    if (auto sized = add_sizes(*chosen, layout, camera); !sized) return tl::unexpected(sized.error());
    if (!chosen->reading.has_depth_scale) camera.depth_scale = usual_depth_scale(layout);
    if (chosen->of_layout) scale_to_images(layout, camera);
    if (const std::string wrong = sensor::camera_problem(camera); !wrong.empty())
      return core::usage_error(fmt::format("{}: {}", chosen->file, wrong));
  }

  share_calibration(layout, camera);
  if (foreign) log.info(understood(*chosen, camera, layout));

  const int full_width = camera.color.width;
  reduce_color(camera);
  if (camera.color.width < full_width) {
    log.info(fmt::format("{}: colour is reduced to {}x{}, and depth of {}x{} is scaled up to that",
                         folder.string(), camera.color.width, camera.color.height, camera.depth->width,
                         camera.depth->height));
  }
  return camera;
}

}  // namespace plumbline::dataset
