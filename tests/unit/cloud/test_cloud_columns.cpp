// SPDX-License-Identifier: BSD-3-Clause
// What files know of points beside position, normal and colour goes with the points through chains.
#include "plumbline/cloud/columns.hpp"
#include "test_cloud_filter_run.hpp"

namespace plumbline::cloud {
namespace {

using worlds::kNan;
using worlds::point;
using worlds::slurp;

/// Ten points in a row, 1 m apart, with every kind of column.
struct Row {
  CloudPtr cloud = std::make_shared<Cloud>();
  CloudColumns columns;
  Row() {
    columns.others.push_back({"intensity", {}});
    for (std::uint32_t i = 0; i < 10; ++i) {
      cloud->push_back(point(static_cast<float>(i), 0, 1));
      columns.confidence.push_back(0.05F * static_cast<float>(i));
      columns.observations.push_back(100 + i);
      columns.robot.push_back(static_cast<std::uint8_t>(i / 5));
      columns.others[0].values.push_back(-1.5F * static_cast<float>(i));
    }
  }
};

struct Filtered {
  CloudPtr cloud;
  CloudColumns columns;
};

core::Result<Filtered> filter(const std::string& entry, const CloudConstPtr& cloud,
                              const CloudColumns& columns) {
  Filtered result;
  FilterContext context;
  context.columns = &columns;
  context.made_columns = &result.columns;
  auto filtered = worlds::run(entry, cloud, context);
  if (!filtered) return tl::unexpected<core::Error>(filtered.error());
  result.cloud = *filtered;
  return result;
}

Filtered filter(const std::string& entry, const Row& row) {
  auto result = filter(entry, row.cloud, row.columns);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? *result : Filtered();
}

using Numbers = std::vector<std::uint32_t>;

TEST(Columns, FollowThePointsThatWereChosen) {
  const Row row;
  Cloud after;
  for (const std::size_t i : {2U, 3U, 7U}) after.push_back((*row.cloud)[i]);
  EXPECT_EQ(carry_columns(*row.cloud, row.columns, after).observations, (Numbers{102, 103, 107}));
  std::swap(after[0], after[2]);
  const CloudColumns swapped = carry_columns(*row.cloud, row.columns, after);
  EXPECT_EQ(swapped.observations, (Numbers{107, 103, 102}));
  EXPECT_EQ(swapped.others[0].values, (std::vector<float>{-10.5F, -4.5F, -3.0F}));
  after[1].x += 0.1F;  // moved: the nearest one's
  EXPECT_EQ(carry_columns(*row.cloud, row.columns, after).observations, (Numbers{107, 103, 102}));
  EXPECT_TRUE(carry_columns(*row.cloud, row.columns, Cloud()).observations.empty());
  EXPECT_EQ(carry_columns(Cloud(), {}, after).observations.size(), 0U);
}

TEST(Columns, FollowPointsThatMovedTogetherByTheirOrder) {
  const Row row;
  const Filtered moved = filter("{type: transform, translation: [-3 m, 0 m, 0 m]}", row);
  EXPECT_EQ(moved.columns.observations, row.columns.observations);
}

TEST(Columns, KeepTheirPlaceInAnOrganisedCloudWithHoles) {
  Row row;
  (*row.cloud)[4].x = kNan;
  row.cloud->width = 5;
  row.cloud->height = 2;
  const Filtered kept = filter("{type: pass_through, field: x, max: 6.5}", row);
  ASSERT_EQ(kept.cloud->size(), 10U);
  EXPECT_EQ(kept.columns.observations, row.columns.observations);
  // A list of what is left has its own.
  const Filtered listed = filter("{type: uniform_sampling, leaf: 1 cm}", row);
  EXPECT_EQ(listed.columns.observations, (Numbers{100, 101, 102, 103, 105, 106, 107, 108, 109}));
}

TEST(Columns, OfACellAreMeansMostAndFirst) {
  const Row row;
  const Filtered grid = filter("{type: voxel_grid, leaf: 4 m}", row);  // 0-3, 4-7, 8-9
  ASSERT_EQ(grid.cloud->size(), 3U);
  EXPECT_EQ(grid.columns.observations, (Numbers{103, 107, 109}));
  EXPECT_EQ(grid.columns.robot, (std::vector<std::uint8_t>{0, 0, 1}));
  ASSERT_EQ(grid.columns.confidence.size(), 3U);
  EXPECT_NEAR(grid.columns.confidence[1], 0.275F, 1e-6F);
  EXPECT_NEAR(grid.columns.others[0].values[2], -12.75F, 1e-6F);
  const Filtered full = filter("{type: voxel_grid, leaf: 4 m, min_points: 3}", row);
  EXPECT_EQ(full.columns.observations, (Numbers{103, 107}));
}

TEST(Columns, OfCellsBelongToPclsPoints) {
  // Random points, some below zero: every point of the grid must get the mean of its own cell.
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-1.0F, 1.0F);
  Row row;
  row.cloud->clear();
  row.columns = {};
  row.columns.others.push_back({"tag", {}});
  for (int i = 0; i < 3000; ++i) {
    row.cloud->push_back(point(place(random), place(random), place(random)));
    row.columns.others[0].values.push_back(row.cloud->back().x + 10.0F * row.cloud->back().z);
  }
  const Filtered grid = filter("{type: voxel_grid, leaf: 30 cm}", row);
  ASSERT_EQ(grid.columns.others.at(0).values.size(), grid.cloud->size());
  for (std::size_t i = 0; i < grid.cloud->size(); ++i) {
    const Point& p = (*grid.cloud)[i];
    ASSERT_NEAR(grid.columns.others[0].values[i], p.x + 10.0F * p.z, 1e-4F) << i;
  }
}

TEST(Columns, OfSmoothedPointsStayWithThem) {
  CloudPtr cloud = worlds::square(8, 0.01F);
  cloud->push_back(point(5, 5, 5));  // alone: it goes
  std::rotate(cloud->begin(), cloud->end() - 1, cloud->end());
  CloudColumns columns;
  for (std::uint32_t i = 0; i < cloud->size(); ++i) columns.observations.push_back(i);
  const auto smooth = filter("{type: mls, radius: 3 cm}", cloud, columns);
  ASSERT_TRUE(smooth);
  ASSERT_EQ(smooth->columns.observations.size(), 64U);
  EXPECT_EQ(smooth->columns.observations.front(), 1U);
  EXPECT_EQ(smooth->columns.observations.back(), 64U);
}

TEST(Columns, ArePassedThroughByTheirNames) {
  const Row row;
  EXPECT_EQ(
      filter("{type: pass_through, column: observations, min: 107, max: 200}", row).columns.observations,
      (Numbers{107, 108, 109}));
  EXPECT_EQ(
      filter("{type: pass_through, column: intensity, min: -1.6, max: 0, inside: off}", row).cloud->size(),
      8U);
  const auto gone = filter("{type: pass_through, column: intensty}", row.cloud, row.columns);
  ASSERT_FALSE(gone);
  EXPECT_NE(gone.error().message.find("no 'intensty' (it has: confidence, observations, robot, intensity)"),
            std::string::npos)
      << gone.error().message;
}

TEST(Columns, AreMergedAndTeed) {
  const Row row;
  const auto folder = std::filesystem::path(testing::TempDir());
  CloudColumns theirs;
  theirs.observations = {7, 8};
  theirs.others.push_back({"label", {4.0F, 5.0F}});
  Cloud two;
  two.push_back(point(20, 0, 0));
  two.push_back(point(21, 0, 0));
  ASSERT_TRUE(write_pcd(folder / "theirs.pcd", two, theirs));
  const Filtered merged = filter("{type: merge, file: " + (folder / "theirs.pcd").string() + "}", row);
  ASSERT_EQ(merged.cloud->size(), 12U);
  EXPECT_EQ(merged.columns.observations.back(), 8U);
  EXPECT_EQ(merged.columns.confidence.size(), 12U);
  EXPECT_EQ(merged.columns.confidence.back(), 0.0F);
  ASSERT_EQ(merged.columns.others.size(), 2U);
  EXPECT_EQ(merged.columns.others[1].name, "label");
  EXPECT_EQ(merged.columns.others[1].values[10], 4.0F);
  EXPECT_EQ(merged.columns.others[1].values[9], 0.0F);
  filter("{type: tee, file: " + (folder / "teed.ply").string() + "}", row);
  const auto teed = read_cloud(folder / "teed.ply");
  ASSERT_TRUE(teed);
  EXPECT_EQ(teed->columns.observations, row.columns.observations);
  EXPECT_EQ(teed->columns.others.at(0).values, row.columns.others[0].values);
}

TEST(Columns, OfOtherProgramsAreReadAndWrittenInEveryFormat) {
  const Row row;
  const auto folder = std::filesystem::path(testing::TempDir());
  for (const std::string ending : {".ply", ".pcd"}) {
    ASSERT_TRUE(write_cloud(folder / ("others" + ending), *row.cloud, row.columns));
    const auto read = read_cloud(folder / ("others" + ending));
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->columns.others.size(), 1U) << ending;
    EXPECT_EQ(read->columns.others[0].name, "intensity");
    EXPECT_EQ(read->columns.others[0].values, row.columns.others[0].values);
  }
  std::ofstream(folder / "others.csv") << "x,y,z,intensity,intensity,alpha,o d\n1,2,3,0.5,9,1,1,1\n";
  const auto refused = read_cloud(folder / "others.csv");  // eight numbers, eight names: "o d" is two
  ASSERT_TRUE(refused) << refused.error().message;
  ASSERT_EQ(refused->columns.others.size(), 3U);
  EXPECT_EQ(refused->columns.others[0].values, std::vector<float>{0.5F});  // the first of that name
  EXPECT_EQ(refused->columns.others[1].name, "o");
  std::ofstream(folder / "others_ascii.pcd")
      << "VERSION 0.7\nFIELDS x y z label _ fpfh\nSIZE 4 4 4 2 1 4\nTYPE F F F U U F\nCOUNT 1 1 1 1 1 3\n"
         "WIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3 777 0 1 2 3\n";
  const auto pcd = read_cloud(folder / "others_ascii.pcd");
  ASSERT_TRUE(pcd) << pcd.error().message;
  ASSERT_EQ(pcd->columns.others.size(), 1U);
  EXPECT_EQ(pcd->columns.others[0].name, "label");
  EXPECT_EQ(pcd->columns.others[0].values, std::vector<float>{777.0F});
}

}  // namespace
}  // namespace plumbline::cloud
