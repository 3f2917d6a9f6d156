// SPDX-License-Identifier: BSD-3-Clause
#include "laid_over.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "plumbline/features/descriptor.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using Cell = std::array<int, 3>;

constexpr double kReach_m = 0.12;  // landmarks that are one may lie so far apart
constexpr double kCell_m = 2.0 * kReach_m;
constexpr int kAlike = 50;                 // Hamming distance of landmarks that may be one
constexpr double kBin_m = 0.2;             // of the votes; a peak covers two in each direction
constexpr std::size_t kPeaks = 6;          // that are looked at
constexpr std::size_t kMostVoters = 3000;  // of each side
constexpr std::size_t kMostAsked = 6000;
constexpr double kNear_m = 0.4;  // what depth is believed
constexpr double kFar_m = 5.0;

Cell cell_of(const Eigen::Vector3d& p, double size) {
  const Eigen::Vector3d scaled = p / size;
  return {static_cast<int>(std::floor(scaled.x())), static_cast<int>(std::floor(scaled.y())),
          static_cast<int>(std::floor(scaled.z()))};
}

Cell corner_of(const Cell& low, int corner, int sign = 1) {
  return {low[0] + sign * (corner & 1), low[1] + sign * (corner >> 1 & 1), low[2] + sign * (corner >> 2)};
}

std::uint64_t key_of(const Cell& c) {
  std::uint64_t key = 0;
  for (const int v : c) key = key << 21U | (static_cast<std::uint64_t>(v + (1 << 20)) & 0x1fffffU);
  return key;
}

/// Every how manieth, so that no more than `most` are taken.
std::size_t stride(std::size_t count, std::size_t most) {
  return std::max<std::size_t>(1, (count + most - 1) / most);
}

bool alike(const features::Descriptor256& a, const features::Descriptor256& b) {
  return features::hamming_distance(a, b) <= kAlike;
}

enum class Seen { kNot, kThere, kThrough };

/// What a keyframe's depth says of a surface at `point` in its camera frame.
Seen seen(const cv::Mat& depth, const sensor::Pinhole& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector2d pixel = camera.project(point);
  const int x = static_cast<int>(std::floor(pixel.x() * depth.cols / camera.width));
  const int y = static_cast<int>(std::floor(pixel.y() * depth.rows / camera.height));
  if (x < 1 || y < 1 || x + 1 >= depth.cols || y + 1 >= depth.rows) return Seen::kNot;
  float low = 1e9F;
  float high = 0.0F;
  for (int v = y - 1; v <= y + 1; ++v) {
    const float* row = depth.ptr<float>(v);
    for (int u = x - 1; u <= x + 1; ++u) {
      if (!(row[u] > 0.0F)) return Seen::kNot;
      low = std::min(low, row[u]);
      high = std::max(high, row[u]);
    }
  }
  const double tolerance = 0.06 + 3.0 * sensor::depth_sigma(point.z());
  if (point.z() < static_cast<double>(low) - tolerance) return Seen::kThrough;
  return point.z() > static_cast<double>(high) + tolerance ? Seen::kNot : Seen::kThere;
}

struct View {
  const cv::Mat* depth;
  sensor::Pinhole camera;
  Rigid3 camera_from_world;
};

std::vector<View> views_of(const MapPart& part) {
  std::vector<View> views;
  for (const KeyframeId id : part.map->keyframe_ids()) {
    const auto& features = part.map->keyframe(id).features;
    if (features == nullptr || features->thumbnail_depth.empty()) continue;
    views.push_back({&features->thumbnail_depth, part.cameras.at(id.robot), part.map->camera_from_world(id)});
  }
  return views;
}

/// Votes for steps, in bins.
class Peaks {
 public:
  Peaks(const std::vector<Eigen::Vector3d>& steps, double least_m) : steps_(steps), least_m_(least_m) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (steps[i].norm() >= least_m) bins_[cell_of(steps[i], kBin_m)].push_back(i);
    }
  }
  /// Means of the fullest blocks of eight bins, no two of one peak.
  [[nodiscard]] std::vector<Eigen::Vector3d> highest(std::size_t most) const {
    std::map<Cell, std::size_t> counts;
    for (const auto& bin : bins_) {
      for (int corner = 0; corner < 8; ++corner) {
        counts[corner_of(bin.first, corner, -1)] += bin.second.size();
      }
    }
    std::vector<std::pair<std::size_t, Cell>> blocks;
    for (const auto& [low, count] : counts) blocks.emplace_back(count, low);
    std::sort(blocks.begin(), blocks.end(), [](const auto& x, const auto& y) {
      return x.first != y.first ? x.first > y.first : x.second < y.second;
    });
    std::vector<Eigen::Vector3d> result;
    for (const auto& block : blocks) {
      if (result.size() >= most) break;
      const Eigen::Vector3d mean = settled(mean_of(block.second));
      const auto same = [&](const Eigen::Vector3d& other) { return (other - mean).norm() < 2.0 * kBin_m; };
      if (mean.norm() >= least_m_ && std::none_of(result.begin(), result.end(), same)) result.push_back(mean);
    }
    return result;
  }

 private:
  [[nodiscard]] Eigen::Vector3d mean_of(const Cell& low) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const auto bin = bins_.find(corner_of(low, corner));
      if (bin == bins_.end()) continue;
      for (const std::size_t i : bin->second) sum += steps_[i];
      count += static_cast<double>(bin->second.size());
    }
    return sum / count;
  }

  /// The block need not have the peak in its middle.
  [[nodiscard]] Eigen::Vector3d settled(Eigen::Vector3d peak) const {
    constexpr int kRounds = 5;
    constexpr double kWide_m = 0.75 * kBin_m;
    for (int round = 0; round < kRounds; ++round) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double count = 0.0;
      for (const Eigen::Vector3d& step : steps_) {
        if ((step - peak).squaredNorm() > kWide_m * kWide_m) continue;
        sum += step;
        count += 1.0;
      }
      if (count > 0.0) peak = sum / count;
    }
    return peak;
  }

  const std::vector<Eigen::Vector3d>& steps_;
  double least_m_;
  std::map<Cell, std::vector<std::size_t>> bins_;
};

}  // namespace

