// SPDX-License-Identifier: BSD-3-Clause
// Rows that are well packed and say nonsense: a copy takes none, or what it took does no harm.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "plumbline/maps/store.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "store/store_codec.hpp"
#include "store/store_row.hpp"
#include "store_folder.hpp"
#include "store_world.hpp"

namespace plumbline::maps {
namespace {

using tests::header_of;
using tests::StoreFolder;
using tests::StoreWorld;

struct Reported {
  std::int64_t number = 0;
  std::vector<StoreRow> rows;
};

/// What a store tells of its map, row by row.
std::vector<Reported> reported_by(const std::filesystem::path& file) {
  std::vector<Reported> all;
  std::int64_t after = 0;
  while (const auto next = next_transaction(file, StoreStream::kMap, after).value()) {
    after = next->number;
    Reported told{next->number, {}};
    Bytes rows = next->rows;
    consume_rows(rows, [&](const StoreRow& row, std::size_t) { told.rows.push_back(row); });
    all.push_back(std::move(told));
  }
  return all;
}

core::Result<void> tell(StoreReplica& copy, const Reported& told) {
  ByteWriter bytes;
  for (const StoreRow& row : told.rows) append(row, bytes);
  if (auto begun = copy.begin(StoreStream::kMap, told.number); !begun) return begun;
  if (auto taken = copy.append(bytes.bytes().data(), bytes.bytes().size()); !taken) return taken;
  return copy.commit();
}

class Nonsense : public testing::Test {
 protected:
  Nonsense() : world_(41) {
    auto writer = StoreWriter::create(folder_.file(), header_of(world_.camera));
    for (int i = 0; i < 6; ++i) {
      EXPECT_TRUE(writer->add_keyframe(world_.map, world_.step(), {}, world_.frames));
    }
    all_ = reported_by(folder_.file());
  }
  /// What is said when the first row of a table is changed so.
  std::string refusal(const std::string& table, const std::function<void(StoreRow&)>& change) {
    const auto copied = folder_.path / "nonsense.db";
    std::filesystem::remove(copied);
    auto copy = StoreReplica::open(copied);
    bool changed = false;
    for (Reported told : all_) {
      for (StoreRow& row : told.rows) {
        if (changed || kRowTables[row.name.table].name != table) continue;
        if (table == "header" && row.name.key != "robots") continue;
        change(row);
        changed = true;
      }
      const auto taken = tell(*copy, told);
      if (!taken) return taken.error().message;
    }
    return changed ? "it was taken" : "there was no such row";
  }
  static void put(StoreRow& row, const std::function<void(ByteWriter&)>& encode) {
    ByteWriter bytes;
    encode(bytes);
    row.data = pack(bytes.bytes());
  }

  StoreFolder folder_;
  StoreWorld world_;
  std::vector<Reported> all_;
};

TEST_F(Nonsense, IsNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto contains = [](const std::string& text, const char* what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  const auto unpacked = [](const StoreRow& row) { return unpack(row.data.data(), row.data.size()); };
  contains(refusal("header",
                   [&](StoreRow& row) {
                     std::vector<RobotInfo> robots = header_of(world_.camera).robots;
                     robots.front().camera.color.fx = nan;
                     put(row, [&](ByteWriter& to) { encode(robots, to); });
                   }),
           "header robots: a camera's focal length is not positive");
  contains(refusal("state",
                   [&](StoreRow& row) {
                     KeyframeState state = decode<KeyframeState>(unpacked(row));
                     state.camera_from_world.translation.x() = nan;
                     put(row, [&](ByteWriter& to) { encode(state, to); });
                   }),
           "a pose is not finite");
  contains(refusal("keyframe",
                   [&](StoreRow& row) {
                     Keyframe keyframe = *decode_keyframe(unpacked(row), world_.camera.color);
                     keyframe.stamp = nan;
                     put(row, [&](ByteWriter& to) { encode(keyframe, to); });
                   }),
           "its stamp is not finite");
  contains(refusal("keyframe", [](StoreRow& row) { ++row.name.number; }), "belongs to another row");
  contains(refusal("keyframe", [](StoreRow& row) { row.name.number = 2147483647; }), "out of range");
  contains(refusal("keyframe", [](StoreRow& row) { row.name.robot = -1; }), "out of range");
  contains(refusal("keyframe",
                   [](StoreRow& row) { row.data = pack(Bytes(std::size_t{65} << 20U, std::uint8_t{0})); }),
           "its head is damaged");  // 8 kB that would unpack to 65 MB
  contains(refusal("point",
                   [&](StoreRow& row) {
                     auto points = decode_page<MapPoint>(unpacked(row));
                     points.push_back(points.back());
                     put(row, [&](ByteWriter& to) {
                       for (const MapPoint& p : points) encode(p, to);
                     });
                   }),
           "a landmark is there twice");
  contains(refusal("point",
                   [&](StoreRow& row) {
                     auto points = decode_page<MapPoint>(unpacked(row));
                     points.front().observations.front().keyframe.index = 2147483647;
                     put(row, [&](ByteWriter& to) {
                       for (const MapPoint& p : points) encode(p, to);
                     });
                   }),
           "an id is out of range");
  EXPECT_EQ(refusal("edge", [](StoreRow&) {}), "it was taken");
}

TEST_F(Nonsense, ThatIsPackedAgainDoesNoHarm) {
  std::mt19937 random(6);
  int refused = 0;
  int loaded = 0;
  for (int round = 0; round < 1000; ++round) {
    const auto copied = folder_.path / "mutated.db";
    std::filesystem::remove(copied);
    auto copy = StoreReplica::open(copied);
    ASSERT_TRUE(copy);
    const std::size_t victim = random() % all_.size();
    bool taken = true;
    for (std::size_t i = 0; i < all_.size() && taken; ++i) {
      Reported told = all_[i];
      StoreRow& row = told.rows[random() % told.rows.size()];
      if (i == victim && row.type == SQLITE_BLOB && !row.data.empty()) {
        Bytes plain = unpack(row.data.data(), row.data.size());
        for (auto k = 1 + random() % 3; k > 0 && !plain.empty(); --k) {
          plain[random() % plain.size()] = static_cast<std::uint8_t>(random());
        }
        if (random() % 4 == 0) plain.resize(random() % (plain.size() + 1));
        row.data = pack(plain);
      }
      const auto done = tell(*copy, told);
      taken = done.has_value();
      if (taken) continue;
      EXPECT_EQ(done.error().kind, core::ErrorKind::kInput) << done.error().message;
    }
    refused += taken ? 0 : 1;
    if (taken) loaded += load_map(copied).has_value() ? 1 : 0;
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(loaded, 100) << "most changes are of descriptors and the like, which may have any value";
}

}  // namespace
}  // namespace plumbline::maps
