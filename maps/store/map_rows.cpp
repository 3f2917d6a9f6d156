// SPDX-License-Identifier: BSD-3-Clause
#include "store/map_rows.hpp"

#include <algorithm>
#include <stdexcept>

#include "plumbline/maps/store_replica.hpp"
#include "store/store_row.hpp"

namespace plumbline::maps {
namespace {

void expect_own(bool own) {
  if (!own) throw BadBytes("it holds what belongs to another row");
}

template <typename Landmark>
std::vector<Landmark> landmarks_of(const Bytes& plain, const MapRows::Key& key) {
  std::vector<Landmark> landmarks = decode_page<Landmark>(plain);
  for (const Landmark& landmark : landmarks) {
    expect_own(landmark.id.robot == key.first && landmark.id.index / kLandmarksPerPage == key.second);
  }
  return landmarks;
}

/// Rows that were lost with a page of the file leave no other trace.
void check_totals(const MapRow& row, const MapParts& parts, const StoredMap& stored) {
  const auto expect = [](std::uint64_t expected, std::size_t found, const char* what) {
    if (expected == found) return;
    throw BadBytes("it holds " + std::to_string(found) + " of " + std::to_string(expected) + " " + what);
  };
  expect(row.keyframes, parts.keyframes.size(), "keyframes");
  expect(row.points, parts.points.size(), "points");
  expect(row.lines, parts.lines.size(), "lines");
  expect(row.edges, parts.edges.size(), "edges");
  expect(row.frames, stored.frames.size(), "frames");
  expect(row.log, stored.log.size(), "lines of its log");
}

void check_frames(const std::vector<FramePose>& frames, const Map& map) {
  for (const FramePose& frame : frames) {
    if (frame.tracked && !map.has_keyframe(frame.reference)) {
      throw BadBytes("a frame hangs on a keyframe that is not there");
    }
  }
}

}  // namespace

void MapRows::put(const std::string& table, const Key& key, const Bytes& plain,
                  const std::vector<RobotInfo>& robots) {
  if (table == "map") maps_[key] = decode<MapRow>(plain);
  if (table == "keyframe") {
    const sensor::Camera camera = camera_of(robots, static_cast<std::int32_t>(key.first));
    auto keyframe = decode_keyframe(plain, camera.color);
    expect_own(keyframe->id.robot == key.first && keyframe->id.index == key.second);
    keyframes_[key] = std::move(keyframe);
  }

  if (table == "state") states_[key] = decode<KeyframeState>(plain);
  if (table == "point") points_[key] = landmarks_of<MapPoint>(plain, key);
  if (table == "line") lines_[key] = landmarks_of<MapLine>(plain, key);

  if (table == "edge") {
    const auto row = decode<EdgeRow>(plain);
    expect_own(row.number == static_cast<std::uint64_t>(key.second));
    edges_[key] = row.edge;
  }

  if (table == "frame") frames_[key] = decode_page<FramePose>(plain);
  if (table == "log") log_[key] = decode_page<std::string>(plain);
}

void MapRows::remove(const std::string& table, const Key& key) {
  if (table == "map") maps_.erase(key);
  if (table == "keyframe") keyframes_.erase(key);
  if (table == "state") states_.erase(key);
  if (table == "point") points_.erase(key);
  if (table == "line") lines_.erase(key);
  if (table == "edge") edges_.erase(key);
  if (table == "frame") frames_.erase(key);
  if (table == "log") log_.erase(key);
}

bool MapRows::is_of(const Key& key, std::int64_t robot) const {
  return maps_.size() <= 1 || key.first == robot;
}

template <typename Row>
std::vector<Row> MapRows::gathered(const Table<std::vector<Row>>& pages, std::int64_t robot) const {
  std::vector<Row> all;
  for (const auto& [key, page] : pages) {
    if (is_of(key, robot)) all.insert(all.end(), page.begin(), page.end());
  }
  return all;
}

/// Checks that each row belongs to a map, in a store with several robots' own maps.
void MapRows::check_owners() const {
  if (maps_.size() <= 1) return;
  const auto check = [&](const auto& rows) {
    for (const auto& [key, row] : rows) {
      if (maps_.count({key.first, 0}) == 0) throw BadBytes("a row belongs to no map");
    }
  };
  check(keyframes_);
  check(states_);
  check(points_);
  check(lines_);
  check(edges_);
  check(frames_);
  check(log_);
}

StoredMap MapRows::map(std::int64_t robot, const MapRow& row) const {
  MapParts parts;
  if (keyframes_.size() != states_.size()) throw BadBytes("a keyframe has no pose, or a pose no keyframe");

  for (const auto& [key, keyframe] : keyframes_) {
    if (!is_of(key, robot)) continue;
    const auto state = states_.find(key);
    if (state == states_.end()) throw BadBytes("a keyframe has no pose");
    parts.keyframes.push_back({keyframe, state->second.camera_from_world, state->second.parent});
  }

  parts.points = gathered(points_, robot);
  parts.lines = gathered(lines_, robot);
  for (const auto& [key, edge] : edges_) {
    if (is_of(key, robot)) parts.edges.emplace_back(key.second, edge);
  }

  std::sort(parts.edges.begin(), parts.edges.end(),  // the table is by robot first
            [](const auto& a, const auto& b) { return a.first < b.first; });
  parts.next = row.next;
  parts.loops = row.loops;

  StoredMap stored;
  stored.frames = gathered(frames_, robot);
  stored.log = gathered(log_, robot);
  check_totals(row, parts, stored);
  try {
    stored.map = Map(std::move(parts));
  } catch (const std::invalid_argument& contradiction) {
    throw BadBytes(contradiction.what());
  }

  check_frames(stored.frames, stored.map);
  return stored;
}

std::vector<StoredMap> MapRows::maps() const {
  check_owners();
  std::vector<StoredMap> maps;
  for (const auto& [key, row] : maps_) {
    maps.push_back(map(key.first, row));
    if (maps_.size() > 1) maps.back().robot = static_cast<std::int32_t>(key.first);
  }
  if (maps_.empty()) maps.push_back(map(0, {}));  // no row yet
  return maps;
}

struct MapFollower::Impl {
  MapRows rows;
  std::vector<RobotInfo> robots;
  std::int64_t head = 0;

