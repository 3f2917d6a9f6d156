// SPDX-License-Identifier: BSD-3-Clause
// The map store when things go wrong: killed writers, full disks, files that are damaged, foreign or newer.
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>

#include "plumbline/maps/store.hpp"
#include "store_folder.hpp"
#include "store_world.hpp"

namespace plumbline::maps {
namespace {

using tests::equal;
using tests::header_of;
using tests::same_all;
using tests::StoreFolder;
using tests::StoreWorld;

std::vector<std::uint8_t> cloud_of(int seed) {
  return std::vector<std::uint8_t>(3000, static_cast<std::uint8_t>(seed));
}

/// The world after `steps` keyframes.
StoreWorld world_after(int steps) {
  StoreWorld world(11);
  for (int i = 0; i < steps; ++i) world.step();
  return world;
}

void write_store(const std::filesystem::path& file, int steps) {
  const StoreWorld world = world_after(steps);
  auto writer = StoreWriter::create(file, header_of(world.camera));
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(writer->add_keyframe(world.map, world.map.keyframe_ids().back(), cloud_of(1)));
  ASSERT_TRUE(writer->save_final(world.map, world.frames));
}

std::string read_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

void run_sql(const std::filesystem::path& file, const char* sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
  sqlite3_close(database);
}

/// The message of an input error that names the file.
std::string refusal(const std::filesystem::path& file) {
  const auto stored = load_map(file);
  if (stored) return "it was read";
  EXPECT_EQ(stored.error().kind, core::ErrorKind::kInput);
  EXPECT_EQ(stored.error().message.rfind(file.string() + ": ", 0), 0U) << stored.error().message;
  EXPECT_EQ(stored.error().message.find('\n'), std::string::npos);
  return stored.error().message;
}
void expect_refused(const std::filesystem::path& file, const char* pattern) {
  const std::string message = refusal(file);
  EXPECT_TRUE(std::regex_search(message, std::regex(pattern))) << message;
}

/// Neither read nor written.
void expect_no_store(const std::filesystem::path& file, const char* pattern) {
  expect_refused(file, pattern);
  const auto writer = StoreWriter::resume(file);
  ASSERT_FALSE(writer);
  EXPECT_TRUE(std::regex_search(writer.error().message, std::regex(pattern))) << writer.error().message;
}

/// A child that adds keyframe after keyframe, tells each commit, and never stops by itself.
[[noreturn]] void write_until_killed(const std::filesystem::path& file, int tell) {
  StoreWorld world(11);
  auto writer = StoreWriter::create(file, header_of(world.camera));
  if (!writer) _exit(1);
  for (int i = 0;; ++i) {
    const KeyframeId id = world.step();
    if (!writer->add_keyframe(world.map, id, cloud_of(i), world.frames)) _exit(1);
    if (write(tell, "c", 1) != 1) _exit(1);
  }
}

TEST(MapStoreDamage, KilledWriterLeavesEveryCommittedKeyframe) {
  tests::Random random(5);
  for (int round = 0; round < 8; ++round) {
    const StoreFolder folder;
    int pipe_ends[2];
    ASSERT_EQ(pipe(pipe_ends), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) write_until_killed(folder.file(), pipe_ends[1]);
    close(pipe_ends[1]);
    char byte = 0;
    int committed = 0;
    while (committed <= 2 * round && read(pipe_ends[0], &byte, 1) == 1) ++committed;
    usleep(static_cast<useconds_t>(random.integer(0, 6000)));  // somewhere in the next transactions
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it ended by itself";
    while (read(pipe_ends[0], &byte, 1) == 1) ++committed;
    close(pipe_ends[0]);

    const auto stored = load_map(folder.file());
    ASSERT_TRUE(stored) << stored.error().message;
    EXPECT_FALSE(stored->complete);
    int steps = committed;  // or one more: committed, but not told any more
    StoreWorld world = world_after(steps);
    if (stored->frames.size() != world.frames.size()) {
      world.step();
      ++steps;
    }
    ASSERT_TRUE(equal(stored->map, world.map)) << "round " << round << ", " << committed << " told";
    ASSERT_TRUE(same_all(stored->frames, world.frames_by_robot()));
    const auto reader = StoreReader::open(folder.file());
    ASSERT_TRUE(reader);
    EXPECT_EQ(reader->cloud_ids().value().size(), static_cast<std::size_t>(steps));

    auto writer = StoreWriter::resume(folder.file());
    ASSERT_TRUE(writer) << writer.error().message;
    const KeyframeId next = world.step();
    ASSERT_TRUE(writer->add_keyframe(world.map, next, cloud_of(0), world.frames));
    EXPECT_TRUE(equal(load_map(folder.file())->map, world.map));
  }
}

TEST(MapStoreDamage, TruncatedFilesAreRefused) {
  const StoreFolder folder;
  write_store(folder.file(), 4);
  const std::string whole = read_file(folder.file());
  for (int i = 0; i < 40; ++i) {
    write_file(folder.file(), whole.substr(0, whole.size() * static_cast<std::size_t>(i) / 40));
    ASSERT_NE(refusal(folder.file()), "it was read") << i << "/40 of the file";
  }
  write_file(folder.file(), whole.substr(0, whole.size() - 1));
  EXPECT_NE(refusal(folder.file()), "it was read");
  write_file(folder.file(), whole);
  EXPECT_TRUE(load_map(folder.file()));
}

TEST(MapStoreDamage, WrongBytesAreRefusedOrHarmless) {
  const StoreFolder folder;
  write_store(folder.file(), 14);
  const StoreWorld world = world_after(14);
  const std::string whole = read_file(folder.file());
  tests::Random random(6);
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::string damaged = whole;
    for (int k = 0; k <= i % 3; ++k) {
      const auto at = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(whole.size())));
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << random.integer(0, 7)));
    }
    write_file(folder.file(), damaged);
    const auto stored = load_map(folder.file());
    if (!stored) {
      ++refused;
      ASSERT_EQ(stored.error().kind, core::ErrorKind::kInput) << stored.error().message;
      continue;
    }
    ASSERT_TRUE(equal(stored->map, world.map)) << "another map without a word, round " << i;
    ASSERT_TRUE(same_all(stored->frames, world.frames_by_robot()));
  }
  EXPECT_GT(refused, 100);
}

