// SPDX-License-Identifier: BSD-3-Clause
// The map store as it is meant to be used: what goes in comes out, call after call.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "plumbline/cloud/compact/compact_cloud.hpp"
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

std::vector<std::uint8_t> cloud_bytes(int points) {
  cloud::Cloud cloud;
  for (int i = 0; i < points; ++i) {
    cloud::Point p;
    p.x = 0.01F * static_cast<float>(i);
    p.y = 0.5F;
    p.z = 2.0F;
    p.r = p.g = p.b = static_cast<std::uint8_t>(i % 200);
    cloud.push_back(p);
  }
  return cloud::encode_cloud(cloud);
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(MapStore, EveryCommitIsTheMapInEveryBit) {
  const StoreFolder folder;
  StoreWorld world(1);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer) << writer.error().message;
  for (int i = 0; i < 12; ++i) {
    const KeyframeId id = world.step();
    const auto added = writer->add_keyframe(world.map, id, cloud_bytes(10 + i), world.frames);
    ASSERT_TRUE(added) << added.error().message;
    const auto stored = load_map(folder.file());  // while it is being written
    ASSERT_TRUE(stored) << stored.error().message;
    ASSERT_TRUE(equal(stored->map, world.map)) << "after " << i;
    ASSERT_TRUE(same_all(stored->frames, world.frames_by_robot()));
    EXPECT_FALSE(stored->complete);
  }
  ASSERT_GT(world.map.edges().size(), 5U) << "the world is too simple";
  ASSERT_FALSE(world.map.loops().empty());
}

class FinalMap : public testing::TestWithParam<StoreUse> {};
INSTANTIATE_TEST_SUITE_P(MapStore, FinalMap, testing::Values(StoreUse::kGrowing, StoreUse::kInOneGo));

TEST_P(FinalMap, IsSaved) {
  const StoreFolder folder;
  StoreWorld world(2);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera), GetParam());
  ASSERT_TRUE(writer);
  std::vector<KeyframeId> ids;
  for (int i = 0; i < 6; ++i) {
    ids.push_back(world.step());
    ASSERT_TRUE(writer->add_keyframe(world.map, ids.back(), cloud_bytes(i + 1)));
  }
  for (const KeyframeId k : world.map.keyframe_ids()) {
    world.map.set_pose(k, geometry::Rigid3{Eigen::Matrix3d::Identity(), {0.1 * k.index, 1.0 / 3.0, -0.0}});
  }
  const auto saved = writer->save_final(world.map, world.frames);
  ASSERT_TRUE(saved) << saved.error().message;
  const auto stored = load_map(folder.file());
  ASSERT_TRUE(stored) << stored.error().message;
  EXPECT_TRUE(stored->complete);
  EXPECT_TRUE(equal(stored->map, world.map));
  EXPECT_TRUE(same_all(stored->frames, world.frames_by_robot()));
  for (const char* beside : {"-wal", "-shm", "-journal"}) {
    EXPECT_FALSE(std::filesystem::exists(folder.file().string() + beside)) << beside;
  }
  const auto reader = StoreReader::open(folder.file());
  ASSERT_TRUE(reader);
  std::vector<KeyframeId> sorted = ids;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(reader->cloud_ids().value(), sorted) << "clouds of keyframes that left stay";
  for (std::size_t i = 0; i < ids.size(); ++i) {
    EXPECT_EQ(reader->cloud_bytes(ids[i]).value(), cloud_bytes(static_cast<int>(i) + 1));
    EXPECT_EQ(reader->cloud(ids[i]).value()->size(), i + 1);
  }
  EXPECT_EQ(reader->cloud(KeyframeId{7, 7}).error().kind, core::ErrorKind::kInput);
}

TEST(MapStore, KeepsHeaderAndAttachments) {
  const StoreFolder folder;
  sensor::Camera camera = StoreWorld(3).camera;
  camera.distortion = {0.1, -0.2, 1.0 / 3.0, 1e-300, 5.0};
  camera.depth_scale = 1000.0;
  camera.fps = 29.97;
  camera.readout_s = 0.0;
  camera.depth_slope = {0.0125, -0.005};
  camera.color_from_depth = tests::Random(3).pose(1.0, 1.0);
  camera.depth = sensor::Pinhole{320, 240, 262.0, 263.0, 160.0, 120.0};
  const std::vector<std::uint8_t> robots(5000, 17);
  {
    auto writer = StoreWriter::create(folder.file(), header_of(camera));
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->attach("robots", {1, 2, 3}));
    ASSERT_TRUE(writer->attach("robots", robots));
    ASSERT_TRUE(writer->attach("empty", {}));
  }
  const auto reader = StoreReader::open(folder.file());
  ASSERT_TRUE(reader) << reader.error().message;
  const StoreHeader& header = reader->header();
  EXPECT_EQ(header.robots.front().name, "robot 'a'; DROP TABLE point");
  EXPECT_EQ(header.configuration, header_of(camera).configuration);
  EXPECT_EQ(header.program_version, "1.2.3");
  EXPECT_EQ(header.format, kStoreFormat);
  const sensor::Camera read = camera_of(header.robots, 0);
  EXPECT_EQ(sensor::to_yaml(read), sensor::to_yaml(camera));
  EXPECT_EQ(read.distortion, camera.distortion);
  EXPECT_TRUE(tests::same(*read.color_from_depth, *camera.color_from_depth));
  EXPECT_EQ(read.depth->fy, 263.0);
  EXPECT_EQ(camera_of(header.robots, 7).name, camera.name) << "of one that is not there, the first one's";
  EXPECT_EQ(reader->attachment("robots").value(), robots);
  EXPECT_EQ(reader->attachment("empty").value(), std::vector<std::uint8_t>{});
  EXPECT_EQ(reader->attachment("nothing").value(), std::nullopt);
  const auto empty = reader->load();
  ASSERT_TRUE(empty) << empty.error().message;
  EXPECT_EQ(empty->map.keyframe_count(), 0U);
}

