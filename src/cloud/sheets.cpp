// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/sheets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace plumbline::cloud {
namespace {

constexpr float kSameSheet = 0.7F;   // cosine between a point's normal and its sheet's
constexpr float kAlike = 0.85F;      // cosine between sheets that may lie on one surface
constexpr float kExplained = 1.3F;   // residuals over noise, standard deviations
constexpr float kModel_m = 0.0005F;  // no surface is flatter than that
constexpr std::uint32_t kFewest = 3;

/// Adds the sums of a sheet whose block lies `offset` metres away.
void gather(const Sheet& from, const Eigen::Vector3f& offset, Sheet& sums) {
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

Sheets::Sheets(const std::vector<FusedPoint>& points, double block_m) : block_m_(block_m) {
  sheet_of_.assign(points.size(), kNone);
  for (std::size_t i = 0; i < points.size(); ++i) add(points[i], sheet_of_[i]);
}

void Sheets::add(const FusedPoint& point, std::uint32_t& sheet_of_point) {
  const Eigen::Vector3f normal = point.point.getNormalVector3fMap();
  if (!normal.allFinite()) return;
  const Eigen::Vector3d position = point.point.getVector3fMap().cast<double>();
  const Eigen::Vector3i block = cell_of(position / block_m_);
  std::uint32_t& first = first_.try_emplace(pack_cell(block), kNone).first.value();
  std::uint32_t at = first;
  std::uint32_t last = kNone;
  for (; at != kNone; last = at, at = next_[at]) {
    const Eigen::Vector3f& sum = sheets_[at].normal_sum;
    if (sum.dot(normal) > kSameSheet * sum.norm()) break;
  }
  if (at == kNone) {
    at = static_cast<std::uint32_t>(sheets_.size());
    sheets_.emplace_back();
    sheets_.back().block = block;
    next_.push_back(kNone);
    (last == kNone ? first : next_[last]) = at;
  }
  Sheet& sheet = sheets_[at];
  const Eigen::Vector3f offset = (position - centre(block)).cast<float>();
  sheet.normal_sum += point.weight * normal;
  sheet.first += point.weight * offset;
  sheet.second += point.weight * offset * offset.transpose();
  sheet.weight += point.weight;
  sheet.variance += point.weight * point.noise_m * point.noise_m;
  sheet.scatter += point.weight * point.spread_m * point.spread_m;
  ++sheet.points;
  sheet_of_point = at;
}

Eigen::Vector3d Sheets::position(const Sheet& sheet) const {
  return centre(sheet.block) + (sheet.first / sheet.weight).cast<double>();
}

std::uint32_t Sheets::first_of(const Eigen::Vector3i& block) const {
  const auto found = first_.find(pack_cell(block));
  return found == first_.end() ? kNone : found->second;
}

template <typename Visit>
void Sheets::visit_alike(std::uint32_t first, const Eigen::Vector3f& normal, const Visit& visit) const {
  for (std::uint32_t at = first; at != kNone; at = next_[at]) {
    const Sheet& sheet = sheets_[at];
    if (sheet.normal_sum.dot(normal) > kAlike * sheet.normal_length) visit(sheet);
  }
}

bool Sheets::set_plane(const Sheet& sums, Sheet& sheet) {
  const float length = sums.normal_sum.norm();
  if (sums.points < kFewest || !(length > 0.0F)) return false;
  const Eigen::Vector3f mean = sums.first / sums.weight;
  const Eigen::Matrix3f covariance = sums.second / sums.weight - mean * mean.transpose();
  sheet.origin = mean;
  sheet.normal = sums.normal_sum / length;
  sheet.residual2 = std::max(0.0F, sheet.normal.dot(covariance * sheet.normal)) + sums.scatter / sums.weight;
  sheet.noise2 = sums.variance / sums.weight;
  return true;
}

bool Sheets::explained(const Sheet& sheet) const {
  const float share2 = noise_share_ * noise_share_;
  return sheet.residual2 <= share2 * (kExplained * kExplained * sheet.noise2 + kModel_m * kModel_m);
}

void Sheets::measure_noise() {
  constexpr std::size_t kFewSheets = 50;
  constexpr float kGenerous = 6.0F;
  std::vector<float> shares;
  for (const Sheet& sheet : sheets_) {
    if (sheet.flat && sheet.noise2 > 0.0F) shares.push_back(sheet.residual2 / sheet.noise2);
  }
  noise_share_ = 1.0F;
  if (shares.size() < kFewSheets) return;
  const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
  std::nth_element(shares.begin(), middle, shares.end());
  noise_share_ = std::min(1.0F, kGenerous * std::sqrt(*middle));
}

void Sheets::fit_plane(Sheet& sheet) const {
  const Eigen::Vector3f own = sheet.normal_sum.normalized();
  Sheet sums;
  for (int k = 0; k < 27; ++k) {
    const Eigen::Vector3i step(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    const Eigen::Vector3f offset = step.cast<float>() * static_cast<float>(block_m_);
    visit_alike(first_of(sheet.block + step), own, [&](const Sheet& other) { gather(other, offset, sums); });
  }
  sheet.support = sums.points;
  sheet.noise_m = std::sqrt(sheet.variance / sheet.weight);
  sheet.flat = set_plane(sums, sheet);
}

void Sheets::fit_planes() {
  for (Sheet& sheet : sheets_) sheet.normal_length = sheet.normal_sum.norm();
  for (Sheet& sheet : sheets_) fit_plane(sheet);
  measure_noise();
  for (Sheet& sheet : sheets_) {
    sheet.flat = sheet.flat && explained(sheet);
    if (!sheet.flat) sheet.flat = set_plane(Sheet(sheet), sheet) && explained(sheet);
  }
}

void Sheets::settle(std::vector<FusedPoint>& points) const {
  constexpr float kMostSigmas = 3.0F;
  const auto step_of = [](int k) { return Eigen::Vector3i(k & 1, k >> 1 & 1, k >> 2); };
  std::array<std::uint32_t, 8> first{};  // of the blocks around `around`: neighbouring points share them
  Eigen::Vector3i around = Eigen::Vector3i::Constant(std::numeric_limits<int>::max());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (sheet_of_[i] == kNone || !sheets_[sheet_of_[i]].flat) continue;
    const Sheet& own = sheets_[sheet_of_[i]];
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
      visit_alike(first[static_cast<std::size_t>(k)], own.normal, [&](const Sheet& sheet) {
        if (!sheet.flat) return;
        const float weight = share * sheet.weight;
        const float along = sheet.normal.dot(own.normal);
        shift += weight * sheet.normal.dot(sheet.origin - from_centre) / std::max(along, 0.5F);
        normal += weight * sheet.normal;
        total += weight;
      });
    }
    if (!(total > 0.0F)) continue;
    const float most = kMostSigmas * noise_share_ * own.noise_m;
    p.getVector3fMap() += std::clamp(shift / total, -most, most) * own.normal;
    p.getNormalVector3fMap() = normal.normalized();
  }
}

}  // namespace plumbline::cloud
