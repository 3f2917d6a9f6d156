// SPDX-License-Identifier: BSD-3-Clause
// Repetition in a map: steps between landmarks that look alike.
#include <algorithm>
#include <map>
#include <set>

#include "merging/landmark_cells.hpp"
#include "merging/map_overlay.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

constexpr double kBin_m = 0.2;             // of the votes; a peak covers two in each direction
constexpr std::size_t kPeaks = 6;          // number of peaks that are tested
constexpr std::size_t kMostVoters = 3000;  // of each side

/// Votes for steps, in bins.
class Peaks {
 public:
  Peaks(const std::vector<Eigen::Vector3d>& steps, double least_m) : steps_(steps), least_m_(least_m) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (steps[i].norm() >= least_m) bins_[cloud::pack_cell(cloud::cell_of(steps[i] / kBin_m))].push_back(i);
    }
  }
  /// Means of the fullest blocks of eight bins, no two of one peak.
  [[nodiscard]] std::vector<Eigen::Vector3d> highest(std::size_t most) const {
    // The blocks of eight bins overlap, so that a peak on the border between bins is not divided.
    std::map<std::uint64_t, std::size_t> counts;
    for (const auto& bin : bins_) {
      for (int corner = 0; corner < 8; ++corner) {
        counts[cloud::pack_cell(corner_of(cloud::unpack_cell(bin.first), corner, -1))] += bin.second.size();
      }
    }

    std::vector<std::pair<std::size_t, std::uint64_t>> blocks;
    for (const auto& [low, count] : counts) blocks.emplace_back(count, low);
    std::sort(blocks.begin(), blocks.end(), [](const auto& x, const auto& y) {
      return x.first != y.first ? x.first > y.first : x.second < y.second;
    });

    // Overlapping blocks share a peak, which must be listed only once.
    std::vector<Eigen::Vector3d> result;
    for (const auto& block : blocks) {
      if (result.size() >= most) break;
      const Eigen::Vector3d mean = settled(mean_of(cloud::unpack_cell(block.second)));
      const auto same = [&](const Eigen::Vector3d& other) { return (other - mean).norm() < 2.0 * kBin_m; };
      if (mean.norm() >= least_m_ && std::none_of(result.begin(), result.end(), same)) result.push_back(mean);
    }

    return result;
  }

 private:
  [[nodiscard]] Eigen::Vector3d mean_of(const Eigen::Vector3i& low) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const auto bin = bins_.find(cloud::pack_cell(corner_of(low, corner)));
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
  std::map<std::uint64_t, std::vector<std::size_t>> bins_;  ///< by cell, in order of x, then y, then z
};

}  // namespace

/// Steps, in the fixed map's world, between landmarks that look very much alike.
void MapOverlay::vote(const Side& moved, const Side& fixed, const Rigid3& fixed_from_moved,
                      const std::vector<VerifiedPair>& pairs, std::vector<Eigen::Vector3d>& steps) {
  const maps::Map& map = *moved.part.map;

  // Landmarks of the agreeing keyframes vote; one that was seen only once may be a wrong measurement.
  std::set<core::PointId> ids;
  for (const VerifiedPair& pair : pairs) {
    for (const core::PointId id : map.points_of(map.has_keyframe(pair.query) ? pair.query : pair.match)) {
      if (id.valid() && map.point(id).observations.size() >= 2) ids.insert(id);
    }
  }

  const std::vector<core::PointId> voters(ids.begin(), ids.end());
  std::vector<features::Descriptor256> descriptors;
  for (const Landmark& l : fixed.landmarks) descriptors.push_back(l.descriptor);

  std::vector<int> distances(descriptors.size());

  // A landmark votes for the steps to all that look like it: where the scene repeats, many of them are equal.
  for (std::size_t v = 0; v < voters.size(); v += stride(voters.size(), kMostVoters)) {
    const Landmark voter = landmark(map, voters[v]);
    const Eigen::Vector3d at = fixed_from_moved * voter.position;
    features::hamming_distances(voter.descriptor, descriptors.data(), descriptors.size(), distances.data());
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (distances[i] <= kAlike) steps.push_back(fixed.landmarks[i].position - at);
    }
  }
}

std::vector<Rigid3> MapOverlay::steps(const Rigid3& a_from_b, const std::vector<VerifiedPair>& pairs,
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
