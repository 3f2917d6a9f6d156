// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <system_error>
#include <thread>
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
  database.run(
      "PRAGMA wal_autocheckpoint = 4000");  // pages: the log is taken in every 32 MB, and synced only then
}

/// Neither a log beside the file nor a sync before the last transaction: all is written once.
void use_memory(Database& database) {
  database.run("PRAGMA journal_mode = MEMORY");
  database.run("PRAGMA synchronous = OFF");
}

/// One file again, that opens in a folder that may not be written. Where that cannot be, for somebody goes on
/// reading the store, file and log together are whole as well. SQLite itself does not wait here.
void leave_one_file(Database& database) {
  constexpr int kTries = 200;
  constexpr std::chrono::milliseconds kBetween(10);
  for (int i = 0; i < kTries; ++i) {
    try {
      database.run("PRAGMA journal_mode = DELETE");
      return;
    } catch (const StoreFailure&) {
      std::this_thread::sleep_for(kBetween);
    }
  }
}

template <typename IdType>
Mirror::Key key_of(IdType id) {
  return {id.robot, id.index};
}

/// Pages of landmarks; `whole`: there are no others.
template <typename Landmark>
void mirror_landmarks(const std::vector<LandmarkPage<Landmark>>& pages, bool whole, Mirror& mirror) {
  ByteWriter bytes;
  mirror.begin();
  for (const LandmarkPage<Landmark>& page : pages) {
    const Mirror::Key key{page.robot, page.page};
    if (page.landmarks.empty()) {
      mirror.erase(key);
      continue;
    }
    bytes.clear();
    for (const Landmark& landmark : page.landmarks) encode(landmark, bytes);
    mirror.put(key, bytes.bytes());
  }
  if (whole) mirror.end();
}

/// Rows of kFramesPerPage things each; those before `from` are in the file.
template <typename Thing, typename Encode>
void mirror_list(const std::vector<Thing>& things, std::size_t from, const Encode& encode_one,
                 Mirror& mirror) {
  ByteWriter page;
  mirror.begin();
  for (std::size_t begin = from / kFramesPerPage * kFramesPerPage; begin < things.size();
       begin += kFramesPerPage) {
    page.clear();
    for (std::size_t i = begin; i < std::min(things.size(), begin + kFramesPerPage); ++i) {
      encode_one(things[i], page);
    }
    mirror.put({0, static_cast<std::int64_t>(begin / kFramesPerPage)}, page.bytes());
  }
  if (from == 0) mirror.end();
}

void encode_frame(const FramePose& frame, ByteWriter& to) { encode(frame, to); }
void encode_line(const std::string& line, ByteWriter& to) { to.put(std::string_view(line)); }

std::vector<FramePose> read_frames(Database& database) {
  std::vector<FramePose> frames;
  Statement rows(database, "SELECT data FROM frame ORDER BY robot, number");
  while (rows.step()) decode_page(rows.unpacked(0), frames);
  return frames;
}

}  // namespace

struct StoreWriter::Impl {
  Impl(std::filesystem::path path, std::unique_ptr<Database> opened)
      : file(std::move(path)),
        database(std::move(opened)),
        transaction(read_heads(*database).last()),
        keyframes(*database, "keyframe", transaction),
        states(*database, "state", transaction),
        points(*database, "point", transaction),
        lines(*database, "line", transaction),
        edges(*database, "edge", transaction),
        frames(*database, "frame", transaction),
        log(*database, "log", transaction),
        loops(read_loops(*database)),
        frame_list(read_frames(*database)),
        log_lines(read_log(*database)) {}

  void mirror_keyframes(const MapChanges& map);
  void mirror_rest(const MapChanges& map);
  void put_cloud(const StoreCloud& cloud);
  void put_log_and_clouds(const StoreStep& step);
  void put_totals(const MapChanges& map, bool complete);
  /// All there is of the map and its frames.
  void write(const Map& map, const std::vector<FramePose>& poses, bool complete);
  /// `change` in a transaction; when it fails the mirrors learn what the file holds.
  template <typename Change>
  core::Result<void> transact(const Change& change);

