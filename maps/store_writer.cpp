// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <system_error>
#include <utility>

#include "store_codec.hpp"
#include "store_mirror.hpp"
#include "store_schema.hpp"

namespace plumbline::maps {
namespace {

using core::ErrorKind;

/// A write-ahead log while the run goes: a commit is one append, and what was committed survives the end of
/// the process at any moment. Without a sync per commit, so that a power cut may take the last keyframes, but
/// never damages the file.
void use_log(Database& database) {
  database.run("PRAGMA journal_mode = WAL");
  database.run("PRAGMA synchronous = NORMAL");
}

/// One file again, that opens in a folder that may not be written. Where that cannot be, for somebody reads
/// the store, file and log together are whole as well.
void leave_one_file(Database& database) {
  try {
    database.run("PRAGMA journal_mode = DELETE");
  } catch (const StoreFailure&) {
    return;
  }
}

template <typename IdType>
Mirror::Key key_of(IdType id) {
  return {id.robot, id.index};
}

/// Pages of landmarks; `ids` are in order.
template <typename IdType, typename Find>
void mirror_landmarks(const std::vector<IdType>& ids, const Find& find, Mirror& mirror) {
  ByteWriter page;
  mirror.begin();
  for (std::size_t i = 0; i < ids.size();) {
    const Mirror::Key key{ids[i].robot, ids[i].index / kLandmarksPerPage};
    page.clear();
    for (; i < ids.size() && Mirror::Key{ids[i].robot, ids[i].index / kLandmarksPerPage} == key; ++i) {
      encode(find(ids[i]), page);
    }
    mirror.put(key, page.bytes());
  }
  mirror.end();
}

void put_summary(Database& database, const Totals& totals, bool complete) {
  ByteWriter bytes;
  encode(totals, bytes);
  const Bytes packed = pack(bytes.bytes());
  Statement(database, "REPLACE INTO header VALUES ('totals', ?)").bind(1, packed).run();
  Statement(database, "REPLACE INTO header VALUES ('complete', ?)").bind(1, complete ? 1 : 0).run();
}

}  // namespace

struct StoreWriter::Impl {
  Impl(std::filesystem::path path, std::unique_ptr<Database> opened)
      : file(std::move(path)),
        database(std::move(opened)),
        keyframes(*database, "keyframe"),
        states(*database, "state"),
        retired(*database, "retired"),
        points(*database, "point"),
        lines(*database, "line"),
        edges(*database, "edge"),
        frames(*database, "frame") {}

  void mirror_keyframes(const Map& map);
  void mirror_rest(const Map& map);
  void mirror_frames(const std::vector<FramePose>& poses);
  void put_cloud(KeyframeId keyframe, const Bytes& cloud);
  void write(const Map& map, const std::vector<FramePose>& poses, bool complete);
  /// `change` in a transaction; when it fails the mirrors learn what the file holds.
  template <typename Change>
  core::Result<void> transact(const Change& change);

