// SPDX-License-Identifier: BSD-3-Clause
// Coarse surfaces and pictures of keyframes in the store, and stores that were made before there
// were any.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <memory>

#include "plumbline/maps/store.hpp"
#include "store_folder.hpp"
#include "store_world.hpp"

namespace plumbline::maps {
namespace {

using tests::equal;
using tests::header_of;
using tests::StoreFolder;
using tests::StoreWorld;

void change_by_sql(const std::filesystem::path& file, const char* sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
}

std::shared_ptr<const StoredSurface> surface_of(int count) {
  auto surface = std::make_shared<StoredSurface>();
  surface->voxel_m = 0.03;
  for (int i = 0; i < count; ++i) {
    const auto t = static_cast<float>(i);
    SurfaceSample sample;
    sample.point = {-3.0F + 0.01F * t, 2.0F * std::sin(t), 0.5F + 0.013F * t};
    sample.normal = Eigen::Vector3f(std::sin(0.3F * t), 0.2F, -1.0F).normalized();
    sample.sigma = 0.0002F + 0.0001F * t;
    surface->samples.push_back(sample);
  }
  return surface;
}

/// Keyframes of a world with their surfaces, all but the first.
std::vector<KeyframeId> write_store(const std::filesystem::path& file, StoreWorld& world, int keyframes) {
  auto writer = StoreWriter::create(file, header_of(world.camera));
  EXPECT_TRUE(writer);
  std::vector<KeyframeId> ids;
  MapRevision moment;
  for (int i = 0; i < keyframes; ++i) {
    StoreStep step;
    ids.push_back(world.step());
    step.map = std::make_shared<MapChanges>(world.map.changes_since(moment));
    moment = world.map.now();
    const auto bytes = std::make_shared<std::vector<std::uint8_t>>(10, std::uint8_t{7});
    step.clouds.push_back({ids.back(), {}, bytes, i == 0 ? nullptr : surface_of(200 * i)});
    EXPECT_TRUE(writer->add(step));
  }
  return ids;
}

TEST(StorePictures, ComeBackAndTheLastOneCounts) {
  const StoreFolder folder;
  StoreWorld world(6);
  auto writer = StoreWriter::create(folder.file(), header_of(world.camera));
  ASSERT_TRUE(writer);
  StoreStep first;
  const KeyframeId a = world.step();
  const MapRevision moment = world.map.now();
  first.map = std::make_shared<MapChanges>(world.map.changes_since({}));
  first.pictures = {{a, {1, 2, 3}, {}}};
  ASSERT_TRUE(writer->add(first));

  StoreStep second;
  const KeyframeId b = world.step();
  second.map = std::make_shared<MapChanges>(world.map.changes_since(moment));
  second.pictures = {{b, {4, 5}, {6, 7, 8}}};
  ASSERT_TRUE(writer->add(second));
  StoreStep rest;
  rest.pictures = {{b, {4, 5}, {9}}};
  ASSERT_TRUE(writer->save_final(world.map, {}, {}, {rest}));

  const auto reader = StoreReader::open(folder.file());
  ASSERT_TRUE(reader);
  using Bytes = std::vector<std::uint8_t>;
  EXPECT_EQ(reader->small_picture(a).value(), (Bytes{1, 2, 3}));
  EXPECT_EQ(reader->whole_picture(a).value(), Bytes{});
  EXPECT_EQ(reader->small_picture(b).value(), (Bytes{4, 5}));
  EXPECT_EQ(reader->whole_picture(b).value(), Bytes{9});
  EXPECT_EQ(reader->whole_picture_ids().value(), std::vector<KeyframeId>{b});
  EXPECT_EQ(reader->small_picture({0, 99}).value(), Bytes{}) << "there is no such keyframe";
}

TEST(StoreSurface, ComesBackRoundedLessThanWhatIsMeasured) {
  const StoreFolder folder;
  StoreWorld world(5);
  const std::vector<KeyframeId> ids = write_store(folder.file(), world, 3);
  const auto reader = StoreReader::open(folder.file());
  ASSERT_TRUE(reader);
  const auto none = reader->surface_bytes(ids[0]);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->empty());
  const auto bytes = reader->surface_bytes(ids[2]);
  ASSERT_TRUE(bytes);
  EXPECT_LT(bytes->size(), 400U * 12U);
  const auto read = unpack_surface(*bytes);
  ASSERT_TRUE(read) << read.error().message;
  const auto written = surface_of(400);
  EXPECT_EQ(read->voxel_m, 0.03);
  ASSERT_EQ(read->samples.size(), 400U);
  for (std::size_t i = 0; i < 400; ++i) {
    const SurfaceSample& a = read->samples[i];
    const SurfaceSample& b = written->samples[i];
    EXPECT_LT((a.point - b.point).cwiseAbs().maxCoeff(), 1.01e-4F);
    EXPECT_LT((a.normal - b.normal).norm(), 0.004F);
    EXPECT_NEAR(a.normal.norm(), 1.0F, 1e-6F);
    EXPECT_NEAR(a.sigma, b.sigma, 2.6e-6F);
  }
}

TEST(StoreSurface, DamagedOneIsRefused) {
  const StoreFolder folder;
  StoreWorld world(5);
  const std::vector<KeyframeId> ids = write_store(folder.file(), world, 2);
  auto bytes = StoreReader::open(folder.file())->surface_bytes(ids[1]);
  ASSERT_TRUE(bytes);
  for (const std::size_t cut : {std::size_t{0}, std::size_t{3}, bytes->size() / 2, bytes->size() - 1}) {
    EXPECT_FALSE(unpack_surface({bytes->begin(), bytes->begin() + static_cast<std::ptrdiff_t>(cut)})) << cut;
  }
  (*bytes)[bytes->size() / 2] ^= 0x40U;
  const auto read = unpack_surface(*bytes);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().kind, core::ErrorKind::kInput);
}

TEST(StoreSurface, StoresOfAnOlderFormatAreRefusedWithTheRemedy) {
  const StoreFolder folder;
  StoreWorld world(6);
  write_store(folder.file(), world, 3);
  change_by_sql(folder.file(), ("PRAGMA user_version = " + std::to_string(kStoreFormat - 1)).c_str());
  const auto reader = StoreReader::open(folder.file());
  ASSERT_FALSE(reader);
  EXPECT_NE(reader.error().message.find("map the recording again"), std::string::npos)
      << reader.error().message;
  EXPECT_FALSE(StoreWriter::resume(folder.file()));
}

}  // namespace
}  // namespace plumbline::maps
