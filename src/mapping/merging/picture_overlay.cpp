// SPDX-License-Identifier: BSD-3-Clause
#include "merging/picture_overlay.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr int kBlock = 8;             // pixels of a thumbnail
constexpr double kLeastFilled = 0.6;  // of the pixels of a block that both pictures show
constexpr double kPictureCell_m = 0.3;
constexpr double kLeastContrast = 4.0;  // standard deviation of grey values, of 255
constexpr double kPictureNoise = 1.5;
constexpr double kLeastDepth_m = 0.4;
constexpr double kMostDepth_m = 5.0;

/// A keyframe's small picture and how to find its pixels.
struct Picture {
  const cv::Mat* grey;
  const cv::Mat* depth;
  sensor::Pinhole camera;
  double scale;  ///< pixels of the picture in one of the camera
  Rigid3 camera_from_world;
};

std::vector<Picture> pictures_of(const MapPart& part) {
  std::vector<Picture> pictures;
  for (const KeyframeId id : part.map->keyframe_ids()) {
    const auto& features = part.map->keyframe(id).features;
    if (features == nullptr || features->thumbnail.empty() || features->thumbnail_depth.empty()) continue;
    const sensor::Pinhole& camera = part.cameras.at(id.robot);
    pictures.push_back({&features->thumbnail, &features->thumbnail_depth, camera,
                        static_cast<double>(features->thumbnail.cols) / camera.width,
                        part.map->camera_from_world(id)});
  }
  return pictures;
}

/// Grey value at a point in the camera's frame; none where the picture shows something else.
std::optional<double> grey_at(const Picture& picture, const Eigen::Vector3d& point) {
  if (point.z() < kLeastDepth_m) return {};
  const Eigen::Vector2d pixel = picture.camera.project(point) * picture.scale - Eigen::Vector2d(0.5, 0.5);
  const int x = static_cast<int>(std::floor(pixel.x()));
  const int y = static_cast<int>(std::floor(pixel.y()));
  if (x < 0 || y < 0 || x + 1 >= picture.grey->cols || y + 1 >= picture.grey->rows) return {};

  // A different depth shows that something hides the point or that it is not there.
  const double z = static_cast<double>(picture.depth->at<float>(static_cast<int>(std::lround(pixel.y())),
                                                                static_cast<int>(std::lround(pixel.x()))));
  const double tolerance = 0.06 + 3.0 * sensor::depth_sigma(point.z());
  if (z <= 0.0 || std::abs(z - point.z()) > tolerance) return {};

  // Bilinear interpolation, because the error of the nearest pixel would lower the
  // correlation of such small pictures.
  const double right = pixel.x() - x;
  const double below = pixel.y() - y;
  const float* top = picture.grey->ptr<float>(y) + x;
  const float* low = picture.grey->ptr<float>(y + 1) + x;
  const auto mix = [&](const float* row) {
    return (1.0 - right) * static_cast<double>(row[0]) + right * static_cast<double>(row[1]);
  };
  return (1.0 - below) * mix(top) + below * mix(low);
}

/// Sums over the pixels of a block that both pictures show.
struct BlockSums {
  double count = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< sum of the points

  /// None if the block is not seen, or without texture.
  [[nodiscard]] std::optional<double> correlation() const {
    if (count < kLeastFilled * kBlock * kBlock) return {};
    const Eigen::Matrix2d covariance = squares / count - sum * sum.transpose() / (count * count);
    const double noise = kPictureNoise * kPictureNoise;
    if (covariance.diagonal().maxCoeff() < kLeastContrast * kLeastContrast) return {};
    return covariance(0, 1) / std::sqrt((covariance(0, 0) + noise) * (covariance(1, 1) + noise));
  }
};

BlockSums block_sums(const Picture& one, const Picture& other, const Rigid3& other_from_one, int left,
                     int top) {
  BlockSums sums;
  for (int y = top; y < top + kBlock; ++y) {
    for (int x = left; x < left + kBlock; ++x) {
      const double z = static_cast<double>(one.depth->at<float>(y, x));
      if (z < kLeastDepth_m || z > kMostDepth_m) continue;
      const Eigen::Vector3d point = one.camera.unproject((x + 0.5) / one.scale, (y + 0.5) / one.scale, z);
      const std::optional<double> grey = grey_at(other, other_from_one * point);
      if (!grey) continue;
      const Eigen::Vector2d both(static_cast<double>(one.grey->at<float>(y, x)), *grey);
      sums.count += 1.0;
      sums.sum += both;
      sums.squares += both * both.transpose();
      sums.middle += point;
    }
  }
  return sums;
}