  std::filesystem::path file;
  std::unique_ptr<Database> database;
  Mirror keyframes, states, retired, points, lines, edges, frames;
};

void StoreWriter::Impl::mirror_keyframes(const Map& map) {
  ByteWriter bytes;
  keyframes.begin();
  states.begin();
  for (const KeyframeId id : map.keyframe_ids()) {
    if (!keyframes.keep(key_of(id))) {
      bytes.clear();
      encode(map.keyframe(id), bytes);
      keyframes.put(key_of(id), bytes.bytes());
    }
    bytes.clear();
    encode(KeyframeState{map.camera_from_world(id), map.parent(id)}, bytes);
    states.put(key_of(id), bytes.bytes());
  }
  keyframes.end();
  states.end();
}

void StoreWriter::Impl::mirror_rest(const Map& map) {
  ByteWriter bytes;
  retired.begin();
  for (const KeyframeId id : map.retired_ids()) {
    bytes.clear();
    encode(map.retired(id), bytes);
    retired.put(key_of(id), bytes.bytes());
  }
  retired.end();
  mirror_landmarks(
      map.point_ids(), [&](PointId id) -> const MapPoint& { return map.point(id); }, points);
  mirror_landmarks(
      map.line_ids(), [&](LineId id) -> const MapLine& { return map.line(id); }, lines);
  edges.begin();
  for (const auto& [number, edge] : map.edges()) {
    const Mirror::Key key{edge.a.robot, static_cast<std::int64_t>(number)};
    if (edges.keep(key)) continue;
    bytes.clear();
    encode(edge, bytes);
    edges.put(key, bytes.bytes());
  }
  edges.end();
}

void StoreWriter::Impl::mirror_frames(const std::vector<FramePose>& poses) {
  ByteWriter page;
  frames.begin();
  for (std::size_t begin = 0; begin < poses.size(); begin += kFramesPerPage) {
    page.clear();
    for (std::size_t i = begin; i < std::min(poses.size(), begin + kFramesPerPage); ++i)
      encode(poses[i], page);
    frames.put({0, static_cast<std::int64_t>(begin / kFramesPerPage)}, page.bytes());
  }
  frames.end();
}

void StoreWriter::Impl::put_cloud(KeyframeId keyframe, const Bytes& cloud) {
  Statement(*database, "REPLACE INTO cloud VALUES (?, ?, ?)")
      .bind(1, keyframe.robot)
      .bind(2, keyframe.index)
      .bind(3, cloud)
      .run();
}

void StoreWriter::Impl::write(const Map& map, const std::vector<FramePose>& poses, bool complete) {
  mirror_keyframes(map);
  mirror_rest(map);
  mirror_frames(poses);
  Totals totals;
  totals.keyframes = map.keyframe_count();
  totals.retired = retired.count();
  totals.points = map.point_count();
  totals.lines = map.line_count();
  totals.edges = map.edges().size();
  totals.frames = poses.size();
  totals.next = map.next_ids();
  put_summary(*database, totals, complete);
}

template <typename Change>
core::Result<void> StoreWriter::Impl::transact(const Change& change) {
  core::Result<void> done = guarded(file, ErrorKind::kOutput, [&] {
    Transaction transaction(*database, true);
    change();
    transaction.commit();
  });
  if (done) return done;
  const core::Result<void> reread = guarded(file, ErrorKind::kOutput, [&] {
    for (Mirror* mirror : {&keyframes, &states, &retired, &points, &lines, &edges, &frames}) mirror->reread();
  });
  return reread ? done : reread;
}

StoreWriter::StoreWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StoreWriter::StoreWriter(StoreWriter&& other) noexcept = default;
StoreWriter::~StoreWriter() {
  if (impl_ != nullptr) leave_one_file(*impl_->database);
}

core::Result<StoreWriter> StoreWriter::create(const std::filesystem::path& file, const StoreHeader& header) {
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    return core::output_error(file.string() + ": is there already; remove it or write to another folder");
  }
  core::Result<StoreWriter> made = guarded(file, ErrorKind::kOutput, [&] {
    auto database = std::make_unique<Database>(file, Database::Access::kCreate);
    database->run("PRAGMA page_size = 8192");
    use_log(*database);
    {
      Transaction transaction(*database, true);
      create_tables(*database, header);
      put_summary(*database, {}, false);
      transaction.commit();
    }
    return StoreWriter(std::make_unique<Impl>(file, std::move(database)));
  });
  if (!made) std::filesystem::remove(file, ignored);
  return made;
}

core::Result<StoreWriter> StoreWriter::resume(const std::filesystem::path& file) {
  return guarded(file, ErrorKind::kInput, [&] {
    check_file(file);
    auto database = std::make_unique<Database>(file, Database::Access::kWrite);
    check_store(*database);
    use_log(*database);
    return StoreWriter(std::make_unique<Impl>(file, std::move(database)));
  });
}

core::Result<void> StoreWriter::add_keyframe(const Map& map, KeyframeId keyframe,
                                             const std::vector<std::uint8_t>& cloud,
                                             const std::vector<FramePose>& frames) {
  if (!map.has_keyframe(keyframe)) throw std::invalid_argument("add_keyframe: it is not in the map");
  return impl_->transact([&] {
    if (!cloud.empty()) impl_->put_cloud(keyframe, cloud);
    impl_->write(map, frames, false);
  });
}

core::Result<void> StoreWriter::add_cloud(KeyframeId keyframe, const std::vector<std::uint8_t>& cloud) {
  return impl_->transact([&] { impl_->put_cloud(keyframe, cloud); });
}

core::Result<void> StoreWriter::attach(const std::string& name, const std::vector<std::uint8_t>& bytes) {
  return impl_->transact([&] {
    const Bytes packed = pack(bytes);
    Statement(*impl_->database, "REPLACE INTO attachment VALUES (?, ?)").bind(1, name).bind(2, packed).run();
  });
}

core::Result<void> StoreWriter::save_final(const Map& map, const std::vector<FramePose>& frames) {
  core::Result<void> done = impl_->transact([&] { impl_->write(map, frames, true); });
  if (done) leave_one_file(*impl_->database);
  return done;
}

}  // namespace plumbline::maps