TEST(MapStore, HoldsWhatIsHardlyThere) {
  const StoreFolder folder;
  Map map;
  auto bare = std::make_shared<Keyframe>();
  bare->id = {0, 4};  // ids may start anywhere
  map.add_keyframe(bare, {});
  auto empty = std::make_shared<Keyframe>();
  empty->id = {2, 0};
  empty->features = std::make_shared<features::FrameFeatures>();
  empty->stamp = -0.0;
  map.add_keyframe(empty, {});
  map.remove(map.add_point(5, {}));  // a robot whose only point went
  auto writer = StoreWriter::create(folder.file(), {});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->save_final(map, {}));
  auto stored = load_map(folder.file());
  ASSERT_TRUE(stored) << stored.error().message;
  EXPECT_TRUE(equal(stored->map, map));
  EXPECT_TRUE(std::signbit(stored->map.keyframe({2, 0}).stamp));
  EXPECT_EQ(stored->map.add_point(5, {}), (PointId{5, 1}));
  EXPECT_EQ(stored->map.next_keyframe_id(0), (KeyframeId{0, 5}));
  EXPECT_THROW((void)writer->add_keyframe(map, {9, 9}, {}), std::invalid_argument);
}

TEST(MapStore, GoesOnInAStore) {
  const StoreFolder folder;
  StoreWorld world(4);
  {
    auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
    ASSERT_TRUE(writer);
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), {}, world.frames));
    ASSERT_TRUE(writer->save_final(world.map, world.frames));
  }
  {
    auto writer = StoreWriter::resume(folder.file());
    ASSERT_TRUE(writer) << writer.error().message;
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), {}, world.frames));
  }
  const auto stored = load_map(folder.file());
  ASSERT_TRUE(stored) << stored.error().message;
  EXPECT_FALSE(stored->complete);
  EXPECT_TRUE(equal(stored->map, world.map));
  EXPECT_TRUE(same_all(stored->frames, world.frames_by_robot()));
  // A smaller and different map in the same file: what is no more goes, what is different is replaced.
  StoreWorld other(5);
  other.step();
  auto writer = StoreWriter::resume(folder.file());
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(writer->save_final(other.map, {}));
  const auto replaced = load_map(folder.file());
  ASSERT_TRUE(replaced) << replaced.error().message;
  EXPECT_TRUE(equal(replaced->map, other.map));
  EXPECT_TRUE(replaced->frames.empty());
}

TEST(MapStore, SameMapSameBytes) {
  const StoreFolder folder;
  const auto write = [&](const char* name) {
    StoreWorld world(6);
    auto writer = StoreWriter::create(folder.path / name, header_of(world.camera));
    ASSERT_TRUE(writer);
    for (int i = 0; i < 8; ++i) ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), cloud_bytes(50)));
    ASSERT_TRUE(writer->save_final(world.map, world.frames));
  };
  write("a.db");
  write("b.db");
  const std::string a = bytes_of(folder.path / "a.db");
  EXPECT_GT(a.size(), 10000U);
  const std::string b = bytes_of(folder.path / "b.db");
  ASSERT_EQ(a.size(), b.size());
  const auto differs = std::mismatch(a.begin(), a.end(), b.begin());
  EXPECT_TRUE(differs.first == a.end()) << "at byte " << differs.first - a.begin();
}

TEST(MapStore, KeyframesTakeFewBytes) {
  const StoreFolder folder;
  StoreWorld world(7);
  world.features = 1000;
  world.lines = 100;
  world.deletes = false;
  constexpr int kCount = 6;
  {
    auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
    ASSERT_TRUE(writer);
    for (int i = 0; i < kCount; ++i) ASSERT_TRUE(writer->add_keyframe(world.map, world.step(), {}));
  }
  const auto bytes = static_cast<double>(std::filesystem::file_size(folder.file())) / kCount;
  RecordProperty("bytes_per_keyframe", static_cast<int>(bytes));
  // Random numbers cannot be packed: 1000 points are 56 kB and their patches 125 kB, 100 lines 17 kB, 333 new
  // landmarks 45 kB.
  EXPECT_LT(bytes, 285e3);
  EXPECT_GT(bytes, 150e3);
}

}  // namespace
}  // namespace plumbline::maps
