// SPDX-License-Identifier: BSD-3-Clause
#include "ros2/live_grid.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::net {
namespace {

constexpr int kBearings = 720;    // of a turn
constexpr int kBlock = 64;        // the grid grows by blocks of cells
constexpr double kFloor_m = 0.1;  // greatest distance of measured floor from z = 0
constexpr int kFewestPoints = 2;  // of an obstacle in one cell of a beam
constexpr double kBody_m = 0.2;   // whoever carries the camera stands on free ground
constexpr double kPi = 3.14159265358979323846;

double yaw_of(const geometry::Rigid3& map_from_camera) {
  const Eigen::Vector3d ahead = map_from_camera.rotation.col(2);
  return std::atan2(ahead.y(), ahead.x());
}

double turn_between(double a, double b) { return std::remainder(a - b, 2.0 * kPi); }

}  // namespace

void LiveGrid::add(double stamp, const geometry::Rigid3& map_from_camera,
                   const std::vector<Eigen::Vector3f>& points) {
  Scan scan;
  scan.at = map_from_camera.translation.head<2>();
  scan.yaw = yaw_of(map_from_camera);
  scan.beams = beams_of(scan, points);

  // A scan of that time is already drawn
  const auto [at, is_new] = scans_.emplace(stamp, std::move(scan));
  if (!is_new) return;
  make_room(at->second);
  draw(at->second, 1);
}

void LiveGrid::move(const geometry::Trajectory& map_from_camera) {
  constexpr double kLeastTurn = 0.5 * kPi / 180.0;
  for (const geometry::StampedPose& pose : map_from_camera) {
    const auto found = scans_.find(pose.stamp);
    if (found == scans_.end()) continue;
    Scan& scan = found->second;
    const Eigen::Vector2d at = pose.world_from_camera.translation.head<2>();
    const double yaw = yaw_of(pose.world_from_camera);

    // Small corrections do not change cells
    if ((at - scan.at).norm() < 0.5 * options_.resolution_m &&
        std::abs(turn_between(yaw, scan.yaw)) < kLeastTurn)
      continue;

    // Cells forget the scan at its old place
    draw(scan, -1);
    scan.at = at;
    scan.yaw = yaw;
    make_room(scan);
    draw(scan, 1);
  }
}

std::optional<LiveGrid::Change> LiveGrid::take() {
  if (cells_.empty()) return std::nullopt;
  std::vector<std::uint8_t> now(cells_.size());
  for (std::size_t i = 0; i < now.size(); ++i) now[i] = value(i);

  // All cells sent since the last whole grid: that and the latest part are complete
  const bool resized = sent_.size() != now.size();
  bool changed = resized;
  for (std::size_t i = 0; !resized && i < now.size(); ++i) {
    if (now[i] == sent_[i]) continue;
    const int at = static_cast<int>(i);
    part_.extend(Eigen::Vector2i(at % size_.x(), at / size_.x()));
    changed = true;
  }
  if (!changed) return std::nullopt;

  // A part of more than half of the grid is sent as the whole
  Change change;
  const Eigen::Vector2i extent = resized ? size_ : Eigen::Vector2i(part_.sizes() + Eigen::Vector2i::Ones());
  change.whole = resized || 2 * extent.prod() > size_.prod();
  const Eigen::Vector2i first = change.whole ? Eigen::Vector2i(0, 0) : part_.min();
  const Eigen::Vector2i sides = change.whole ? size_ : extent;
  if (change.whole) part_.setEmpty();

  change.cells.resolution_m = options_.resolution_m;
  change.cells.origin = low_.cast<double>() * options_.resolution_m;
  change.cells.x = first.x();
  change.cells.y = first.y();
  change.cells.width = static_cast<std::uint32_t>(sides.x());
  change.cells.height = static_cast<std::uint32_t>(sides.y());

  for (int row = first.y(); row < first.y() + sides.y(); ++row) {
    const auto begin = now.begin() + static_cast<std::ptrdiff_t>(row) * size_.x() + first.x();
    change.cells.cells.insert(change.cells.cells.end(), begin, begin + sides.x());
  }
  sent_ = std::move(now);
  return change;
}

