// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/fusion/surfels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "plumbline/core/numbers.hpp"

namespace plumbline::cloud {
namespace {

constexpr float kSameSurfel = 0.7F;  // cosine between a point's normal and its surfel's
constexpr float kAlike = 0.85F;      // cosine between surfels that may lie on one surface
constexpr float kExplained = 1.3F;   // residuals over noise, standard deviations
constexpr float kModel_m = 0.0005F;  // no surface is flatter than that
constexpr std::uint32_t kFewest = 3;

/// Adds the sums of a surfel whose block lies `offset` metres away.
void gather(const Surfel& from, const Eigen::Vector3f& offset, Surfel& sums) {
  sums.second += from.second + from.first * offset.transpose() + offset * from.first.transpose() +
                 from.weight * offset * offset.transpose();
  sums.first += from.first + from.weight * offset;
  sums.normal_sum += from.normal_sum;
  sums.weight += from.weight;
  sums.variance += from.variance;
  sums.scatter += from.scatter;
  sums.points += from.points;
}

}  // namespace

Surfels::Surfels(const std::vector<FusedPoint>& points, double block_m) : block_m_(block_m) {
  surfel_of_.assign(points.size(), kNone);
  for (std::size_t i = 0; i < points.size(); ++i) add(points[i], surfel_of_[i]);
}

void Surfels::add(const FusedPoint& point, std::uint32_t& surfel_of_point) {
  const Eigen::Vector3f normal = point.point.getNormalVector3fMap();
  if (!normal.allFinite()) return;

  // The block's surfel of similar normal
  const Eigen::Vector3d position = point.point.getVector3fMap().cast<double>();
  const Eigen::Vector3i block = cell_of(position / block_m_);
  std::uint32_t& first = first_.try_emplace(pack_cell(block), kNone).first.value();
  std::uint32_t at = first;
  std::uint32_t last = kNone;
  for (; at != kNone; last = at, at = next_[at]) {
    const Eigen::Vector3f& sum = surfels_[at].normal_sum;
    if (sum.dot(normal) > kSameSurfel * sum.norm()) break;
  }

  // None yet: a new one, at the end of the block's list
  if (at == kNone) {
    at = static_cast<std::uint32_t>(surfels_.size());
    surfels_.emplace_back();
    surfels_.back().block = block;
    next_.push_back(kNone);
    (last == kNone ? first : next_[last]) = at;
  }

  Surfel& surfel = surfels_[at];
  const Eigen::Vector3f offset = (position - centre(block)).cast<float>();

  // Weighted moments of positions, normals and noise
  surfel.normal_sum += point.weight * normal;
  surfel.first += point.weight * offset;
  surfel.second += point.weight * offset * offset.transpose();
  surfel.weight += point.weight;
  surfel.variance += point.weight * point.noise_m * point.noise_m;
  surfel.scatter += point.weight * point.spread_m * point.spread_m;
  ++surfel.points;
  surfel_of_point = at;
}

Eigen::Vector3d Surfels::position(const Surfel& surfel) const {
  return centre(surfel.block) + (surfel.first / surfel.weight).cast<double>();
}

std::uint32_t Surfels::first_of(const Eigen::Vector3i& block) const {
  const auto found = first_.find(pack_cell(block));
  return found == first_.end() ? kNone : found->second;
}

template <typename Visit>
void Surfels::visit_alike(std::uint32_t first, const Eigen::Vector3f& normal, const Visit& visit) const {
  for (std::uint32_t at = first; at != kNone; at = next_[at]) {
    const Surfel& surfel = surfels_[at];
    if (surfel.normal_sum.dot(normal) > kAlike * surfel.normal_length) visit(surfel);
  }
}

bool Surfels::set_plane(const Surfel& sums, Surfel& surfel) {
  const float length = sums.normal_sum.norm();
  if (sums.points < kFewest || !(length > 0.0F)) return false;

  // Through the mean, across the mean normal
  const Eigen::Vector3f mean = sums.first / sums.weight;
  const Eigen::Matrix3f covariance = sums.second / sums.weight - mean * mean.transpose();
  surfel.origin = mean;
  surfel.normal = sums.normal_sum / length;
  surfel.residual2 =
      std::max(0.0F, surfel.normal.dot(covariance * surfel.normal)) + sums.scatter / sums.weight;
  surfel.noise2 = sums.variance / sums.weight;
  return true;
}

bool Surfels::explained(const Surfel& surfel) const {
  const float share2 = noise_share_ * noise_share_;
  return surfel.residual2 <= share2 * (kExplained * kExplained * surfel.noise2 + kModel_m * kModel_m);
}

void Surfels::measure_noise() {
  constexpr std::size_t kFewSurfels = 50;
  constexpr float kGenerous = 6.0F;
  std::vector<float> shares;

  // Residuals of flat surfels, relative to the modelled noise
  for (const Surfel& surfel : surfels_) {
    if (surfel.flat && surfel.noise2 > 0.0F) shares.push_back(surfel.residual2 / surfel.noise2);
  }

  // Too few to judge: the noise of the model
  noise_share_ = 1.0F;
  if (shares.size() < kFewSurfels) return;
  noise_share_ = std::min(1.0F, kGenerous * std::sqrt(core::median(std::move(shares))));
}

void Surfels::fit_plane(Surfel& surfel) const {
  const Eigen::Vector3f own = surfel.normal_sum.normalized();
  Surfel sums;

  // Surfels of similar normal in the blocks around
  for (int k = 0; k < 27; ++k) {
    const Eigen::Vector3i step(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    const Eigen::Vector3f offset = step.cast<float>() * static_cast<float>(block_m_);
    visit_alike(first_of(surfel.block + step), own,
                [&](const Surfel& other) { gather(other, offset, sums); });
  }
  surfel.support = sums.points;
  surfel.noise_m = std::sqrt(surfel.variance / surfel.weight);
  surfel.flat = set_plane(sums, surfel);
}

void Surfels::fit_planes() {
  for (Surfel& surfel : surfels_) surfel.normal_length = surfel.normal_sum.norm();
  for (Surfel& surfel : surfels_) fit_plane(surfel);

  // The measured noise decides which surfels are flat
  measure_noise();
  for (Surfel& surfel : surfels_) {
    // A surfel in bent surroundings may be flat by itself
    surfel.flat = surfel.flat && explained(surfel);
    if (!surfel.flat) surfel.flat = set_plane(Surfel(surfel), surfel) && explained(surfel);
  }
}

void Surfels::project(std::vector<FusedPoint>& points) const {
  constexpr float kMostSigmas = 3.0F;
  const auto step_of = [](int k) { return Eigen::Vector3i(k & 1, k >> 1 & 1, k >> 2); };
  std::array<std::uint32_t, 8> first{};  // of the blocks around `around`: neighbouring points share them
  Eigen::Vector3i around = Eigen::Vector3i::Constant(std::numeric_limits<int>::max());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (surfel_of_[i] == kNone || !surfels_[surfel_of_[i]].flat) continue;
    const Surfel& own = surfels_[surfel_of_[i]];
    Point& p = points[i].point;
    const Eigen::Vector3d position = p.getVector3fMap().cast<double>();

    // The eight blocks whose centres surround the point, trilinear.
    const Eigen::Vector3d corner = (position / block_m_).array() - 0.5;
    const Eigen::Vector3i low = cell_of(corner);
    const Eigen::Vector3f part = (corner - low.cast<double>()).cast<float>();

    if (low != around) {
      around = low;
      for (int k = 0; k < 8; ++k) first[static_cast<std::size_t>(k)] = first_of(low + step_of(k));
    }

    float total = 0.0F;
    float shift = 0.0F;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();

    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3i step = step_of(k);
      float share = 1.0F;
      for (int axis = 0; axis < 3; ++axis) share *= step[axis] == 1 ? part[axis] : 1.0F - part[axis];

      const Eigen::Vector3f from_centre = (position - centre(low + step)).cast<float>();
      visit_alike(first[static_cast<std::size_t>(k)], own.normal, [&](const Surfel& surfel) {
        if (!surfel.flat) return;
        const float weight = share * surfel.weight;
        const float along = surfel.normal.dot(own.normal);
        shift += weight * surfel.normal.dot(surfel.origin - from_centre) / std::max(along, 0.5F);
        normal += weight * surfel.normal;
        total += weight;
      });
    }

    // Only along the normal, and within the noise
    if (!(total > 0.0F)) continue;
    const float most = kMostSigmas * noise_share_ * own.noise_m;
    p.getVector3fMap() += std::clamp(shift / total, -most, most) * own.normal;
    p.getNormalVector3fMap() = normal.normalized();
  }
}

}  // namespace plumbline::cloud
