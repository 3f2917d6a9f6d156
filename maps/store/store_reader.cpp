// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <utility>

#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "store/map_rows.hpp"
#include "store/store_schema.hpp"

namespace plumbline::maps {
namespace {

using core::ErrorKind;

bool is_complete(Database& database) {
  return database.number("SELECT data FROM header WHERE key = 'complete'") == 1;
}

/// Reads the points that frames saw, for a run that is resumed.
void read_seen(Database& database, std::vector<FramePose>& frames) {
  std::map<std::int32_t, std::int32_t> next;  // number of a robot's next frame
  Statement row(database, "SELECT data FROM seen WHERE robot = ? AND number = ?");
  for (FramePose& frame : frames) {
    const std::int32_t robot = frame.reference.robot;
    if (row.bind(1, robot).bind(2, next[robot]++).step())
      frame.seen = std::make_shared<SeenPoints>(decode<SeenPoints>(row.unpacked(0)));
    row.reset();
  }
}

/// The maps of all robots, read at one moment of the store.
std::vector<StoredMap> read_maps(Database& database, const StoreHeader& header) {
  const Transaction moment(database, false);  // one moment of a store that is being written
  std::vector<StoredMap> maps = MapRows::read(database, header.robots).maps();
  for (StoredMap& map : maps) {
    map.header = header;
    map.complete = is_complete(database);
    if (map.complete) map.result = read_result_frame(database);
    if (!map.complete) read_seen(database, map.frames);
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

/// Opens a store and checks its kind, format and header.
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

/// Requests the file in parts: of a longer request the system reads only the beginning.
void StoreReader::read_ahead() const {
#ifdef POSIX_FADV_WILLNEED
  constexpr off_t kPart = 4 << 20;
  const int file = ::open(impl_->file.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;  // the read will report it
  const off_t size = ::lseek(file, 0, SEEK_END);
  for (off_t at = 0; at < size; at += kPart) ::posix_fadvise(file, at, kPart, POSIX_FADV_WILLNEED);
  ::close(file);
#endif
}

core::Result<std::vector<StoredMap>> StoreReader::load_each() const {
  return guarded(impl_->file, ErrorKind::kInput, [&] { return read_maps(*impl_->database, impl_->header); });
}

/// The map, or that of `robot` while the robots' maps are separate.
core::Result<StoredMap> StoreReader::load(const std::string& robot) const {
  auto maps = load_each();
  if (!maps) return tl::unexpected(maps.error());
  if (maps->size() == 1) return std::move(maps->front());

  // Separate maps: one must be named
  std::string names;
  for (StoredMap& map : *maps) {
    for (const RobotInfo& info : impl_->header.robots) {
      if (info.number != map.robot) continue;
      if (info.name == robot) return std::move(map);
      names += (names.empty() ? "" : ", ") + info.name;
    }
  }
  return core::input_error(
      impl_->file.string() + ": the maps of its robots (" + names +
      ") are not merged yet; name one with --robot, or continue with plumbline map --resume");
}

/// All ids of a query's two columns.
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

/// A row's bytes; without `what` a missing row is empty.
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
  if (!bytes) return tl::unexpected(bytes.error());
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

core::Result<std::vector<std::uint8_t>> StoreReader::small_picture(KeyframeId keyframe) const {
  return impl_->blob("SELECT small FROM picture WHERE robot = ? AND number = ?", keyframe, "");
}

core::Result<std::vector<std::uint8_t>> StoreReader::whole_picture(KeyframeId keyframe) const {
  return impl_->blob("SELECT whole FROM picture WHERE robot = ? AND number = ?", keyframe, "");
}

core::Result<std::vector<KeyframeId>> StoreReader::whole_picture_ids() const {
  return impl_->ids<KeyframeId>(
      "SELECT robot, number FROM picture WHERE length(whole) > 0 ORDER BY robot, number");
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
    // All counts are of one moment
    Database& database = *impl_->database;
    const Transaction moment(database, false);
    const auto count = [&](const char* sql) { return static_cast<std::size_t>(database.number(sql)); };
    StoreContents contents;
    contents.complete = is_complete(database);

    // Totals over the robots' maps
    each_row(database, "map", [&](std::int64_t, std::int64_t, const Bytes& plain) {
      const auto row = maps::decode<MapRow>(plain);
      contents.keyframes += row.keyframes;
      contents.points += row.points;
      contents.lines += row.lines;
      contents.edges += row.edges;
      contents.loops += row.loops.size();
      contents.frames += row.frames;
    });

    // Clouds and attachments
    contents.keyframe_clouds = count("SELECT count(*) FROM cloud");
    contents.frame_clouds = count("SELECT count(*) FROM frame_cloud");
    contents.cloud_bytes = count(
        "SELECT (SELECT total(length(data)) FROM cloud) + (SELECT total(length(data)) FROM frame_cloud)");
    Statement names(database, "SELECT key FROM attachment ORDER BY key");
    while (names.step()) contents.attachments.push_back(names.text(0));
    return contents;
  });
}

/// An attachment's bytes, if it exists.
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
  if (!reader) return tl::unexpected(reader.error());
  return reader->load();
}

}  // namespace plumbline::maps
