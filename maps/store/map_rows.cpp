// SPDX-License-Identifier: BSD-3-Clause
#include "store/map_rows.hpp"

#include <algorithm>
#include <atomic>
#include <stdexcept>

#include "plumbline/maps/map_join.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "store/store_row.hpp"

namespace plumbline::maps {
namespace {

void expect_own(bool own) {
  if (!own) throw BadBytes("it holds what belongs to another row");
}

template <typename Item>
Page<Item> page_of(const Bytes& plain) {
  return std::make_shared<const std::vector<Item>>(decode_page<Item>(plain));
}

/// A page's landmarks; each must belong to this page.
template <typename Landmark>
Page<Landmark> landmarks_of(const Bytes& plain, std::int64_t robot, std::int64_t number) {
  Page<Landmark> landmarks = page_of<Landmark>(plain);
  for (const Landmark& landmark : *landmarks) {
    expect_own(landmark.id.robot == robot && landmark.id.index / kLandmarksPerPage == number);
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

/// Robot 0, which must be the only one, gets another number.
void rename_only_robot(std::int32_t number, MapParts& parts, std::vector<FramePose>& frames) {
  const auto is_other = [](const MapParts::KeyframePart& part) { return part.data->id.robot != 0; };
  if (std::any_of(parts.keyframes.begin(), parts.keyframes.end(), is_other))
    throw BadBytes("they are of several robots");
  renumber(parts, {{0, number}});
  for (FramePose& frame : frames) {
    if (frame.reference.valid()) frame.reference.robot = number;
  }
}

}  // namespace

RowContent decode_row(const std::string& table, std::int64_t robot, std::int64_t number, const Bytes& plain,
                      const std::vector<RobotInfo>& robots) {
  if (table == "map") return decode<MapRow>(plain);

  // Keyframes need the camera for their grid
  if (table == "keyframe") {
    auto keyframe = decode_keyframe(plain, camera_of(robots, static_cast<std::int32_t>(robot)).color);
    expect_own(keyframe->id.robot == robot && keyframe->id.index == number);
    return keyframe;
  }

  // Poses and landmarks
  if (table == "state") return decode<KeyframeState>(plain);
  if (table == "point") return landmarks_of<MapPoint>(plain, robot, number);
  if (table == "line") return landmarks_of<MapLine>(plain, robot, number);

  // Edges repeat their number
  if (table == "edge") {
    const auto row = decode<EdgeRow>(plain);
    expect_own(row.number == static_cast<std::uint64_t>(number));
    return row;
  }

  // Lists in pages
  if (table == "frame") return page_of<FramePose>(plain);
  if (table == "log") return page_of<std::string>(plain);
  return {};
}

/// All rows of the store, decoded.
MapRows MapRows::read(Database& database, const std::vector<RobotInfo>& robots) {
  MapRows all;
  for (const char* table : {"map", "keyframe", "state", "point", "line", "edge", "frame", "log"}) {
    each_row(database, table, [&](std::int64_t robot, std::int64_t number, const Bytes& plain) {
      all.put({robot, number}, decode_row(table, robot, number, plain, robots));
    });
  }
  return all;
}

/// A decoded row goes to the table of its type.
void MapRows::put(const Key& key, RowContent content) {
  struct Put {
    MapRows& rows;
    const Key& key;
    void operator()(std::monostate /*none*/) const {}
    void operator()(MapRow&& row) const { rows.maps_[key] = std::move(row); }
    void operator()(std::shared_ptr<const Keyframe>&& row) const { rows.keyframes_[key] = std::move(row); }
    void operator()(KeyframeState&& row) const { rows.states_[key] = row; }
    void operator()(Page<MapPoint>&& row) const { rows.points_[key] = std::move(row); }
    void operator()(Page<MapLine>&& row) const { rows.lines_[key] = std::move(row); }
    void operator()(EdgeRow&& row) const { rows.edges_[key] = std::move(row.edge); }
    void operator()(Page<FramePose>&& row) const { rows.frames_[key] = std::move(row); }
    void operator()(Page<std::string>&& row) const { rows.log_[key] = std::move(row); }
  };
  std::visit(Put{*this, key}, std::move(content));
}

/// Erases a row; tables without content are ignored.
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

/// The lists of all pages of one robot, joined.
template <typename Row>
std::vector<Row> MapRows::gathered(const Table<Page<Row>>& pages, std::int64_t robot) const {
  std::vector<Row> all;
  for (const auto& [key, page] : pages) {
    if (is_of(key, robot)) all.insert(all.end(), page->begin(), page->end());
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

StoredMap MapRows::map(std::int64_t robot, const MapRow& row, std::optional<std::int32_t> number) const {
  // Each keyframe has one pose and one parent
  MapParts parts;
  if (keyframes_.size() != states_.size()) throw BadBytes("a keyframe has no pose, or a pose no keyframe");

  // Poses and parents are rows of their own table
  for (const auto& [key, keyframe] : keyframes_) {
    if (!is_of(key, robot)) continue;
    const auto state = states_.find(key);
    if (state == states_.end()) throw BadBytes("a keyframe has no pose");
    parts.keyframes.push_back({keyframe, state->second.camera_from_world, state->second.parent});
  }

  // Landmarks and edges of this robot
  parts.points = gathered(points_, robot);
  parts.lines = gathered(lines_, robot);
  for (const auto& [key, edge] : edges_) {
    if (is_of(key, robot)) parts.edges.emplace_back(key.second, edge);
  }
  std::sort(parts.edges.begin(), parts.edges.end(),  // the table is by robot first
            [](const auto& a, const auto& b) { return a.first < b.first; });

  // The next free ids and the loops
  parts.next = row.next;
  parts.loops = row.loops;

  // Frames and log are beside the map
  StoredMap stored;
  stored.frames = gathered(frames_, robot);
  stored.log = gathered(log_, robot);

  // Missing pages and contradictions are damage
  check_totals(row, parts, stored);
  if (number) rename_only_robot(*number, parts, stored.frames);
  try {
    stored.map = Map(std::move(parts));
  } catch (const std::invalid_argument& contradiction) {
    throw BadBytes(contradiction.what());
  }
  check_frames(stored.frames, stored.map);
  return stored;
}

/// One map per robot, or one map of all.
std::vector<StoredMap> MapRows::maps(std::optional<std::int32_t> number) const {
  check_owners();
  std::vector<StoredMap> maps;
  for (const auto& [key, row] : maps_) {
    maps.push_back(map(key.first, row, number));
    if (maps_.size() > 1) maps.back().robot = static_cast<std::int32_t>(key.first);
  }
  if (maps_.empty()) maps.push_back(map(0, {}, number));  // no row yet
  return maps;
}

/// The map as of the last transaction; fails if a row was damaged.
core::Result<StoredMap> GrowingMap::map(std::optional<std::int32_t> number) const {
  try {
    if (!damage.empty()) throw BadBytes(damage);
    std::vector<StoredMap> maps = rows.maps(number);
    if (maps.size() != 1) throw BadBytes("they are of several robots");
    maps.front().header.robots = robots;
    return std::move(maps.front());
  } catch (const BadBytes& bad) {
    return core::input_error(std::string("rows of a map: ") + bad.what());
  }
}

GrowingMap& own(std::shared_ptr<GrowingMap>& map) {
  if (map.use_count() > 1) map = std::make_shared<GrowingMap>(*map);
  std::atomic_thread_fence(std::memory_order_acquire);  // whoever shared it has read it
  return *map;
}

MapFollower::MapFollower() : map_(std::make_shared<GrowingMap>()) {}

std::int64_t MapFollower::head() const { return map_->head; }
core::Result<StoredMap> MapFollower::map(std::optional<std::int32_t> number) const {
  return map_->map(number);
}

/// Applies a transaction's rows to the growing map; the first bad row ends it.
core::Result<void> MapFollower::apply(const StoreTransaction& transaction) {
  GrowingMap& map = own(map_);
  try {
    Bytes rows = transaction.rows;
    consume_rows(rows, [&](const StoreRow& row, std::size_t) {
      const char* table = kRowTables[row.name.table].name;
      if (std::string(table) == "attachment") return;
      const MapRows::Key key{row.name.robot, row.name.number};
      if (row.removed) return map.rows.remove(table, key);
      map.rows.put(key, check_row(row.name, row.data, map.robots));
    });
    if (!rows.empty()) throw BadBytes("a row ends too early");
  } catch (const BadBytes& bad) {
    return core::input_error(std::string("rows of a map: ") + bad.what());
  }
  map.head = transaction.number;
  return {};
}

}  // namespace plumbline::maps
