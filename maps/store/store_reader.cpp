// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <utility>

#include "plumbline/cloud/compact_cloud.hpp"
#include "store/store_codec.hpp"
#include "store/store_schema.hpp"

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

/// The maps of a store while they are read.
class Pieces {
 public:
  struct Piece {
    MapRow row;
    MapParts parts;
    StoredMap stored;
    std::size_t states = 0;  ///< read so far
  };
  explicit Pieces(Database& database) {
    read_table(database, "map", [&](KeyframeId key, std::int64_t, const Bytes& bytes) {
      pieces_[key.robot].row = decode<MapRow>(bytes);
    });
    if (pieces_.empty()) pieces_[0];  // nothing was added yet
  }
  /// That of a robot: the only one, or its own.
  Piece& of(std::int32_t robot) {
    if (pieces_.size() == 1) return pieces_.begin()->second;
    const auto found = pieces_.find(robot);
    if (found == pieces_.end()) throw BadBytes("it belongs to no map");
    return found->second;
  }
  [[nodiscard]] std::map<std::int32_t, Piece>& all() { return pieces_; }

 private:
  std::map<std::int32_t, Piece> pieces_;
};

template <typename Landmark>
void read_landmarks(Database& database, const std::string& table, Pieces& pieces,
                    std::vector<Landmark> MapParts::*member) {
  read_table(database, table, [&](KeyframeId key, std::int64_t page, const Bytes& bytes) {
    std::vector<Landmark>& landmarks = pieces.of(key.robot).parts.*member;
    const std::size_t before = landmarks.size();
    decode_page(bytes, landmarks);
    for (std::size_t i = before; i < landmarks.size(); ++i) {
      if (landmarks[i].id.robot != key.robot || landmarks[i].id.index / kLandmarksPerPage != page) {
        throw BadBytes("it holds what belongs to another row");
      }
    }
  });
}

bool is_complete(Database& database) {
  return database.number("SELECT data FROM header WHERE key = 'complete'") == 1;
}

void read_keyframes(Database& database, const std::vector<RobotInfo>& robots, Pieces& pieces) {
  std::map<std::int32_t, sensor::Camera> cameras;
  read_table(database, "keyframe", [&](KeyframeId id, std::int64_t, const Bytes& bytes) {
    const auto camera = cameras.try_emplace(id.robot, camera_of(robots, id.robot)).first;
    MapParts& parts = pieces.of(id.robot).parts;
    parts.keyframes.push_back({decode_keyframe(bytes, camera->second.color), {}, {}});
    if (parts.keyframes.back().data->id != id) throw BadBytes("it holds what belongs to another row");
  });
  read_table(database, "state", [&](KeyframeId id, std::int64_t, const Bytes& bytes) {
    Pieces::Piece& piece = pieces.of(id.robot);
    std::vector<MapParts::KeyframePart>& keyframes = piece.parts.keyframes;
    if (piece.states == keyframes.size() || keyframes[piece.states].data->id != id) {
      throw BadBytes("its keyframe is missing");
    }
    const KeyframeState state = decode<KeyframeState>(bytes);
    keyframes[piece.states].camera_from_world = state.camera_from_world;
    keyframes[piece.states++].parent = state.parent;
  });
  for (const auto& [robot, piece] : pieces.all()) {
    if (piece.states != piece.parts.keyframes.size()) throw BadBytes("a keyframe has no pose");
  }
}

/// Rows that were lost with a page of the file leave no other trace.
void check_totals(const Pieces::Piece& piece) {
  const auto expect = [](std::uint64_t expected, std::size_t found, const char* what) {
    if (expected == found) return;
    throw BadBytes("it holds " + std::to_string(found) + " of " + std::to_string(expected) + " " + what);
  };
  expect(piece.row.keyframes, piece.parts.keyframes.size(), "keyframes");
  expect(piece.row.points, piece.parts.points.size(), "points");
  expect(piece.row.lines, piece.parts.lines.size(), "lines");
  expect(piece.row.edges, piece.parts.edges.size(), "edges");
  expect(piece.row.frames, piece.stored.frames.size(), "frames");
  expect(piece.row.log, piece.stored.log.size(), "lines of its log");
}

void check_frames(const std::vector<FramePose>& frames, const Map& map) {
  for (const FramePose& frame : frames) {
    if (frame.tracked && !map.has_keyframe(frame.reference)) {
      throw BadBytes("a frame hangs on a keyframe that is not there");
    }
  }
}

StoredMap whole(Pieces::Piece& piece) {
  check_totals(piece);
  std::sort(piece.parts.edges.begin(), piece.parts.edges.end(),  // the table is by robot first
            [](const auto& a, const auto& b) { return a.first < b.first; });
  piece.parts.next = std::move(piece.row.next);
  piece.parts.loops = std::move(piece.row.loops);
  try {
    piece.stored.map = Map(std::move(piece.parts));
  } catch (const std::invalid_argument& contradiction) {
    throw BadBytes(contradiction.what());
  }
  check_frames(piece.stored.frames, piece.stored.map);
  return std::move(piece.stored);
}

