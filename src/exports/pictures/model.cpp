// SPDX-License-Identifier: BSD-3-Clause
#include "pictures/model.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <unordered_map>

#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/image_io.hpp"

namespace plumbline::exports {
namespace {

/// Mean colours of the dense cloud in cells.
class ColorCells {
 public:
  explicit ColorCells(const cloud::CloudFile& file) {
    for (const cloud::Point& p : *file.cloud) {
      Cell& cell = cells_[key_of(p.getVector3fMap().cast<double>())];
      cell.sum += Eigen::Vector3d(p.r, p.g, p.b);
      ++cell.count;
    }
  }
  /// Mean colour of the cells around a position; grey if there is no cloud.
  [[nodiscard]] std::array<std::uint8_t, 3> at(const Eigen::Vector3d& place) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (int reach = 0; reach <= 1 && count == 0; ++reach) {
      for (int i = 0; i < 27; ++i) {
        const Eigen::Vector3d step = Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1).cast<double>();
        if (reach == 0 && !step.isZero()) continue;
        const auto found = cells_.find(key_of(place + kCell_m * step));
        if (found == cells_.end()) continue;
        sum += found->second.sum;
        count += found->second.count;
      }
    }
    if (count == 0) return {128, 128, 128};
    const auto channel = [&](int k) { return static_cast<std::uint8_t>(std::lround(sum[k] / count)); };
    return {channel(0), channel(1), channel(2)};
  }

 private:
  static constexpr double kCell_m = 0.03;
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
  };
  /// 21 bits an axis: cells that share a key are 60 km apart.
  static std::uint64_t key_of(const Eigen::Vector3d& place) {
    constexpr std::uint64_t kMask = (std::uint64_t{1} << 21U) - 1U;
    std::uint64_t key = 0;
    for (int k = 0; k < 3; ++k)
      key = key << 21U | (static_cast<std::uint64_t>(std::llround(std::floor(place[k] / kCell_m))) & kMask);
    return key;
  }
  std::unordered_map<std::uint64_t, Cell> cells_;
};

/// Distance in the picture between a feature and the projection of its landmark, pixels.
double distance_px(const MapSource& source, const maps::Map& map, const ExportPose& pose, int feature,
                   const Eigen::Vector3d& position) {
  const auto& seen = map.keyframe(pose.keyframe).features->points[static_cast<std::size_t>(feature)];
  const Eigen::Vector3d at = pose.world_from_camera.inverse() * position;
  return (pinhole_of(source, pose.robot).project(at) - seen.pixel.cast<double>()).norm();
}

/// Keeps the observations that fit: other programs would trust those that the map's adjustment treats as
/// outliers.
void keep_what_fits(const MapSource& source, const maps::Map& map, const std::vector<Picture>& pictures,
                    ModelPoint& point) {
  constexpr double kMost_px = 3.0;  // in the picture of the corner's octave
  constexpr double kOctave = 1.2;
  std::vector<ModelPoint::Sight> fitting;
  double sum = 0.0;
  for (const ModelPoint::Sight& sight : point.track) {
    const ExportPose& pose = pictures[sight.picture].pose;
    const auto& seen = map.keyframe(pose.keyframe).features->points[static_cast<std::size_t>(sight.feature)];
    const double off = distance_px(source, map, pose, sight.feature, point.position);
    if (off > kMost_px * std::pow(kOctave, seen.octave)) continue;
    fitting.push_back(sight);
    sum += off;
  }
  point.track = std::move(fitting);
  point.error_px = point.track.empty() ? 0.0 : sum / static_cast<double>(point.track.size());
}

/// Depth as 16-bit millimetres; values out of range become 0.
cv::Mat in_millimetres(const cv::Mat& depth_m) {
  constexpr float kMost_m = 65.5F;
  cv::Mat result(depth_m.size(), CV_16UC1, cv::Scalar(0));
  for (int y = 0; y < depth_m.rows; ++y) {
    const auto* from = depth_m.ptr<float>(y);
    auto* to = result.ptr<std::uint16_t>(y);
    for (int x = 0; x < depth_m.cols; ++x) {
      if (from[x] > 0.0F && from[x] < kMost_m)
        to[x] = static_cast<std::uint16_t>(std::lround(1e3F * from[x]));
    }
  }
  return result;
}

}  // namespace

sensor::Pinhole pinhole_of(const MapSource& source, std::int32_t robot) {
  return maps::camera_of(source.robots(), robot).color;
}

