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

/// Rounded down: a cast and a step, there is no instruction for floor() on every machine.
Eigen::Vector3i whole(const Eigen::Vector3d& at) {
  Eigen::Vector3i cell = at.cast<int>();
  for (int axis = 0; axis < 3; ++axis) cell[axis] -= at[axis] < static_cast<double>(cell[axis]) ? 1 : 0;
  return cell;
}

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

Sheets::Halo Sheets::halo_of(std::size_t brick) const {
  Halo halo;
  halo.fill(kNone);
  const Eigen::Vector3i place = bricks_[brick].place;
  // Of each neighbour along an axis: its cells from ... to, and where these come to lie.
  struct Part {
    int from, to, at;
  };
  constexpr std::array<Part, 3> kParts{Part{kBrick - 1, kBrick, 0}, Part{0, kBrick, 1},
                                       Part{0, 1, kBrick + 1}};
  for (int k = 0; k < 27; ++k) {
    const Eigen::Vector3i step(k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1);
    const std::uint32_t other = step.isZero() ? static_cast<std::uint32_t>(brick) : brick_at(place + step);
    if (other == kNone) continue;
    const Part& px = kParts[static_cast<std::size_t>(step.x() + 1)];
    const Part& py = kParts[static_cast<std::size_t>(step.y() + 1)];
    const Part& pz = kParts[static_cast<std::size_t>(step.z() + 1)];
    for (int x = px.from; x < px.to; ++x) {
      for (int y = py.from; y < py.to; ++y) {
        const std::uint32_t* from = &bricks_[other].first[cell_of({x, y, pz.from})];
        std::uint32_t* to = &halo[static_cast<std::size_t>(
            ((px.at + x - px.from) * kHalo + py.at + y - py.from) * kHalo + pz.at)];
        std::copy(from, from + (pz.to - pz.from), to);
      }
    }
  }
  return halo;
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
  const Eigen::Vector3i block = whole(position / block_m_);
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
    brick_of_.push_back(cursor.brick);
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

void Sheets::fit_plane(Sheet& sheet, const Eigen::Vector3i& in_brick, const Halo& halo) const {
  const Eigen::Vector3f own = sheet.normal_sum.normalized();
  Sheet sums;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector3i step(dx, dy, dz);
        const std::uint32_t first = halo[halo_cell_of(in_brick + step)];
        if (first == kNone) continue;
        const Eigen::Vector3f offset = step.cast<float>() * static_cast<float>(block_m_);
        visit_alike(first, own, [&](const Sheet& other) { gather(other, offset, sums); });
      }
    }
  }
  sheet.support = sums.points;
  sheet.noise_m = std::sqrt(sheet.variance / sheet.weight);
  sheet.flat = set_plane(sums, sheet);
}

void Sheets::fit_planes() {
  for (Sheet& sheet : sheets_) sheet.normal_length = sheet.normal_sum.norm();
  halos_.resize(bricks_.size());
  for (std::size_t b = 0; b < bricks_.size(); ++b) {
    halos_[b] = halo_of(b);
    for (int x = 0; x < kBrick; ++x) {
      for (int y = 0; y < kBrick; ++y) {
        for (int z = 0; z < kBrick; ++z) {
          for (std::uint32_t s = bricks_[b].first[cell_of({x, y, z})]; s != kNone; s = next_[s])
            fit_plane(sheets_[s], {x, y, z}, halos_[b]);
        }
      }
    }
  }
  measure_noise();
  for (Sheet& sheet : sheets_) {
    sheet.flat = sheet.flat && explained(sheet);
    if (!sheet.flat) sheet.flat = set_plane(Sheet(sheet), sheet) && explained(sheet);
  }
}

void Sheets::settle(FusedCloud& points) const {
  constexpr float kMostSigmas = 3.0F;
  for (std::size_t i = 0; i < sheet_of_.size(); ++i) {
    if (sheet_of_[i] == kNone || !sheets_[sheet_of_[i]].flat) continue;
    Point& p = (*points.cloud)[i];
    const Eigen::Vector3f own = sheets_[sheet_of_[i]].normal;
    const Eigen::Vector3d position = p.getVector3fMap().cast<double>();
    // The eight blocks whose centres surround the point, trilinear.
    const Eigen::Vector3d corner = (position / block_m_).array() - 0.5;
    const Eigen::Vector3i low = whole(corner);
    const Eigen::Vector3f part = (corner - low.cast<double>()).cast<float>();
    const Eigen::Vector3f before = (position - centre(low)).cast<float>();
    const Eigen::Vector3f after = (position - centre(low + Eigen::Vector3i::Ones())).cast<float>();
    const std::uint32_t brick = brick_of_[sheet_of_[i]];
    const Halo& halo = halos_[brick];
    const Eigen::Vector3i in_brick = low - bricks_[brick].place * kBrick;
    float total = 0.0F;
    float shift = 0.0F;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3i step(k & 1, k >> 1 & 1, k >> 2);
      const std::uint32_t first = halo[halo_cell_of(in_brick + step)];
      if (first == kNone) continue;
      float share = 1.0F;
      Eigen::Vector3f from_centre;
      for (int axis = 0; axis < 3; ++axis) {
        share *= step[axis] == 1 ? part[axis] : 1.0F - part[axis];
        from_centre[axis] = step[axis] == 1 ? after[axis] : before[axis];
      }
      visit_alike(first, own, [&](const Sheet& sheet) {
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