std::vector<LiveGrid::Beam> LiveGrid::beams_of(const Scan& scan,
                                               const std::vector<Eigen::Vector3f>& points) const {
  // Points by bearing and distance: of obstacles, and of the floor.
  struct Column {
    std::array<std::uint8_t, kReach> obstacles{};
    std::array<bool, kReach> floor{};
  };
  std::map<int, Column> columns;

  for (const Eigen::Vector3f& point : points) {
    if (!point.allFinite()) continue;
    const double z = static_cast<double>(point.z());
    const bool obstacle = z >= options_.low_m && z <= options_.high_m;
    if (!obstacle && std::abs(z) > kFloor_m) continue;

    // Its bearing from the camera's direction, and the cell of that beam
    const Eigen::Vector2d way = point.head<2>().cast<double>() - scan.at;
    const auto distance = static_cast<std::size_t>(way.norm() / options_.resolution_m);
    if (distance >= kReach) continue;

    const double bearing = turn_between(std::atan2(way.y(), way.x()), scan.yaw);
    Column& column = columns[static_cast<int>(std::floor(bearing * kBearings / (2.0 * kPi)))];
    if (obstacle) {
      std::uint8_t& count = column.obstacles[distance];
      count = static_cast<std::uint8_t>(std::min<int>(count + 1, 255));
    } else {
      column.floor[distance] = true;
    }
  }

  // Free is the floor that was seen up to the first obstacle; behind that only further obstacles are known.
  std::vector<Beam> beams;
  for (const auto& [number, column] : columns) {
    Beam beam;
    beam.bearing = static_cast<float>((number + 0.5) * 2.0 * kPi / kBearings);
    std::size_t first_hit = kReach;
    std::size_t first_floor = kReach;
    std::size_t last_floor = 0;

    for (std::size_t i = 0; i < kReach; ++i) {
      if (column.obstacles[i] >= kFewestPoints) {
        beam.hits[i / 64] |= std::uint64_t{1} << (i % 64);
        first_hit = std::min(first_hit, i);
      } else if (column.floor[i] && i < first_hit) {
        first_floor = std::min(first_floor, i);
        last_floor = i + 1;
      }
    }

    // Seen floor, up to the obstacle that ends it
    if (first_floor < last_floor) {
      beam.free_from = static_cast<std::uint8_t>(first_floor);
      beam.free_to = static_cast<std::uint8_t>(first_hit < kReach ? first_hit : last_floor);
    }
    beams.push_back(beam);
  }
  return beams;
}

void LiveGrid::draw(const Scan& scan, int sign) {
  std::vector<std::size_t> touched;
  const auto mark = [&](const Eigen::Vector2d& place, std::uint8_t what) {
    const std::size_t cell = cell_at(place);
    if (marks_[cell] == 0) touched.push_back(cell);
    marks_[cell] = std::max(marks_[cell], what);
  };

  // The ground on which the camera was carried
  const int body = static_cast<int>(kBody_m / options_.resolution_m);
  for (int y = -body; y <= body; ++y) {
    for (int x = -body; x <= body; ++x) {
      if (x * x + y * y <= body * body) mark(scan.at + options_.resolution_m * Eigen::Vector2d(x, y), 1);
    }
  }

  // Cells of a scan count once, however many beams cross them; an obstacle outweighs free ground
  for (const Beam& beam : scan.beams) {
    const double angle = scan.yaw + static_cast<double>(beam.bearing);
    const Eigen::Vector2d step = options_.resolution_m * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    for (std::size_t i = 0; i < kReach; ++i) {
      const Eigen::Vector2d place = scan.at + (static_cast<double>(i) + 0.5) * step;
      if (((beam.hits[i / 64] >> (i % 64)) & 1U) != 0)
        mark(place, 2);
      else if (i >= beam.free_from && i < beam.free_to)
        mark(place, 1);
    }
  }

  for (const std::size_t cell : touched) {
    std::uint16_t& count = marks_[cell] == 2 ? cells_[cell].occupied : cells_[cell].free;
    count = static_cast<std::uint16_t>(std::clamp(count + sign, 0, 65535));
    marks_[cell] = 0;
  }
}

void LiveGrid::make_room(const Scan& scan) {
  const double reach_m = (static_cast<double>(kReach) + 1.0) * options_.resolution_m;
  const double block_m = kBlock * options_.resolution_m;

  // Borders of the blocks that the scan may reach
  const auto block = [&](double sign) {
    const Eigen::Array2d place = (scan.at.array() + sign * reach_m) / block_m;
    const Eigen::Array2d outwards = sign * (sign * place).ceil();
    return Eigen::Vector2i(outwards.cast<int>() * kBlock);
  };
  const Eigen::Vector2i low = cells_.empty() ? block(-1.0) : low_.cwiseMin(block(-1.0));
  const Eigen::Vector2i high = cells_.empty() ? block(1.0) : (low_ + size_).cwiseMax(block(1.0));
  if (!cells_.empty() && low == low_ && high == low_ + size_) return;

  // The old cells keep their places in the larger grid
  const Eigen::Vector2i size = high - low;
  std::vector<Cell> cells(static_cast<std::size_t>(size.prod()));
  for (int row = 0; row < size_.y(); ++row) {
    const auto from = cells_.begin() + static_cast<std::ptrdiff_t>(row) * size_.x();
    const auto to = (low_.y() - low.y() + row) * static_cast<std::ptrdiff_t>(size.x()) + low_.x() - low.x();
    std::copy(from, from + size_.x(), cells.begin() + to);
  }

  cells_ = std::move(cells);
  marks_.assign(cells_.size(), 0);
  sent_.clear();
  low_ = low;
  size_ = size;
}

/// A removed obstacle is free once three times as many scans saw through it.
std::uint8_t LiveGrid::value(std::size_t cell) const {
  constexpr std::uint8_t kFree = 0;
  constexpr std::uint8_t kOccupied = 100;
  constexpr std::uint8_t kUnknown = 255;
  const Cell& counts = cells_[cell];
  if (counts.occupied > 0 && 3 * counts.occupied >= counts.free) return kOccupied;
  return counts.free > 0 ? kFree : kUnknown;
}

std::size_t LiveGrid::cell_at(const Eigen::Vector2d& place) const {
  const Eigen::Vector2i at = (place / options_.resolution_m).array().floor().cast<int>().matrix() - low_;
  return static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(size_.x()) +
         static_cast<std::size_t>(at.x());
}

}  // namespace plumbline::net