/// Sum and number of correlations by cell.
using Cells = std::map<std::uint64_t, std::pair<double, double>>;

/// `one`, block by block, in `other`; cells are in the frame that `place_from_one` leads to.
void compare(const Picture& one, const Picture& other, const Rigid3& other_from_one,
             const Rigid3& place_from_one, Cells& cells) {
  for (int top = 0; top + kBlock <= one.grey->rows; top += kBlock) {
    for (int left = 0; left + kBlock <= one.grey->cols; left += kBlock) {
      const BlockSums sums = block_sums(one, other, other_from_one, left, top);
      const std::optional<double> correlation = sums.correlation();
      if (!correlation) continue;
      const Eigen::Vector3d at = place_from_one * (sums.middle / sums.count);
      auto& [sum, count] = cells[cloud::pack_cell(cloud::cell_of(at / kPictureCell_m))];
      sum += *correlation;
      count += 1.0;
    }
  }
}

/// The pictures whose view is most like that of `camera_from_world`, nearest first.
std::vector<std::size_t> most_alike(const std::vector<Picture>& pictures, const Rigid3& world_from_camera) {
  constexpr double kTurned_rad = 0.7;
  constexpr double kApart_m = 2.5;
  constexpr std::size_t kMost = 2;
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const Rigid3 there_from_here = pictures[i].camera_from_world * world_from_camera;
    const double turned = std::acos(std::clamp(there_from_here.rotation(2, 2), -1.0, 1.0));
    const double apart = there_from_here.translation.norm();
    if (turned < kTurned_rad && apart < kApart_m) near.emplace_back(apart + turned, i);
  }

  std::sort(near.begin(), near.end());
  std::vector<std::size_t> result;
  for (std::size_t k = 0; k < std::min(kMost, near.size()); ++k) result.push_back(near[k].second);
  return result;
}

}  // namespace

std::vector<double> picture_correlations(const MapPart& a, const MapPart& b, const Rigid3& a_from_b) {
  const std::vector<Picture> of_a = pictures_of(a);
  Cells cells;
  for (const Picture& one : pictures_of(b)) {
    const Rigid3 a_from_one = a_from_b * one.camera_from_world.inverse();
    for (const std::size_t i : most_alike(of_a, a_from_one)) {
      compare(one, of_a[i], of_a[i].camera_from_world * a_from_one, a_from_one, cells);
    }
  }

  std::vector<double> correlations;
  for (const auto& [key, cell] : cells) correlations.push_back(cell.first / cell.second);
  return correlations;
}

namespace {

// Shares of cells with a correlation below 0.4, 0.6, 0.8 and above, where other things are seen.
constexpr std::array<double, 4> kOther{0.58, 0.10, 0.12, 0.20};
constexpr double kUnlike = 0.25;       // share of a like place that is not the same
constexpr double kSeenTogether = 4.0;  // cells that count as one
constexpr double kPriorCells = 50.0;   // of the distribution that is learnt

}  // namespace

std::size_t PictureOdds::class_of(double correlation) {
  return static_cast<std::size_t>(std::clamp((correlation - 0.2) / 0.2, 0.0, 3.5));
}

PictureOdds::PictureOdds(const std::vector<double>& aligned) {
  const double all = kPriorCells + static_cast<double>(aligned.size());
  for (double& share : same_) share *= kPriorCells / all;
  for (const double correlation : aligned) same_[class_of(correlation)] += 1.0 / all;
}

double PictureOdds::odds(const std::vector<double>& correlations, const Shares& other) const {
  double sum = 0.0;
  for (const double correlation : correlations) {
    const std::size_t c = class_of(correlation);
    sum += std::log(same_[c] / other[c]);
  }
  return sum / kSeenTogether;
}

double PictureOdds::of_one_place(const std::vector<double>& correlations) const {
  return odds(correlations, kOther);
}

double PictureOdds::against_like(const std::vector<double>& correlations) const {
  Shares like{};
  for (std::size_t c = 0; c < kClasses; ++c) like[c] = (1.0 - kUnlike) * same_[c] + kUnlike * kOther[c];
  return odds(correlations, like);
}

}  // namespace plumbline::mapping
