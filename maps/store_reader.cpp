// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "plumbline/cloud/compact_cloud.hpp"
#include "store_codec.hpp"
#include "store_schema.hpp"

namespace plumbline::maps {
namespace {

using core::ErrorKind;

/// Calls row(robot, number, bytes) for all rows of `table` by robot and number; what `row` dislikes is told
/// with the row's name.
template <typename Row>
void read_table(Database& database, const std::string& table, const Row& row) {
  Statement rows(database, ("SELECT robot, number, data FROM " + table + " ORDER BY robot, number").c_str());
  while (rows.step()) {
    const std::int64_t robot = rows.integer(0);
    const std::int64_t number = rows.integer(1);
    try {
      row(KeyframeId{static_cast<std::int32_t>(robot), static_cast<std::int32_t>(number)}, number,
          rows.unpacked(2));
    } catch (const BadBytes& bad) {
      throw BadBytes(table + " " + std::to_string(robot) + "/" + std::to_string(number) + ": " + bad.what());
    }
  }
}

template <typename Landmark>
void read_landmarks(Database& database, const std::string& table, std::vector<Landmark>& landmarks) {
  read_table(database, table, [&](KeyframeId key, std::int64_t page, const Bytes& bytes) {
    const std::size_t before = landmarks.size();
    decode_page(bytes, landmarks);
    for (std::size_t i = before; i < landmarks.size(); ++i) {
      if (landmarks[i].id.robot != key.robot || landmarks[i].id.index / kLandmarksPerPage != page) {
        throw BadBytes("it holds what belongs to another row");
      }
    }
  });
}

Totals read_totals(Database& database) {
  Statement statement(database, "SELECT data FROM header WHERE key = 'totals'");
  if (!statement.step()) throw BadBytes("its header has no totals");
  return decode_totals(statement.unpacked(0));
}

bool is_complete(Database& database) {
  return database.number("SELECT data FROM header WHERE key = 'complete'") == 1;
}

void read_keyframes(Database& database, const sensor::Pinhole& picture, MapParts& parts) {
  read_table(database, "keyframe", [&](KeyframeId id, std::int64_t, const Bytes& bytes) {
    parts.keyframes.push_back({decode_keyframe(bytes, picture), {}, {}});
    if (parts.keyframes.back().data->id != id) throw BadBytes("it holds what belongs to another row");
  });
  std::size_t next = 0;
  read_table(database, "state", [&](KeyframeId id, std::int64_t, const Bytes& bytes) {
    if (next == parts.keyframes.size() || parts.keyframes[next].data->id != id) {
      throw BadBytes("its keyframe is missing");
    }
    const KeyframeState state = decode_state(bytes);
    parts.keyframes[next].camera_from_world = state.camera_from_world;
    parts.keyframes[next++].parent = state.parent;
  });
  if (next != parts.keyframes.size()) throw BadBytes("a keyframe has no pose");
}

/// Rows that were lost with a page of the file leave no other trace.
void check_totals(const Totals& totals, const MapParts& parts, const StoredMap& stored) {
  const auto expect = [](std::uint64_t expected, std::size_t found, const char* what) {
    if (expected == found) return;
    throw BadBytes("it holds " + std::to_string(found) + " of " + std::to_string(expected) + " " + what);
  };
  expect(totals.keyframes, parts.keyframes.size(), "keyframes");
  expect(totals.points, parts.points.size(), "points");
  expect(totals.lines, parts.lines.size(), "lines");
  expect(totals.edges, parts.edges.size(), "edges");
  expect(totals.frames, stored.frames.size(), "frames");
  expect(totals.log, stored.log.size(), "lines of its log");
}

void check_frames(const std::vector<FramePose>& frames, const Map& map) {
  for (const FramePose& frame : frames) {
    if (frame.tracked && !map.has_keyframe(frame.reference)) {
      throw BadBytes("a frame hangs on a keyframe that is not there");
    }
  }
}

Map map_of(MapParts parts) {
  try {
    return Map(std::move(parts));
  } catch (const std::invalid_argument& contradiction) {
    throw BadBytes(contradiction.what());
  }
}

StoredMap read_map(Database& database, const StoreHeader& header) {
  const Transaction moment(database, false);  // one moment of a store that is being written
  MapParts parts;
  StoredMap stored;
  stored.header = header;
  const Totals totals = read_totals(database);
  stored.complete = is_complete(database);
  read_keyframes(database, header.camera.color, parts);
  read_landmarks(database, "point", parts.points);
  read_landmarks(database, "line", parts.lines);
  read_table(database, "edge", [&](KeyframeId, std::int64_t number, const Bytes& bytes) {
    parts.edges.emplace_back(static_cast<std::uint64_t>(number),
                             decode_edge(bytes, static_cast<std::uint64_t>(number)));
  });
  std::sort(parts.edges.begin(), parts.edges.end(),  // the table is by robot first
            [](const auto& a, const auto& b) { return a.first < b.first; });
  parts.loops = decode_loops(read_loops(database));
  read_table(database, "frame",
             [&](KeyframeId, std::int64_t, const Bytes& bytes) { decode_page(bytes, stored.frames); });
  stored.log = read_log(database);
  check_totals(totals, parts, stored);
  if (stored.complete) stored.result = read_result_frame(database);
  parts.next = totals.next;
  stored.map = map_of(std::move(parts));
  check_frames(stored.frames, stored.map);
  return stored;
}

std::string name_of(KeyframeId id) { return std::to_string(id.robot) + "/" + std::to_string(id.index); }

}  // namespace

struct StoreReader::Impl {
  std::filesystem::path file;
  std::unique_ptr<Database> database;
  StoreHeader header;