  std::filesystem::path file;
  std::unique_ptr<Database> database;
  std::int64_t transaction;  ///< the number of the last one, or of the one that is going on
  Mirror keyframes, states, points, lines, edges, frames, log;
  Bytes loops;                         ///< as in the file
  std::vector<FramePose> frame_list;   ///< as in the file
  std::vector<std::string> log_lines;  ///< as in the file
};

void StoreWriter::Impl::mirror_keyframes(const MapChanges& map) {
  ByteWriter bytes;
  keyframes.begin();
  states.begin();
  for (const MapParts::KeyframePart& part : map.keyframes) {
    const Mirror::Key key = key_of(part.data->id);
    if (!keyframes.keep(key)) {
      bytes.clear();
      encode(*part.data, bytes);
      keyframes.put(key, bytes.bytes());
    }
    bytes.clear();
    encode(KeyframeState{part.camera_from_world, part.parent}, bytes);
    states.put(key, bytes.bytes());
  }
  keyframes.end();
  states.end();
}

void StoreWriter::Impl::mirror_rest(const MapChanges& map) {
  ByteWriter bytes;
  mirror_landmarks(map.points, map.whole, points);
  mirror_landmarks(map.lines, map.whole, lines);
  edges.begin();
  for (const auto& [number, edge] : map.edges) {
    const Mirror::Key key{edge.a.robot, static_cast<std::int64_t>(number)};
    if (edges.keep(key)) continue;
    bytes.clear();
    encode(edge, number, bytes);
    edges.put(key, bytes.bytes());
  }
  for (const auto& [number, robot] : map.edge_names) edges.stay({robot, static_cast<std::int64_t>(number)});
  edges.end();
  bytes.clear();
  encode(map.loops, bytes);
  if (bytes.bytes() == loops) return;
  put_loops(*database, transaction, bytes.bytes());
  loops = bytes.bytes();
}

void StoreWriter::Impl::put_cloud(const StoreCloud& cloud) {
  const bool of_keyframe = cloud.keyframe.valid();
  const auto put = [&](const char* of_keyframes, const char* of_frames, const Bytes& bytes) {
    Statement(*database, of_keyframe ? of_keyframes : of_frames)
        .bind(1, of_keyframe ? cloud.keyframe.robot : 0)
        .bind(2, of_keyframe ? cloud.keyframe.index : static_cast<std::int64_t>(cloud.frame))
        .bind(3, transaction)
        .bind(4, bytes)
        .run();
  };
  put("REPLACE INTO cloud VALUES (?, ?, ?, ?)", "REPLACE INTO frame_cloud VALUES (?, ?, ?, ?)", *cloud.bytes);
  if (!of_keyframe || cloud.surface == nullptr) return;
  ByteWriter bytes;
  encode(*cloud.surface, bytes);
  const Bytes packed = pack(bytes.bytes());
  put("REPLACE INTO surface VALUES (?, ?, ?, ?)", nullptr, packed);
}

void StoreWriter::Impl::put_log_and_clouds(const StoreStep& step) {
  for (const StoreCloud& cloud : step.clouds) put_cloud(cloud);
  const std::size_t before = log_lines.size();
  log_lines.insert(log_lines.end(), step.log.begin(), step.log.end());
  if (!step.log.empty()) mirror_list(log_lines, before, encode_line, log);
}

void StoreWriter::Impl::put_totals(const MapChanges& map, bool complete) {
  Totals totals;
  totals.keyframes = map.keyframes.size();
  totals.points = map.point_count;
  totals.lines = map.line_count;
  totals.edges = map.edge_names.size();
  totals.frames = frame_list.size();
  totals.log = log_lines.size();
  totals.next = map.next;
  maps::put_totals(*database, transaction, totals, complete);
}

