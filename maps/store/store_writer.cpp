// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <map>
#include <system_error>
#include <thread>
#include <utility>

#include "store/store_codec.hpp"
#include "store/store_mirror.hpp"
#include "store/store_schema.hpp"

namespace plumbline::maps {
namespace {

using core::ErrorKind;

/// A write-ahead log during the run: a commit is one append, and committed data survive the end of the
/// process at any moment. Without a sync per commit, so that a power cut may take the last keyframes, but
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

/// Makes it one file again, which can be opened in a read-only folder. If that is impossible because another
/// program is reading the store, file and log together are complete as well. SQLite itself does not wait
/// here.
void leave_one_file(Database& database) {
  constexpr int kTries = 200;
  constexpr std::chrono::milliseconds kBetween(10);
  for (int i = 0; i < kTries; ++i) {
    try {
      database.run("PRAGMA journal_mode = DELETE");
      return;
    } catch (const SQLite::Exception&) {
      std::this_thread::sleep_for(kBetween);
    }
  }
}

template <typename IdType>
Mirror::Key key_of(IdType id) {
  return {id.robot, id.index};
}

/// Pages of landmarks of a map of `robot` (-1: of all); `whole`: there are no others.
template <typename Landmark>
void mirror_landmarks(const std::vector<LandmarkPage<Landmark>>& pages, bool whole, std::int32_t robot,
                      Mirror& mirror) {
  ByteWriter bytes;
  mirror.begin_round();
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
  if (whole) mirror.delete_unmarked(robot);
}

/// Things of a robot in rows of kFramesPerPage each; those before `from` are in the file.
template <typename Thing>
void mirror_list(std::int32_t robot, const std::vector<Thing>& things, std::size_t from, Mirror& mirror) {
  ByteWriter page;
  for (std::size_t begin = from / kFramesPerPage * kFramesPerPage; begin < things.size();
       begin += kFramesPerPage) {
    page.clear();
    for (std::size_t i = begin; i < std::min(things.size(), begin + kFramesPerPage); ++i) {
      encode(things[i], page);
    }
    mirror.put({robot, static_cast<std::int64_t>(begin / kFramesPerPage)}, page.bytes());
  }
}

template <typename Thing>
using ByRobot = std::map<std::int32_t, std::vector<Thing>>;

/// The pages of a table, joined by robot.
template <typename Thing>
ByRobot<Thing> read_lists(Database& database, const std::string& table) {
  ByRobot<Thing> lists;
  Statement rows(database, ("SELECT robot, data FROM " + table + " ORDER BY robot, number").c_str());
  while (rows.step()) {
    const std::vector<Thing> page = decode_page<Thing>(rows.unpacked(1));
    std::vector<Thing>& list = lists[static_cast<std::int32_t>(rows.integer(0))];
    list.insert(list.end(), page.begin(), page.end());
  }
  return lists;
}

/// Number of things of one robot, or (-1) of all.
template <typename Thing>
std::size_t count(const ByRobot<Thing>& lists, std::int32_t robot) {
  std::size_t sum = 0;
  for (const auto& [owner, list] : lists) sum += robot < 0 || owner == robot ? list.size() : 0;
  return sum;
}

}  // namespace

struct StoreWriter::Impl {
  /// The mirrors know the rows of the store as it is.
  Impl(std::filesystem::path path, std::unique_ptr<Database> opened)
      : file(std::move(path)),
        database(std::move(opened)),
        transaction(read_heads(*database).last()),
        maps(*database, "map", transaction),
        keyframes(*database, "keyframe", transaction),
        states(*database, "state", transaction),
        points(*database, "point", transaction),
        lines(*database, "line", transaction),
        edges(*database, "edge", transaction),
        frames(*database, "frame", transaction),
        log(*database, "log", transaction),
        robots(read_header(*database).robots),
        frame_lists(read_lists<FramePose>(*database, "frame")),
        log_lines(read_lists<std::string>(*database, "log")) {}