/// Landmarks with their tracks in the pictures.
core::Result<std::vector<ModelPoint>> landmark_points(MapSource& source,
                                                      const std::vector<Picture>& pictures) {
  const auto store = source.store("landmarks");
  if (!store) return tl::unexpected(store.error());

  // Pictures of keyframes
  const maps::Map& map = (*store)->stored().map;
  std::map<core::KeyframeId, std::size_t> picture_of;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (pictures[i].pose.keyframe.valid()) picture_of[pictures[i].pose.keyframe] = i;
  }

  // Landmarks have no colour, the cloud has
  const auto cloud = source.cloud();
  cloud::CloudFile none;
  none.cloud = std::make_shared<cloud::Cloud>();
  const ColorCells colors(cloud ? **cloud : none);

  // Landmarks of one observation are not certain
  std::vector<ModelPoint> points;
  for (const core::PointId id : map.point_ids()) {
    const maps::MapPoint& landmark = map.point(id);
    ModelPoint point;
    point.position = source.world_from_map() * landmark.position;
    if (landmark.observations.size() < 2 || !source.selects(point.position)) continue;

    // Observations in pictures of the model
    for (const maps::Observation& observation : landmark.observations) {
      const auto picture = picture_of.find(observation.keyframe);
      if (picture != picture_of.end()) point.track.push_back({picture->second, observation.feature});
    }

    // Outliers are removed from tracks
    const bool seen = point.track.size() >= 2;  // otherwise the model has too few of its keyframes
    keep_what_fits(source, map, pictures, point);
    if (seen && point.track.size() < 2) continue;

    if (!seen) point.track.clear();
    point.color = colors.at(point.position);
    points.push_back(std::move(point));
  }

  return points;
}

/// Points of the cloud, evenly taken, without tracks.
core::Result<std::vector<ModelPoint>> dense_points(MapSource& source, int count) {
  const auto file = source.cloud();
  if (!file) return tl::unexpected(file.error());
  const std::size_t size = (*file)->cloud->size();
  const std::size_t wanted = std::min(size, static_cast<std::size_t>(count));
  std::vector<ModelPoint> points;
  for (std::size_t i = 0; i < wanted; ++i) {
    const cloud::Point& p = (*(*file)->cloud)[i * size / wanted];
    ModelPoint point;
    point.position = p.getVector3fMap().cast<double>() + (*file)->shift;
    point.color = {p.r, p.g, p.b};
    points.push_back(std::move(point));
  }
  return points;
}

core::Result<std::vector<ModelPoint>> model_points(MapSource& source, const std::vector<Picture>& pictures) {
  const int dense = source.options().dense_points;
  return dense > 0 ? dense_points(source, dense) : landmark_points(source, pictures);
}

/// Writes the pictures as PNG, and depth if it is wanted and known.
core::Result<void> write_pictures(const MapSource& source, const Pictures& recordings,
                                  std::vector<Picture>& pictures, const std::filesystem::path& folder,
                                  bool depth, ExportSummary& summary) {
  if (auto made = core::make_folder(folder / "images"); !made) return made;
  if (depth && !recordings.stored()) {
    if (auto made = core::make_folder(folder / "depth"); !made) return made;
  }

  // Pictures are written in parallel, block by block
  constexpr std::size_t kAtOnce = 16;  // for progress reports and bounded memory
  std::vector<core::Result<void>> written(pictures.size());
  std::vector<std::string> lost(pictures.size());
  for (std::size_t first = 0; first < pictures.size(); first += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, pictures.size() - first);
    source.executor().parallel_for(count, [&](std::size_t k) {
      const std::size_t i = first + k;
      if (!pictures[i].frame) return;

      // Damaged pictures are reported at the end
      const auto frame = recordings.read(pictures[i].pose.robot, *pictures[i].frame);
      if (!frame) {
        lost[i] = frame.error().message;
        return;
      }

      // Depth has the name of its colour image
      const std::string file = pictures[i].name + ".png";
      written[i] = dataset::write_png(folder / "images" / file, frame->color);
      if (written[i] && depth && !recordings.stored())
        written[i] = dataset::write_png(folder / "depth" / file, in_millimetres(frame->depth));
    });
    source.progress(first + count, pictures.size());
  }

  // The first failure is reported, whatever the threads' order
  std::size_t missing = 0;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!written[i]) return written[i];
    if (!lost[i].empty()) pictures[i].frame.reset();
    if (!pictures[i].frame) ++missing;
  }

  // Notes about what is missing
  if (depth && recordings.stored())
    summary.notes.push_back(
        "without depth images: the map keeps colour only; name the recording with --recording");
  if (missing > 0) {
    summary.notes.push_back(
        fmt::format("{} of {} poses have no picture in the recording", missing, pictures.size()));
  }

  return {};
}

}  // namespace plumbline::exports