LaidMaps::Landmark LaidMaps::landmark(const maps::Map& map, core::PointId id) {
  const maps::MapPoint& point = map.point(id);
  return {point.position, point.view_direction, point.reference_distance, point.descriptor};
}

LaidMaps::Side LaidMaps::side(const MapPart& part) {
  Side side;
  side.part = part;
  std::vector<std::pair<std::uint64_t, core::PointId>> order;
  for (const core::PointId id : part.map->point_ids()) {
    const maps::MapPoint& point = part.map->point(id);
    if (point.observations.size() >= 2) order.emplace_back(key_of(cell_of(point.position, kCell_m)), id);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [key, id] : order) {
    side.cells.push_back(key);
    side.landmarks.push_back(landmark(*part.map, id));
  }
  return side;
}

LaidMaps::LaidMaps(const MapPart& a, const MapPart& b) : a_(side(a)), b_(side(b)) {
  constexpr std::size_t kSample = 300;
  double pairs = 0.0;
  for (std::size_t i = 0; i < a_.landmarks.size(); i += stride(a_.landmarks.size(), kSample)) {
    for (std::size_t j = 0; j < b_.landmarks.size(); j += stride(b_.landmarks.size(), kSample)) {
      pairs += 1.0;
      if (alike(a_.landmarks[i].descriptor, b_.landmarks[j].descriptor)) alike_ += 1.0;
    }
  }
  alike_ /= std::max(1.0, pairs);
}

/// Whether the side has a landmark there that looks alike, and how probable that was.
void LaidMaps::match(const Side& side, const Landmark& landmark, const Eigen::Vector3d& at,
                     LaidOver& sum) const {
  // Cells are twice the reach wide: eight of them hold all that is near.
  const Cell low = cell_of(at - Eigen::Vector3d::Constant(kReach_m), kCell_m);
  bool found = false;
  int near = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const std::uint64_t key = key_of(corner_of(low, corner));
    auto cell = std::lower_bound(side.cells.begin(), side.cells.end(), key);
    for (; cell != side.cells.end() && *cell == key; ++cell) {
      const Landmark& other = side.landmarks[static_cast<std::size_t>(cell - side.cells.begin())];
      if ((other.position - at).norm() > kReach_m) continue;
      ++near;
      found = found || alike(other.descriptor, landmark.descriptor);
    }
  }
  sum.matched += found ? 1 : 0;
  sum.chance += 1.0 - std::pow(1.0 - alike_, near);
}

void LaidMaps::lay(const Side& moved, const Side& fixed, const Rigid3& fixed_from_moved,
                   LaidOver& sum) const {
  constexpr double kLikeSide = 0.8;  // cosine between the directions from which a landmark was seen
  constexpr double kTimes = 1.8;     // nearer or farther: a corner does not look the same from everywhere
  const std::vector<View> views = views_of(fixed.part);
  const std::size_t step = stride(moved.landmarks.size(), kMostAsked);
  for (std::size_t i = 0; i < moved.landmarks.size(); i += step) {
    const Landmark& landmark = moved.landmarks[i];
    const Eigen::Vector3d at = fixed_from_moved * landmark.position;
    const Eigen::Vector3d direction = fixed_from_moved.rotation * landmark.view;
    bool there = false;
    bool through = false;
    for (const View& view : views) {
      const Eigen::Vector3d in_camera = view.camera_from_world * at;
      const double distance = in_camera.norm();
      if (in_camera.z() < kNear_m || in_camera.z() > kFar_m || distance > kTimes * landmark.distance_m ||
          distance * kTimes < landmark.distance_m) {
        continue;
      }
      if (in_camera.dot(view.camera_from_world.rotation * direction) < kLikeSide * distance) continue;
      const Seen what = seen(*view.depth, view.camera, in_camera);
      there = there || what == Seen::kThere;
      through = through || what == Seen::kThrough;
    }
    if (there) {
      ++sum.expected;
      match(fixed, landmark, at, sum);
    } else if (through) {
      ++sum.contradicted;
    }
  }
}