TEST(MapStoreDamage, LostRowsAreTold) {
  const StoreFolder folder;
  for (const char* table : {"keyframe", "state", "point", "line", "edge", "frame"}) {
    write_store(folder.file(), 6);
    run_sql(folder.file(),
            (std::string("DELETE FROM ") + table + " WHERE rowid = (SELECT max(rowid) FROM " + table + ")")
                .c_str());
    expect_refused(folder.file(), "damaged");
    std::filesystem::remove(folder.file());
  }
  write_store(folder.file(), 6);
  run_sql(folder.file(), "UPDATE point SET data = (SELECT data FROM line LIMIT 1)");
  expect_refused(folder.file(), "point 0/0: .*map the recording again");
  run_sql(folder.file(), "DROP TABLE point");
  expect_refused(folder.file(), "damaged");
}

TEST(MapStoreDamage, ForeignAndNewerFilesAreRefused) {
  const StoreFolder folder;
  const std::filesystem::path file = folder.file();
  expect_no_store(file, "no such file; give the map.db");
  expect_no_store(folder.path, "is not a file");
  write_file(file, "ply\nformat ascii 1.0\n" + std::string(20000, 'x'));
  expect_no_store(file, "is not a map store; give the map.db");
  write_file(file, "");
  expect_no_store(file, "holds nothing");
  write_file(file, "S");
  expect_no_store(file, "damaged: it ends before its header does; .* map the recording again");
  write_file(file, "");
  run_sql(file, "CREATE TABLE songs (name TEXT)");
  expect_no_store(file, "SQLite file, but not a map store");
  std::filesystem::remove(file);
  write_store(file, 1);
  run_sql(file, "PRAGMA user_version = 99");
  expect_no_store(file, "format 99, this program reads up to [0-9]+; use a newer Plumbline");
}