  /// Writes the map of a robot besides those of others, or (-1) the only one.
  void put_map(const MapChanges& map, std::int32_t robot);
  void mirror_keyframes(const MapChanges& map, std::int32_t robot);
  void mirror_edges(const MapChanges& map, std::int32_t robot);
  /// Makes later rounds write keyframes and edges again if a camera has changed.
  void put_robots_of_map(const std::vector<RobotInfo>& all);
  void put_seen(FrameId frame, const SeenPoints& seen);
  /// Before all frames of a robot are written again: what they saw are landmarks of its earlier map.
  void erase_frames(std::int32_t robot);
  void put_map_row(const MapChanges& map, std::int32_t robot);
  void put_cloud(const StoreCloud& cloud);
  void put_picture(const StorePicture& picture);
  void put_extras(const StoreStep& step);
  /// Writes everything of the only map and its frames.
  void write(const Map& map, const std::vector<FramePose>& poses);
  /// Runs `change` in a transaction; if it fails, the mirrors are reloaded from the file.
  template <typename Change>
  core::Result<void> transact(const Change& change);

  std::filesystem::path file;
  std::unique_ptr<Database> database;
  std::int64_t transaction;  ///< number of the last one, or of the one in progress
  Mirror maps, keyframes, states, points, lines, edges, frames, log;
  std::vector<RobotInfo> robots;  ///< as in the file
  /// Keyframes and edges were recomputed for another camera: those in the file are not kept.
  bool recomputed = false;
  ByRobot<FramePose> frame_lists;  ///< as in the file
  ByRobot<std::string> log_lines;  ///< as in the file
};

/// Writes what changed of the map since the last call.
void StoreWriter::Impl::put_map(const MapChanges& map, std::int32_t robot) {
  mirror_keyframes(map, robot);
  mirror_landmarks(map.points, map.whole, robot, points);
  mirror_landmarks(map.lines, map.whole, robot, lines);
  mirror_edges(map, robot);
  put_map_row(map, robot);
  recomputed = false;
}

/// Camera versions and estimates are written only if they changed.
void StoreWriter::Impl::put_robots_of_map(const std::vector<RobotInfo>& all) {
  const auto versions = [](const std::vector<RobotInfo>& of) {
    std::size_t count = 0;
    for (const RobotInfo& robot : of) count += robot.versions.size();
    return count;
  };

  // A new version changes keyframes that are stored
  recomputed = versions(all) != versions(robots);
  if (recomputed) put_camera_versions(*database, transaction, all);
  if (encoded(all) != encoded(robots)) put_robots(*database, transaction, all);
  if (encoded(estimates_of(all)) != encoded(estimates_of(robots)))
    put_camera_estimates(*database, transaction, all);
  robots = all;
}

void StoreWriter::Impl::put_seen(FrameId frame, const SeenPoints& seen) {
  Statement(*database, "REPLACE INTO seen VALUES (?, ?, ?)")
      .bind(1, frame.robot)
      .bind(2, frame.index)
      .bind(3, pack(encoded(seen)))
      .run();
}

/// Poses change often, keyframes almost never.
void StoreWriter::Impl::mirror_keyframes(const MapChanges& map, std::int32_t robot) {
  keyframes.begin_round();
  states.begin_round();
  for (const MapParts::KeyframePart& part : map.keyframes) {
    const Mirror::Key key = key_of(part.data->id);
    if (recomputed || !keyframes.mark_unchanged(key)) keyframes.put(key, encoded(*part.data));
    states.put(key, encoded(KeyframeState{part.camera_from_world, part.parent}));
  }
  keyframes.delete_unmarked(robot);
  states.delete_unmarked(robot);
}

/// New edges are written, missing ones deleted.
void StoreWriter::Impl::mirror_edges(const MapChanges& map, std::int32_t robot) {
  edges.begin_round();
  for (const auto& [number, edge] : map.edges) {
    const Mirror::Key key{edge.a.robot, static_cast<std::int64_t>(number)};
    if (recomputed || !edges.mark_unchanged(key)) edges.put(key, encoded(EdgeRow{number, edge}));
  }
  for (const auto& [number, owner] : map.edge_names)
    edges.mark_present({owner, static_cast<std::int64_t>(number)});
  edges.delete_unmarked(robot);
}

/// Totals, next ids and loops of the map.
void StoreWriter::Impl::put_map_row(const MapChanges& map, std::int32_t robot) {
  MapRow row;
  row.keyframes = map.keyframes.size();
  row.points = map.point_count;
  row.lines = map.line_count;
  row.edges = map.edge_names.size();
  row.frames = count(frame_lists, robot);
  row.log = count(log_lines, robot);
  row.next = map.next;
  row.loops = map.loops;
  maps.begin_round();
  maps.put({std::max(robot, 0), 0}, encoded(row));
  if (robot < 0) maps.delete_unmarked();
}

void StoreWriter::Impl::erase_frames(std::int32_t robot) {
  frame_lists[robot].clear();
  Statement(*database, "DELETE FROM seen WHERE robot = ?").bind(1, robot).run();
}

/// A cloud, and the surface samples of a keyframe.
void StoreWriter::Impl::put_cloud(const StoreCloud& cloud) {
  const bool of_keyframe = cloud.keyframe.valid();
  const auto put = [&](const char* sql, const Bytes& bytes) {
    Statement(*database, sql)
        .bind(1, of_keyframe ? cloud.keyframe.robot : cloud.frame.robot)
        .bind(2, of_keyframe ? cloud.keyframe.index : cloud.frame.index)
        .bind(3, transaction)
        .bind(4, bytes)
        .run();
  };
  put(of_keyframe ? "REPLACE INTO cloud VALUES (?, ?, ?, ?)" : "REPLACE INTO frame_cloud VALUES (?, ?, ?, ?)",
      *cloud.bytes);
  if (!of_keyframe || cloud.surface == nullptr) return;
  put("REPLACE INTO surface VALUES (?, ?, ?, ?)", pack(encoded(*cloud.surface)));
}

/// A keyframe's image, small and whole.
void StoreWriter::Impl::put_picture(const StorePicture& picture) {
  Statement(*database, "REPLACE INTO picture VALUES (?, ?, ?, ?)")
      .bind(1, picture.keyframe.robot)
      .bind(2, picture.keyframe.index)
      .bind(3, picture.small)
      .bind(4, picture.whole)
      .run();
}

/// Clouds, pictures and log, which are beside the map.
void StoreWriter::Impl::put_extras(const StoreStep& step) {
  for (const StoreCloud& cloud : step.clouds) put_cloud(cloud);
  for (const StorePicture& picture : step.pictures) put_picture(picture);
  if (step.log.empty()) return;
  const std::int32_t robot = std::max(step.robot, 0);
  std::vector<std::string>& list = log_lines[robot];
  const std::size_t before = list.size();
  list.insert(list.end(), step.log.begin(), step.log.end());
  mirror_list(robot, list, before, log);
}

/// Writes a whole map with all frames of its robots.
void StoreWriter::Impl::write(const Map& map, const std::vector<FramePose>& poses) {
  frame_lists.clear();
  for (const FramePose& pose : poses) frame_lists[pose.reference.robot].push_back(pose);
  frames.begin_round();
  for (const auto& [robot, list] : frame_lists) mirror_list(robot, list, 0, frames);
  frames.delete_unmarked();
  put_map(map.changes_since({}), -1);
}

template <typename Change>
core::Result<void> StoreWriter::Impl::transact(const Change& change) {
  // All or nothing, as one transaction
  core::Result<void> done = guarded(file, ErrorKind::kOutput, [&] {
    ++transaction;
    Transaction whole(*database, true);
    change();
    whole.commit();
  });
  if (done) return done;

  // After a failure the mirrors must match the store
  const core::Result<void> reloaded = guarded(file, ErrorKind::kOutput, [&] {
    for (Mirror* mirror : {&maps, &keyframes, &states, &points, &lines, &edges, &frames, &log}) {
      mirror->reload();
    }
    transaction = read_heads(*database).last();
    robots = read_header(*database).robots;
    frame_lists = read_lists<FramePose>(*database, "frame");
    log_lines = read_lists<std::string>(*database, "log");
  });

  return reloaded ? done : reloaded;
}

StoreWriter::StoreWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StoreWriter::StoreWriter(StoreWriter&& other) noexcept = default;
StoreWriter::~StoreWriter() {
  if (impl_ != nullptr) leave_one_file(*impl_->database);
}

core::Result<StoreWriter> StoreWriter::create(const std::filesystem::path& file, const StoreHeader& header,
                                              StoreUse use) {
  // An existing store is never overwritten
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored)) {
    return core::output_error(file.string() + ": exists already; remove it or write to another folder");
  }

  // Header and tables in one transaction
  core::Result<StoreWriter> made = guarded(file, ErrorKind::kOutput, [&] {
    auto database = std::make_unique<Database>(file, Database::Access::kCreate);
    database->run("PRAGMA page_size = 8192");

    // A growing store needs a log for its readers
    use == StoreUse::kGrowing ? use_log(*database) : use_memory(*database);
    {
      Transaction transaction(*database, true);
      create_tables(*database);
      put_header(*database, header);
      transaction.commit();
    }
    return StoreWriter(std::make_unique<Impl>(file, std::move(database)));
  });

  // A failed start leaves no file
  if (!made) std::filesystem::remove(file, ignored);
  return made;
}