  void apply(const StoreRow& row) {
    const RowTable& table = kRowTables[row.name.table];
    const MapRows::Key key{row.name.robot, row.name.number};
    if (row.removed) return rows.remove(table.name, key);
    const bool header = std::string(table.name) == "header";
    if (table.named && !(header && row.name.key == "robots")) return;
    check_row(row.name, row.data, robots);  // adds new robots to `robots`, too
    rows.put(table.name, key, unpack(row.data.data(), row.data.size()), robots);
  }
};

MapFollower::MapFollower() : impl_(std::make_unique<Impl>()) {}
MapFollower::MapFollower(MapFollower&& other) noexcept = default;
MapFollower& MapFollower::operator=(MapFollower&& other) noexcept = default;
MapFollower::~MapFollower() = default;

std::int64_t MapFollower::head() const { return impl_->head; }

core::Result<void> MapFollower::apply(const StoreTransaction& transaction) {
  try {
    Bytes rows = transaction.rows;
    consume_rows(rows, [&](const StoreRow& row, std::size_t) { impl_->apply(row); });
    if (!rows.empty()) throw BadBytes("a row ends too early");
  } catch (const BadBytes& bad) {
    return core::input_error(std::string("rows of a map: ") + bad.what());
  }
  impl_->head = transaction.number;
  return {};
}

core::Result<StoredMap> MapFollower::map() const {
  try {
    std::vector<StoredMap> maps = impl_->rows.maps();
    if (maps.size() != 1) throw BadBytes("they are of several robots");
    maps.front().header.robots = impl_->robots;
    return std::move(maps.front());
  } catch (const BadBytes& bad) {
    return core::input_error(std::string("rows of a map: ") + bad.what());
  }
}

}  // namespace plumbline::maps