void StoreWriter::Impl::write(const Map& map, const std::vector<FramePose>& poses, bool complete) {
  const MapChanges all = map.changes_since({});
  mirror_keyframes(all);
  mirror_rest(all);
  frame_list = poses;
  mirror_list(frame_list, 0, encode_frame, frames);
  put_totals(all, complete);
}

template <typename Change>
core::Result<void> StoreWriter::Impl::transact(const Change& change) {
  core::Result<void> done = guarded(file, ErrorKind::kOutput, [&] {
    ++transaction;
    Transaction whole(*database, true);
    change();
    whole.commit();
  });
  if (done) return done;
  const core::Result<void> reread = guarded(file, ErrorKind::kOutput, [&] {
    for (Mirror* mirror : {&keyframes, &states, &points, &lines, &edges, &frames, &log}) mirror->reread();
    transaction = read_heads(*database).last();
    loops = read_loops(*database);
    frame_list = read_frames(*database);
    log_lines = read_log(*database);
  });
  return reread ? done : reread;
}

StoreWriter::StoreWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StoreWriter::StoreWriter(StoreWriter&& other) noexcept = default;
StoreWriter::~StoreWriter() {
  if (impl_ != nullptr) leave_one_file(*impl_->database);
}

core::Result<StoreWriter> StoreWriter::create(const std::filesystem::path& file, const StoreHeader& header,
                                              StoreUse use) {
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    return core::output_error(file.string() + ": is there already; remove it or write to another folder");
  }
  core::Result<StoreWriter> made = guarded(file, ErrorKind::kOutput, [&] {
    auto database = std::make_unique<Database>(file, Database::Access::kCreate);
    database->run("PRAGMA page_size = 8192");
    use == StoreUse::kGrowing ? use_log(*database) : use_memory(*database);
    {
      Transaction transaction(*database, true);
      create_tables(*database);
      put_header(*database, header);
      put_totals(*database, 1, {}, false);
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
    if (!cloud.empty()) impl_->put_cloud({keyframe, 0, std::make_shared<Bytes>(cloud)});
    impl_->write(map, frames, false);
  });
}

core::Result<void> StoreWriter::add(const StoreStep& step) {
  return impl_->transact([&] {
    impl_->mirror_keyframes(*step.map);
    impl_->mirror_rest(*step.map);
    const std::size_t frames = impl_->frame_list.size();
    impl_->frame_list.insert(impl_->frame_list.end(), step.frames.begin(), step.frames.end());
    mirror_list(impl_->frame_list, frames, encode_frame, impl_->frames);
    impl_->put_log_and_clouds(step);
    impl_->put_totals(*step.map, false);
  });
}

core::Result<void> StoreWriter::add_cloud(KeyframeId keyframe, const std::vector<std::uint8_t>& cloud) {
  return impl_->transact([&] { impl_->put_cloud({keyframe, 0, std::make_shared<Bytes>(cloud)}); });
}

core::Result<void> StoreWriter::attach(const std::string& name, const std::vector<std::uint8_t>& bytes) {
  return impl_->transact([&] {
    const Bytes packed = pack(bytes);
    Statement(*impl_->database, "REPLACE INTO attachment VALUES (?, ?, ?)")
        .bind(1, name)
        .bind(2, impl_->transaction)
        .bind(3, packed)
        .run();
  });
}

core::Result<void> StoreWriter::save_final(const Map& map, const std::vector<FramePose>& frames,
                                           const ResultFrame& result, const StoreStep& rest) {
  // Of a store that is written in one go, this is the first moment that it is whole.
  auto synced =
      guarded(impl_->file, ErrorKind::kOutput, [&] { impl_->database->run("PRAGMA synchronous = NORMAL"); });
  if (!synced) return synced;
  core::Result<void> done = impl_->transact([&] {
    impl_->put_log_and_clouds(rest);
    impl_->write(map, frames, true);
    put_result_frame(*impl_->database, impl_->transaction, result);
  });
  if (done) leave_one_file(*impl_->database);
  return done;
}

}  // namespace plumbline::maps
