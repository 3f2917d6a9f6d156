// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The rows of maps, decoded one by one: all of a file at once, or as they arrive.
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "store/store_codec.hpp"
#include "store/store_sqlite.hpp"

namespace plumbline::maps {

/// Rows of one kind that share a row of the store; copies share the memory.
template <typename Item>
using Page = std::shared_ptr<const std::vector<Item>>;

/// Content of a row of a map; none for rows of other tables.
using RowContent = std::variant<std::monostate, MapRow, std::shared_ptr<const Keyframe>, KeyframeState,
                                Page<MapPoint>, Page<MapLine>, EdgeRow, Page<FramePose>, Page<std::string>>;

/// Decodes the unpacked bytes of a row. Throws BadBytes: they do not decode, or belong to another row.
RowContent decode_row(const std::string& table, std::int64_t robot, std::int64_t number, const Bytes& plain,
                      const std::vector<RobotInfo>& robots);

/// Cheap to copy: keyframes and pages are shared.
class MapRows {
 public:
  /// All rows of a file. Throws BadBytes, StoreFailure.
  static MapRows read(Database& database, const std::vector<RobotInfo>& robots);

  using Key = std::pair<std::int64_t, std::int64_t>;  ///< robot, number
  /// Applies the present content of a row; rows of other tables are skipped.
  void put(const Key& key, RowContent content);
  void remove(const std::string& table, const Key& key);
  /// Each map that there is, by robot, without header: the only one, or each robot's own. `number`: as
  /// MapFollower::map(). Throws BadBytes: rows are missing or contradict each other.
  [[nodiscard]] std::vector<StoredMap> maps(std::optional<std::int32_t> number = {}) const;

 private:
  template <typename Row>
  using Table = std::map<Key, Row>;
  template <typename Row>
  [[nodiscard]] std::vector<Row> gathered(const Table<Page<Row>>& pages, std::int64_t robot) const;
  [[nodiscard]] StoredMap map(std::int64_t robot, const MapRow& row,
                              std::optional<std::int32_t> number) const;
  /// True if a row belongs to the map of `robot`.
  [[nodiscard]] bool is_of(const Key& key, std::int64_t robot) const;
  void check_owners() const;

  Table<MapRow> maps_;
  Table<std::shared_ptr<const Keyframe>> keyframes_;
  Table<KeyframeState> states_;
  Table<Page<MapPoint>> points_;
  Table<Page<MapLine>> lines_;
  Table<SurfaceEdge> edges_;
  Table<Page<FramePose>> frames_;
  Table<Page<std::string>> log_;
};

/// The rows of one robot's map as they arrive.
struct GrowingMap {
  MapRows rows;
  std::vector<RobotInfo> robots;
  std::int64_t head = 0;  ///< number of the last transaction applied
  std::string damage;     ///< why rows cannot be read; empty: they can

  /// With the robots as header. Errors as MapFollower::map().
  [[nodiscard]] core::Result<StoredMap> map(std::optional<std::int32_t> number) const;
};

/// The map to change: a copy of its own, if others hold it too. Copies share rows, but not their table.
GrowingMap& own(std::shared_ptr<GrowingMap>& map);

}  // namespace plumbline::maps