namespace {

struct SurfaceCounts {
  int there = 0;
  int through = 0;
};

/// Surface samples of one map in the views of another.
void lay_surfaces(const MapPart& moved, const MapPart& fixed, const Rigid3& fixed_from_moved,
                  SurfaceCounts& sum) {
  constexpr double kFacing = 0.25;  // cosine
  const std::vector<View> views = views_of(fixed);
  const std::vector<KeyframeId> ids = moved.map->keyframe_ids();
  std::size_t count = 0;
  for (const KeyframeId id : ids) count += moved.map->keyframe(id).surface.size();
  const std::size_t step = stride(count, kMostAsked);
  std::size_t next = 0;  // of all samples, one keyframe's after the other's
  for (const KeyframeId id : ids) {
    const Rigid3 fixed_from_camera = fixed_from_moved * moved.map->camera_from_world(id).inverse();
    const std::vector<maps::SurfaceSample>& samples = moved.map->keyframe(id).surface;
    for (; next < samples.size(); next += step) {
      const Eigen::Vector3d at = fixed_from_camera * samples[next].point.cast<double>();
      const Eigen::Vector3d normal = fixed_from_camera.rotation * samples[next].normal.cast<double>();
      bool there = false;
      bool through = false;
      for (const View& view : views) {
        const Eigen::Vector3d in_camera = view.camera_from_world * at;
        if (in_camera.z() < kNear_m || in_camera.z() > kFar_m) continue;
        if (-(view.camera_from_world.rotation * normal).dot(in_camera) < kFacing * in_camera.norm()) continue;
        const Seen what = seen(*view.depth, view.camera, in_camera);
        there = there || what == Seen::kThere;
        through = through || what == Seen::kThrough;
      }
      sum.there += there ? 1 : 0;
      sum.through += through && !there ? 1 : 0;
    }
    next -= samples.size();
  }
}

}  // namespace

double LaidMaps::surfaces_seen_through(const Rigid3& a_from_b) const {
  constexpr int kFew = 500;  // samples; tell nothing
  SurfaceCounts sum;
  lay_surfaces(b_.part, a_.part, a_from_b, sum);
  lay_surfaces(a_.part, b_.part, a_from_b.inverse(), sum);
  const int told = sum.there + sum.through;
  return told >= kFew ? static_cast<double>(sum.through) / told : 0.0;
}

LaidOver LaidMaps::fit(const Rigid3& a_from_b) const {
  LaidOver sum;
  lay(b_, a_, a_from_b, sum);
  lay(a_, b_, a_from_b.inverse(), sum);
  return sum;
}

/// Steps, in the fixed map's world, between landmarks that look very much alike.
void LaidMaps::vote(const Side& moved, const Side& fixed, const Rigid3& fixed_from_moved,
                    const std::vector<VerifiedPair>& pairs, std::vector<Eigen::Vector3d>& steps) {
  const maps::Map& map = *moved.part.map;
  std::set<core::PointId> ids;
  for (const VerifiedPair& pair : pairs) {
    for (const core::PointId id : map.points_of(map.has_keyframe(pair.query) ? pair.query : pair.match)) {
      if (id.valid() && map.point(id).observations.size() >= 2) ids.insert(id);
    }
  }
  const std::vector<core::PointId> voters(ids.begin(), ids.end());
  std::vector<features::Descriptor256> descriptors;
  for (const Landmark& l : fixed.landmarks) descriptors.push_back(l.descriptor);
  std::vector<int> all(descriptors.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<int> distances(descriptors.size());
  for (std::size_t v = 0; v < voters.size(); v += stride(voters.size(), kMostVoters)) {
    const Landmark voter = landmark(map, voters[v]);
    const Eigen::Vector3d at = fixed_from_moved * voter.position;
    features::hamming_distances(voter.descriptor, descriptors.data(), all.data(), all.size(),
                                distances.data());
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (distances[i] <= kAlike) steps.push_back(fixed.landmarks[i].position - at);
    }
  }
}

std::vector<Rigid3> LaidMaps::steps(const Rigid3& a_from_b, const std::vector<VerifiedPair>& pairs,
                                    double least_m) const {
  std::vector<Eigen::Vector3d> votes;
  vote(a_, b_, a_from_b.inverse(), pairs, votes);
  // A step of a in b's world is the opposite one of b in a's.
  for (Eigen::Vector3d& step : votes) step = -(a_from_b.rotation * step);
  vote(b_, a_, a_from_b, pairs, votes);
  std::vector<Rigid3> result;
  for (const Eigen::Vector3d& step : Peaks(votes, least_m).highest(kPeaks)) {
    result.emplace_back(a_from_b.rotation, a_from_b.translation + step);
  }
  return result;
}

}  // namespace plumbline::mapping