/// Opens the store of an interrupted run.
core::Result<StoreWriter> StoreWriter::resume(const std::filesystem::path& file) {
  return guarded(file, ErrorKind::kOutput, [&] {
    check_file(file);
    auto database = std::make_unique<Database>(file, Database::Access::kWrite);
    check_store(*database);
    use_log(*database);
    return StoreWriter(std::make_unique<Impl>(file, std::move(database)));
  });
}

/// A keyframe with its cloud, and the whole map.
core::Result<void> StoreWriter::add_keyframe(const Map& map, KeyframeId keyframe,
                                             const std::vector<std::uint8_t>& cloud,
                                             const std::vector<FramePose>& frames) {
  if (!map.has_keyframe(keyframe)) throw std::invalid_argument("add_keyframe: it is not in the map");
  return impl_->transact([&] {
    if (!cloud.empty()) impl_->put_cloud({keyframe, {}, std::make_shared<Bytes>(cloud)});
    impl_->write(map, frames);
    put_complete(*impl_->database, impl_->transaction, false);
  });
}

core::Result<void> StoreWriter::add(const StoreStep& step) {
  return impl_->transact([&] {
    // A map made anew has new frames
    if (step.frames_anew) impl_->erase_frames(step.robot);

    // New frames extend the lists of their robots
    std::map<std::int32_t, std::size_t> before;
    for (const FramePose& pose : step.frames) {
      std::vector<FramePose>& list = impl_->frame_lists[pose.reference.robot];
      before.try_emplace(pose.reference.robot, list.size());
      if (pose.seen != nullptr)
        impl_->put_seen({pose.reference.robot, static_cast<std::int32_t>(list.size())}, *pose.seen);
      list.push_back(pose);
    }

    // Only the pages from the old end on
    for (const auto& [robot, size] : before) {
      mirror_list(robot, impl_->frame_lists[robot], size, impl_->frames);
    }

    // Clouds and images with the map that names them
    impl_->put_extras(step);
    if (step.robots != nullptr) impl_->put_robots_of_map(*step.robots);
    impl_->put_map(*step.map, step.robot);
    put_complete(*impl_->database, impl_->transaction, false);
  });
}

core::Result<void> StoreWriter::add_cloud(const StoreCloud& cloud) {
  return impl_->transact([&] { impl_->put_cloud(cloud); });
}

/// Stores named bytes, replacing those of that name.
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
                                           const ResultFrame& result, const std::vector<StoreStep>& rest,
                                           const std::vector<RobotInfo>& robots) {
  // A store written in one go is first complete here.
  auto synced =
      guarded(impl_->file, ErrorKind::kOutput, [&] { impl_->database->run("PRAGMA synchronous = NORMAL"); });
  if (!synced) return synced;
  core::Result<void> done = impl_->transact([&] {
    for (const StoreStep& step : rest) impl_->put_extras(step);
    if (!robots.empty()) impl_->put_robots_of_map(robots);
    impl_->write(map, frames);
    put_complete(*impl_->database, impl_->transaction, true);
    put_result_frame(*impl_->database, impl_->transaction, result);
  });
  if (done) leave_one_file(*impl_->database);
  return done;
}

}  // namespace plumbline::maps