  /// A cloud's bytes; `what` names it.
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> blob(const char* sql, std::int64_t robot,
                                                             std::int64_t number,
                                                             const std::string& what) const;
  /// What a store may keep of a cloud beside it; empty: this one does not.
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> extra(const char* sql, std::int64_t robot,
                                                              std::int64_t number) const;
  [[nodiscard]] core::Result<cloud::CloudPtr> decode(const core::Result<std::vector<std::uint8_t>>& bytes,
                                                     const std::string& what) const;
};

StoreReader::StoreReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StoreReader::StoreReader(StoreReader&& other) noexcept = default;
StoreReader::~StoreReader() = default;

core::Result<StoreReader> StoreReader::open(const std::filesystem::path& file) {
  return guarded(file, ErrorKind::kInput, [&] {
    check_file(file);
    auto impl = std::make_unique<Impl>();
    impl->file = file;
    impl->database = std::make_unique<Database>(file, Database::Access::kRead);
    check_store(*impl->database);
    impl->header = read_header(*impl->database);
    return StoreReader(std::move(impl));
  });
}

const StoreHeader& StoreReader::header() const { return impl_->header; }

/// In parts: of more at a time only the beginning is read.
void StoreReader::read_ahead() const {
#ifdef POSIX_FADV_WILLNEED
  constexpr off_t kPart = 4 << 20;
  const int file = ::open(impl_->file.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;  // who reads will tell
  const off_t size = ::lseek(file, 0, SEEK_END);
  for (off_t at = 0; at < size; at += kPart) ::posix_fadvise(file, at, kPart, POSIX_FADV_WILLNEED);
  ::close(file);
#endif
}

core::Result<StoredMap> StoreReader::load() const {
  return guarded(impl_->file, ErrorKind::kInput, [&] { return read_map(*impl_->database, impl_->header); });
}

core::Result<std::vector<KeyframeId>> StoreReader::cloud_ids() const {
  return guarded(impl_->file, ErrorKind::kInput, [&] {
    std::vector<KeyframeId> ids;
    Statement rows(*impl_->database, "SELECT robot, number FROM cloud ORDER BY robot, number");
    while (rows.step()) {
      ids.push_back({static_cast<std::int32_t>(rows.integer(0)), static_cast<std::int32_t>(rows.integer(1))});
    }
    return ids;
  });
}

core::Result<std::vector<std::size_t>> StoreReader::frame_cloud_ids() const {
  return guarded(impl_->file, ErrorKind::kInput, [&] {
    std::vector<std::size_t> ids;
    Statement rows(*impl_->database, "SELECT number FROM frame_cloud ORDER BY robot, number");
    while (rows.step()) ids.push_back(static_cast<std::size_t>(rows.integer(0)));
    return ids;
  });
}

core::Result<std::vector<std::uint8_t>> StoreReader::Impl::blob(const char* sql, std::int64_t robot,
                                                                std::int64_t number,
                                                                const std::string& what) const {
  return guarded(file, ErrorKind::kInput, [&] {
    Statement row(*database, sql);
    if (!row.bind(1, robot).bind(2, number).step()) {
      throw StoreFailure(ErrorKind::kInput, "has no cloud of " + what);
    }
    return row.blob(0);
  });
}

core::Result<cloud::CloudPtr> StoreReader::Impl::decode(const core::Result<std::vector<std::uint8_t>>& bytes,
                                                        const std::string& what) const {
  if (!bytes) return tl::unexpected<core::Error>(bytes.error());
  core::Result<cloud::CloudPtr> cloud = cloud::decode_cloud(bytes->data(), bytes->size());
  if (cloud) return cloud;
  return core::input_error(file.string() + ": " + what + ": " + cloud.error().message);
}

core::Result<std::vector<std::uint8_t>> StoreReader::cloud_bytes(KeyframeId keyframe) const {
  return impl_->blob("SELECT data FROM cloud WHERE robot = ? AND number = ?", keyframe.robot, keyframe.index,
                     "keyframe " + name_of(keyframe));
}

core::Result<cloud::CloudPtr> StoreReader::cloud(KeyframeId keyframe) const {
  return impl_->decode(cloud_bytes(keyframe), "keyframe " + name_of(keyframe));
}

core::Result<std::vector<std::uint8_t>> StoreReader::Impl::extra(const char* sql, std::int64_t robot,
                                                                 std::int64_t number) const {
  return guarded(file, ErrorKind::kInput, [&]() -> std::vector<std::uint8_t> {
    Statement row(*database, sql);
    if (!row.bind(1, robot).bind(2, number).step()) return {};
    return row.blob(0);
  });
}

core::Result<std::vector<std::uint8_t>> StoreReader::surface_bytes(KeyframeId keyframe) const {
  return impl_->extra("SELECT data FROM surface WHERE robot = ? AND number = ?", keyframe.robot,
                      keyframe.index);
}

core::Result<StoredSurface> unpack_surface(const std::vector<std::uint8_t>& bytes) {
  try {
    return decode_surface(unpack(bytes.data(), bytes.size()));
  } catch (const BadBytes& bad) {
    return core::input_error(std::string("stored surface: ") + bad.what() + "; it cannot be used");
  }
}

core::Result<std::vector<std::uint8_t>> StoreReader::frame_cloud_bytes(std::size_t frame) const {
  return impl_->blob("SELECT data FROM frame_cloud WHERE robot = ? AND number = ?", 0,
                     static_cast<std::int64_t>(frame), "frame " + std::to_string(frame));
}

core::Result<cloud::CloudPtr> StoreReader::frame_cloud(std::size_t frame) const {
  return impl_->decode(frame_cloud_bytes(frame), "frame " + std::to_string(frame));
}

core::Result<StoreContents> StoreReader::contents() const {
  return guarded(impl_->file, ErrorKind::kInput, [&] {
    Database& database = *impl_->database;
    const Transaction moment(database, false);
    const Totals totals = read_totals(database);
    const auto count = [&](const char* sql) { return static_cast<std::size_t>(database.number(sql)); };
    StoreContents contents;
    contents.complete = is_complete(database);
    contents.keyframes = totals.keyframes;
    contents.points = totals.points;
    contents.lines = totals.lines;
    contents.edges = totals.edges;
    contents.loops = decode_loops(read_loops(database)).size();
    contents.frames = totals.frames;
    contents.keyframe_clouds = count("SELECT count(*) FROM cloud");
    contents.frame_clouds = count("SELECT count(*) FROM frame_cloud");
    contents.cloud_bytes = count(
        "SELECT (SELECT total(length(data)) FROM cloud)"
        " + (SELECT total(length(data)) FROM frame_cloud)");
    Statement names(database, "SELECT key FROM attachment ORDER BY key");
    while (names.step()) contents.attachments.push_back(names.text(0));
    return contents;
  });
}

core::Result<std::optional<std::vector<std::uint8_t>>> StoreReader::attachment(
    const std::string& name) const {
  return guarded(impl_->file, ErrorKind::kInput, [&]() -> std::optional<std::vector<std::uint8_t>> {
    Statement row(*impl_->database, "SELECT data FROM attachment WHERE key = ?");
    if (!row.bind(1, name).step()) return std::nullopt;
    return row.unpacked(0);
  });
}

core::Result<bool> is_blank_store(const std::filesystem::path& file) {
  return guarded(file, ErrorKind::kInput, [&] {
    check_file(file);
    Database database(file, Database::Access::kRead);
    return is_blank(database);
  });
}

core::Result<StoredMap> load_map(const std::filesystem::path& file) {
  const core::Result<StoreReader> reader = StoreReader::open(file);
  if (!reader) return tl::unexpected<core::Error>(reader.error());
  return reader->load();
}

}  // namespace plumbline::maps
