// SPDX-License-Identifier: BSD-3-Clause
// Record3D's export as EXR and JPEG (a phone with LiDAR): rgb/0.jpg, depth/0.exr in float metres, and
// metadata.json with K (column by column), w, h, fps, poses (qx qy qz qw tx ty tz of ARKit's transform), and
// in later versions frameTimestamps and perFrameIntrinsicCoeffs (fx fy cx cy).
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "layout.hpp"
#include "plumbline/core/json.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

/// The folder of the export: that was given, or EXR_RGBD/ in it.
fs::path export_folder(const fs::path& folder) {
  return is_folder(folder / "EXR_RGBD") ? folder / "EXR_RGBD" : folder;
}

bool looks_like_record3d(const fs::path& folder) {
  const fs::path place = export_folder(folder);
  return is_file(place / "metadata.json") && is_folder(place / "rgb") && is_folder(place / "depth");
}

/// Finite numbers of an array; none if it is not an array or holds anything else.
template <std::size_t kCount>
std::optional<std::array<double, kCount>> numbers_of_array(const json& array) {
  std::array<double, kCount> numbers{};
  if (!array.is_array() || array.size() != kCount) return std::nullopt;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (!array[i].is_number()) return std::nullopt;
    numbers[i] = array[i].get<double>();
    if (!std::isfinite(numbers[i])) return std::nullopt;
  }
  return numbers;
}

/// The element of an array under a key; null when there is none.
const json& element(const json& metadata, const char* key, long long number) {
  static const json nothing;
  const auto found = metadata.find(key);
  if (found == metadata.end() || !found->is_array()) return nothing;
  return number >= 0 && static_cast<std::size_t>(number) < found->size()
             ? (*found)[static_cast<std::size_t>(number)]
             : nothing;
}

std::optional<geometry::Rigid3> record3d_pose(const json& row) {
  const auto n = numbers_of_array<7>(row);
  if (!n) return std::nullopt;
  const Eigen::Quaterniond q((*n)[3], (*n)[0], (*n)[1], (*n)[2]);
  if (std::abs(q.norm() - 1.0) > 0.01) return std::nullopt;
  return from_arkit(geometry::Rigid3(q, {(*n)[4], (*n)[5], (*n)[6]}));
}

core::Result<sensor::CameraReading> record3d_camera(const fs::path& file, const json& metadata) {
  // A camera needs K and the image's size
  const auto k =
      metadata.is_object() && metadata.contains("K") ? numbers_of_array<9>(metadata["K"]) : std::nullopt;
  const auto width = json_number(metadata, "w");
  const auto height = json_number(metadata, "h");
  if (!k || !width || !height) {
    return core::input_error(
        fmt::format("{}: no metadata of Record3D: needed are K (9 numbers), w and h", file.string()));
  }

  sensor::CameraReading reading;
  reading.program = "Record3D (metadata.json)";

  // K is stored column by column
  sensor::Camera& camera = reading.camera;
  camera.name = "record3d";
  camera.color = {static_cast<int>(std::clamp(*width, 0.0, 1e5)),
                  static_cast<int>(std::clamp(*height, 0.0, 1e5)),
                  (*k)[0],
                  (*k)[4],
                  (*k)[6],
                  (*k)[7]};
  camera.fps = json_number(metadata, "fps").value_or(30.0);

  // Implausible numbers are reported, not used
  if (const std::string wrong = sensor::camera_problem(camera); !wrong.empty())
    return core::input_error(fmt::format("{}: {}", file.string(), wrong));
  return reading;
}

/// Adds each frame's own pinhole, if the lens focused and metadata.json has the values.
void add_record3d_cameras(const json& metadata, const sensor::Pinhole& nominal, const NumberedFiles& color,
                          Layout& layout) {
  std::vector<sensor::Pinhole> cameras;
  for (const PairInfo& pair : layout.pairs) {
    const long long number = color[pair.color.number].first;
    const auto n = numbers_of_array<4>(element(metadata, "perFrameIntrinsicCoeffs", number));
    if (!n) return;
    sensor::Camera camera;
    camera.color = {nominal.width, nominal.height, (*n)[0], (*n)[1], (*n)[2], (*n)[3]};
    if (!sensor::camera_problem(camera).empty()) return;
    cameras.push_back(camera.color);
  }
  layout.frame_cameras = std::move(cameras);
  for (std::size_t i = 0; i < layout.pairs.size(); ++i) layout.pairs[i].camera = static_cast<int>(i);
}

core::Result<Layout> read_record3d(const fs::path& folder, const LayoutOptions& /*options*/, core::Log& log) {
  const fs::path place = export_folder(folder);
  const auto read = core::read_json(place / "metadata.json");
  if (!read) return tl::unexpected(read.error());
  const json& metadata = *read;
  auto camera = record3d_camera(place / "metadata.json", metadata);
  if (!camera) return tl::unexpected(camera.error());

  // Images with one number are a pair.
  const auto color = numbered_images(place / "rgb");
  const auto depth = numbered_images(place / "depth");
  Layout layout = numbered_layout("record3d", color, depth, camera->camera.fps);
  if (layout.pairs.empty()) {
    return core::input_error(fmt::format("{}: no number is in both rgb/ ({} images) and depth/ ({})",
                                         place.string(), color.size(), depth.size()));
  }

  geometry::Trajectory poses;
  std::size_t without = 0;

  // Stamps and poses of the phone, by number.
  for (PairInfo& pair : layout.pairs) {
    const long long number = color[pair.color.number].first;
    const json& stamp = element(metadata, "frameTimestamps", number);
    if (stamp.is_number() && std::isfinite(stamp.get<double>()))
      pair.stamp = pair.depth_stamp = stamp.get<double>();

    // Frames without a pose are counted
    if (const auto pose = record3d_pose(element(metadata, "poses", number))) {
      poses.push_back({pair.stamp, *pose});
    } else {
      ++without;
    }
  }

  // Numbers need not be in the order of time
  const auto earlier = [](const auto& a, const auto& b) { return a.stamp < b.stamp; };
  std::stable_sort(layout.pairs.begin(), layout.pairs.end(), earlier);
  std::stable_sort(poses.begin(), poses.end(), earlier);
  if (without > 0)
    log.warning(fmt::format("{}: {} frames have no pose there", (place / "metadata.json").string(), without));

  add_record3d_cameras(metadata, camera->camera.color, color, layout);
  layout.camera = std::move(*camera);

  const fs::path confidence = place / "confidence";
  if (is_folder(confidence)) layout.confidence = confidence.string();

  // The phone's poses are odometry, not ground truth
  if (!poses.empty()) {
    layout.truth = std::move(poses);
    layout.truth_is_odometry = true;
  }

  return layout;
}

}  // namespace

const LayoutFormat& record3d_layout() {
  static const LayoutFormat format = {"record3d",
                                      "Record3D's export as EXR and JPEG",
                                      "metadata.json beside rgb/ and depth/",
                                      {"rgb/", "depth/", "metadata.json"},
                                      &looks_like_record3d,
                                      &read_record3d};
  return format;
}

}  // namespace plumbline::dataset