TEST(MapStoreDamage, WritersRefuseWhatTheyMayNotWrite) {
  const StoreFolder folder;
  write_file(folder.file(), "precious");
  const auto there = StoreWriter::create(folder.file(), {});
  ASSERT_FALSE(there);
  EXPECT_EQ(there.error().kind, core::ErrorKind::kOutput);
  EXPECT_EQ(read_file(folder.file()), "precious");
  const auto nowhere = StoreWriter::create(folder.path / "no" / "map.db", {});
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, core::ErrorKind::kOutput);
  EXPECT_NE(nowhere.error().message.find("check folder and permissions"), std::string::npos);
}

/// Adds keyframes until that fails; 0 when the failure is as it should be and loses nothing.
int fill(const std::filesystem::path& file, const char* expected) {
  StoreWorld world(12);
  auto writer = StoreWriter::create(file, header_of(world.camera));
  if (!writer) return 1;
  for (int i = 0; i < 400; ++i) {
    const KeyframeId id = world.step();
    std::vector<std::uint8_t> cloud(40000);
    for (auto& byte : cloud) byte = static_cast<std::uint8_t>(i);
    const auto added = writer->add_keyframe(world.map, id, cloud, world.frames);
    if (added) continue;
    if (i < 3 || added.error().kind != core::ErrorKind::kOutput) return 2;
    if (added.error().message.find(expected) == std::string::npos) return 3;
    StoreWorld before(12);
    for (int k = 0; k < i; ++k) before.step();
    const auto stored = load_map(file);
    if (!stored) return 4;
    return equal(stored->map, before.map) && same_all(stored->frames, before.frames) ? 0 : 5;
  }
  return 6;
}

int exit_code_of(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(MapStoreDamage, FullDiskKeepsWhatWasCommitted) {
  const StoreFolder folder;
  constexpr int kNotAllowed = 77;
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {  // a small file system that only this process sees
    if (unshare(geteuid() == 0 ? CLONE_NEWNS : CLONE_NEWUSER | CLONE_NEWNS) != 0) _exit(kNotAllowed);
    mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    if (mount("tmpfs", folder.path.c_str(), "tmpfs", 0, "size=1m") != 0) _exit(kNotAllowed);
    _exit(fill(folder.file(), "the disk is full; what was stored before is safe"));
  }
  const int code = exit_code_of(child);
  if (code == kNotAllowed) GTEST_SKIP() << "no right to make a small file system";
  EXPECT_EQ(code, 0);
}

TEST(MapStoreDamage, FailedWriteKeepsWhatWasCommitted) {
  const StoreFolder folder;
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1 << 20, 1 << 20};
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) _exit(10);
    _exit(fill(folder.file(), "what was stored before is safe"));
  }
  EXPECT_EQ(exit_code_of(child), 0);
}

TEST(MapStoreDamage, GoesOnAfterAFailedCall) {
  const StoreFolder folder;
  StoreWorld world(13);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), {}));
  run_sql(folder.file(),
          "CREATE TRIGGER refuse BEFORE INSERT ON frame BEGIN SELECT raise(ABORT, 'not now'); END");
  const KeyframeId second = world.step();
  EXPECT_FALSE(writer->add_keyframe(world.map, second, {}, world.frames));
  const auto before = load_map(folder.file());
  ASSERT_TRUE(before) << before.error().message;
  EXPECT_EQ(before->map.keyframe_count(), 1U);
  run_sql(folder.file(), "DROP TRIGGER refuse");
  ASSERT_TRUE(writer->add_keyframe(world.map, second, {}, world.frames));
  EXPECT_TRUE(equal(load_map(folder.file())->map, world.map));
}

}  // namespace
}  // namespace plumbline::maps