std::vector<StoredMap> read_maps(Database& database, const StoreHeader& header) {
  const Transaction moment(database, false);  // one moment of a store that is being written
  Pieces pieces(database);
  read_keyframes(database, header.robots, pieces);
  read_landmarks(database, "point", pieces, &MapParts::points);
  read_landmarks(database, "line", pieces, &MapParts::lines);
  read_table(database, "edge", [&](KeyframeId key, std::int64_t number, const Bytes& bytes) {
    const auto row = decode<EdgeRow>(bytes);
    if (row.number != static_cast<std::uint64_t>(number))
      throw BadBytes("it holds what belongs to another row");
    pieces.of(key.robot).parts.edges.emplace_back(row.number, row.edge);
  });
  read_table(database, "frame", [&](KeyframeId key, std::int64_t, const Bytes& bytes) {
    decode_page(bytes, pieces.of(key.robot).stored.frames);
  });
  read_table(database, "log", [&](KeyframeId key, std::int64_t, const Bytes& bytes) {
    decode_page(bytes, pieces.of(key.robot).stored.log);
  });
  std::vector<StoredMap> maps;
  for (auto& [robot, piece] : pieces.all()) {
    maps.push_back(whole(piece));
    maps.back().header = header;
    maps.back().complete = is_complete(database);
    if (maps.back().complete) maps.back().result = read_result_frame(database);
  }
  return maps;
}

template <typename IdType>
std::string name_of(IdType id) {
  return std::to_string(id.robot) + "/" + std::to_string(id.index);
}

}  // namespace

struct StoreReader::Impl {
  std::filesystem::path file;
  std::unique_ptr<Database> database;
  StoreHeader header;

  template <typename IdType>
  [[nodiscard]] core::Result<std::vector<IdType>> ids(const char* sql) const;
  /// A cloud's bytes; `what` names it.
  template <typename IdType>
  [[nodiscard]] core::Result<std::vector<std::uint8_t>> blob(const char* sql, IdType id,
                                                             const std::string& what) const;
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

core::Result<std::vector<StoredMap>> StoreReader::load_each() const {
  return guarded(impl_->file, ErrorKind::kInput, [&] { return read_maps(*impl_->database, impl_->header); });
}

core::Result<StoredMap> StoreReader::load() const {
  auto maps = load_each();
  if (!maps) return tl::unexpected<core::Error>(maps.error());
  if (maps->size() == 1) return std::move(maps->front());
  return core::input_error(impl_->file.string() + ": the maps of its " + std::to_string(maps->size()) +
                           " robots are not one yet; go on with plumbline map --resume");
}

template <typename IdType>
core::Result<std::vector<IdType>> StoreReader::Impl::ids(const char* sql) const {
  return guarded(file, ErrorKind::kInput, [&] {
    std::vector<IdType> ids;
    Statement rows(*database, sql);
    while (rows.step()) {
      ids.push_back({static_cast<std::int32_t>(rows.integer(0)), static_cast<std::int32_t>(rows.integer(1))});
    }
    return ids;
  });
}

core::Result<std::vector<KeyframeId>> StoreReader::cloud_ids() const {
  return impl_->ids<KeyframeId>("SELECT robot, number FROM cloud ORDER BY robot, number");
}

core::Result<std::vector<FrameId>> StoreReader::frame_cloud_ids() const {
  return impl_->ids<FrameId>("SELECT robot, number FROM frame_cloud ORDER BY robot, number");
}

template <typename IdType>
core::Result<std::vector<std::uint8_t>> StoreReader::Impl::blob(const char* sql, IdType id,
                                                                const std::string& what) const {
  return guarded(file, ErrorKind::kInput, [&]() -> std::vector<std::uint8_t> {
    Statement row(*database, sql);
    if (row.bind(1, id.robot).bind(2, id.index).step()) return row.blob(0);
    if (what.empty()) return {};
    throw StoreFailure(ErrorKind::kInput, "has no cloud of " + what);
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
  return impl_->blob("SELECT data FROM cloud WHERE robot = ? AND number = ?", keyframe,
                     "keyframe " + name_of(keyframe));
}

core::Result<cloud::CloudPtr> StoreReader::cloud(KeyframeId keyframe) const {
  return impl_->decode(cloud_bytes(keyframe), "keyframe " + name_of(keyframe));
}

core::Result<std::vector<std::uint8_t>> StoreReader::cloud_bytes(FrameId frame) const {
  return impl_->blob("SELECT data FROM frame_cloud WHERE robot = ? AND number = ?", frame,
                     "frame " + name_of(frame));
}

core::Result<cloud::CloudPtr> StoreReader::cloud(FrameId frame) const {
  return impl_->decode(cloud_bytes(frame), "frame " + name_of(frame));
}

core::Result<std::vector<std::uint8_t>> StoreReader::surface_bytes(KeyframeId keyframe) const {
  return impl_->blob("SELECT data FROM surface WHERE robot = ? AND number = ?", keyframe, "");
}

core::Result<StoredSurface> unpack_surface(const std::vector<std::uint8_t>& bytes) {
  try {
    return decode_surface(unpack(bytes.data(), bytes.size()));
  } catch (const BadBytes& bad) {
    return core::input_error(std::string("stored surface: ") + bad.what() + "; it cannot be used");
  }
}

core::Result<StoreContents> StoreReader::contents() const {
  return guarded(impl_->file, ErrorKind::kInput, [&] {
    Database& database = *impl_->database;
    const Transaction moment(database, false);
    const auto count = [&](const char* sql) { return static_cast<std::size_t>(database.number(sql)); };
    StoreContents contents;
    contents.complete = is_complete(database);
    Pieces pieces(database);
    for (const auto& [robot, piece] : pieces.all()) {
      contents.keyframes += piece.row.keyframes;
      contents.points += piece.row.points;
      contents.lines += piece.row.lines;
      contents.edges += piece.row.edges;
      contents.loops += piece.row.loops.size();
      contents.frames += piece.row.frames;
    }
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

sensor::Camera camera_of(const std::vector<RobotInfo>& robots, std::int32_t robot) {
  for (const RobotInfo& info : robots) {
    if (info.number == robot) return info.camera;
  }
  return robots.empty() ? sensor::Camera() : robots.front().camera;
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
