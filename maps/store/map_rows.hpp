// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The rows of maps, decoded one by one: all of a file at once, or as they arrive.
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "store/store_codec.hpp"

namespace plumbline::maps {

class MapRows {
 public:
  using Key = std::pair<std::int64_t, std::int64_t>;  ///< robot, number
  /// Tables of rows that are looked at here, those first that others need.
  static constexpr const char* kTables[] = {"map",  "keyframe", "state", "point",
                                            "line", "edge",     "frame", "log"};

  /// Applies the present content of a row, unpacked; rows of other tables are skipped. Throws BadBytes.
  void put(const std::string& table, const Key& key, const Bytes& plain,
           const std::vector<RobotInfo>& robots);
  void remove(const std::string& table, const Key& key);
  /// Each map that there is, by robot, without header: the only one, or each robot's own. Throws BadBytes:
  /// rows are missing or contradict each other.
  [[nodiscard]] std::vector<StoredMap> maps() const;

 private:
  template <typename Row>
  using Table = std::map<Key, Row>;
  template <typename Row>
  [[nodiscard]] std::vector<Row> gathered(const Table<std::vector<Row>>& pages, std::int64_t robot) const;
  [[nodiscard]] StoredMap map(std::int64_t robot, const MapRow& row) const;
  /// True if a row belongs to the map of `robot`.
  [[nodiscard]] bool is_of(const Key& key, std::int64_t robot) const;
  void check_owners() const;

  Table<MapRow> maps_;
  Table<std::shared_ptr<const Keyframe>> keyframes_;
  Table<KeyframeState> states_;
  Table<std::vector<MapPoint>> points_;
  Table<std::vector<MapLine>> lines_;
  Table<SurfaceEdge> edges_;
  Table<std::vector<FramePose>> frames_;
  Table<std::vector<std::string>> log_;
};

}  // namespace plumbline::maps
