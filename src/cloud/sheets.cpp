// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/sheets.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "voxel_key.hpp"

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

Sheets::Sheets(const FusedCloud& points, double block_m) : block_m_(block_m) {
  const std::size_t count = points.cloud->size();
  sheet_of_.assign(count, kNone);
  table_.assign(1024, kNone);
  Cursor cursor;
  for (std::size_t i = 0; i < count; ++i) add(points, i, cursor);
}

std::uint32_t Sheets::brick_at(const Eigen::Vector3i& place) const {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t at = mix(pack_cell(place)) & mask; table_[at] != kNone; at = (at + 1) & mask) {
    if (bricks_[table_[at]].place == place) return table_[at];
  }
  return kNone;
}

void Sheets::note(std::uint32_t brick) {
  const std::size_t mask = table_.size() - 1;
  std::size_t at = mix(pack_cell(bricks_[brick].place)) & mask;
  while (table_[at] != kNone) at = (at + 1) & mask;
  table_[at] = brick;
}

std::uint32_t Sheets::first_of(const Eigen::Vector3i& block, Cursor& cursor) const {
  const Eigen::Vector3i place = brick_of(block);
  if (!cursor.valid || cursor.place != place) cursor = {place, brick_at(place), true};
  return cursor.brick == kNone ? kNone : bricks_[cursor.brick].first[cell_of(block)];
}

std::uint32_t& Sheets::slot(const Eigen::Vector3i& block, Cursor& cursor) {
  const Eigen::Vector3i place = brick_of(block);
  if (!cursor.valid || cursor.place != place) cursor = {place, brick_at(place), true};
  if (cursor.brick == kNone) {
    cursor.brick = static_cast<std::uint32_t>(bricks_.size());
    bricks_.emplace_back();
    bricks_.back().place = place;
    bricks_.back().first.fill(kNone);
    if (bricks_.size() * 2 > table_.size()) {
      table_.assign(table_.size() * 2, kNone);
      for (std::uint32_t b = 0; b < cursor.brick; ++b) note(b);
    }
    note(cursor.brick);
  }
  return bricks_[cursor.brick].first[cell_of(block)];
}

void Sheets::add(const FusedCloud& points, std::size_t i, Cursor& cursor) {
  const Point& p = (*points.cloud)[i];
  const Eigen::Vector3f normal = p.getNormalVector3fMap();
  if (!normal.allFinite()) return;
  const Eigen::Vector3d position = p.getVector3fMap().cast<double>();
  const Eigen::Vector3i block = (position / block_m_).array().floor().cast<int>();
  std::uint32_t& first = slot(block, cursor);
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
  const float weight = points.weight[i];
  const Eigen::Vector3f offset = (position - centre(block)).cast<float>();
  sheet.normal_sum += weight * normal;
  sheet.first += weight * offset;
  sheet.second += weight * offset * offset.transpose();
  sheet.weight += weight;
  sheet.variance += weight * points.noise_m[i] * points.noise_m[i];
  sheet.scatter += weight * points.spread_m[i] * points.spread_m[i];
  ++sheet.points;
  sheet_of_[i] = at;
}

Eigen::Vector3d Sheets::position(const Sheet& sheet) const {
  return centre(sheet.block) + (sheet.first / sheet.weight).cast<double>();
}

template <typename Visit>
void Sheets::visit_alike(const Eigen::Vector3i& block, const Eigen::Vector3f& normal, Cursor& cursor,
                         const Visit& visit) const {
  for (std::uint32_t at = first_of(block, cursor); at != kNone; at = next_[at]) {
    const Eigen::Vector3f& sum = sheets_[at].normal_sum;
    if (sum.dot(normal) > kAlike * sum.norm()) visit(sheets_[at]);
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

void Sheets::fit_planes() {
  Cursor cursor;
  for (Sheet& sheet : sheets_) {
    const Eigen::Vector3f own = sheet.normal_sum.normalized();
    Sheet sums;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const Eigen::Vector3i step(dx, dy, dz);
          const Eigen::Vector3f offset = step.cast<float>() * static_cast<float>(block_m_);
          visit_alike(sheet.block + step, own, cursor,
                      [&](const Sheet& other) { gather(other, offset, sums); });
        }
      }
    }
    sheet.support = sums.points;
    sheet.noise_m = std::sqrt(sheet.variance / sheet.weight);
    sheet.flat = set_plane(sums, sheet);
  }
  measure_noise();
  for (Sheet& sheet : sheets_) {
    sheet.flat = sheet.flat && explained(sheet);
    if (!sheet.flat) sheet.flat = set_plane(Sheet(sheet), sheet) && explained(sheet);
  }
}

void Sheets::settle(FusedCloud& points) const {
  constexpr float kMostSigmas = 3.0F;
  Cursor cursor;
  for (std::size_t i = 0; i < sheet_of_.size(); ++i) {
    if (sheet_of_[i] == kNone || !sheets_[sheet_of_[i]].flat) continue;
    Point& p = (*points.cloud)[i];
    const Eigen::Vector3f own = sheets_[sheet_of_[i]].normal;
    const Eigen::Vector3d position = p.getVector3fMap().cast<double>();
    // The eight blocks whose centres surround the point, trilinear.
    const Eigen::Vector3d corner = (position / block_m_).array() - 0.5;
    const Eigen::Vector3i low = corner.array().floor().cast<int>();
    const Eigen::Vector3f part = (corner - low.cast<double>()).cast<float>();
    float total = 0.0F;
    float shift = 0.0F;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3i step(k & 1, k >> 1 & 1, k >> 2);
      const Eigen::Vector3i block = low + step;
      float share = 1.0F;
      for (int axis = 0; axis < 3; ++axis) share *= step[axis] == 1 ? part[axis] : 1.0F - part[axis];
      const Eigen::Vector3f from_centre = (position - centre(block)).cast<float>();
      visit_alike(block, own, cursor, [&](const Sheet& sheet) {
        if (!sheet.flat) return;
        const float weight = share * sheet.weight;
        const float along = sheet.normal.dot(own);
        shift += weight * sheet.normal.dot(sheet.origin - from_centre) / std::max(along, 0.5F);
        normal += weight * sheet.normal;
        total += weight;
      });
    }
    if (!(total > 0.0F)) continue;
    const float most = kMostSigmas * noise_share_ * sheets_[sheet_of_[i]].noise_m;
    p.getVector3fMap() += std::clamp(shift / total, -most, most) * own;
    p.getNormalVector3fMap() = normal.normalized();
  }
}

}  // namespace plumbline::cloud
