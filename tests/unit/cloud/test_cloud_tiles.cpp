// SPDX-License-Identifier: BSD-3-Clause
// Tiles give the points that the whole cloud would.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "plumbline/cloud/filters/tiled_filter.hpp"
#include "test_cloud_filter_run.hpp"

namespace plumbline::cloud {
namespace {

namespace fs = std::filesystem;

class Tiles : public testing::Test {
 protected:
  Tiles() : folder_(fs::temp_directory_path() / ("plumbline_tiles_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> place(-1.0F, 1.0F);
    columns_.others.push_back({"intensity", {}});
    for (int i = 0; i < 20000; ++i) {
      Point p = worlds::point(3.0F * place(random), 2.0F * place(random), place(random));
      p.r = static_cast<std::uint8_t>(i % 251);
      cloud_.push_back(p);
      columns_.confidence.push_back(0.5F + 0.5F * place(random));
      columns_.observations.push_back(static_cast<std::uint32_t>(i % 17));
      columns_.others[0].values.push_back(place(random));
    }
  }
  ~Tiles() override { fs::remove_all(folder_); }

  static FilterChain chain(const std::string& entries) {
    core::ConfigProblems problems;
    const auto node = core::parse_yaml("chain: test\nfilters:\n" + entries, "test.yaml");
    return FilterChain::parse(*node, "", builtin_filters(), problems);
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_ / name; }
  core::Result<TiledReport> tile(const FilterChain& chain, const std::string& input, double tile_m) const {
    CloudFrame frame;
    return filter_in_tiles(chain, {{path(input)}, path("tiled.ply")}, tile_m, frame, nullptr, {});
  }
  /// Rows of a file, sorted, each as text.
  [[nodiscard]] std::vector<std::string> rows(const std::string& name) const {
    const auto file = read_cloud(path(name), LargeCoordinates::kShifted);
    std::vector<std::string> rows;
    for (std::size_t i = 0; file && i < file->cloud->size(); ++i) {
      const Point& p = (*file->cloud)[i];
      const Eigen::Vector3d at = p.getVector3fMap().cast<double>() + file->shift;
      rows.push_back(fmt::format("{:.4f} {:.4f} {:.4f} {} {:.5f} {} {:.5f}", at.x(), at.y(), at.z(), p.r,
                                 file->columns.confidence[i], file->columns.observations[i],
                                 file->columns.others[0].values[i]));
    }
    std::sort(rows.begin(), rows.end());
    return rows;
  }

  fs::path folder_;
  Cloud cloud_;
  CloudColumns columns_;
};

TEST_F(Tiles, GiveThePointsOfTheWhole) {
  const FilterChain local = chain(
      "  - {type: voxel_grid, leaf: 8 cm}\n  - {type: radius_outlier, radius: 15 cm, min_neighbours: 8}\n"
      "  - {type: pass_through, field: z, min: -0.8, max: 0.9}\n");
  for (const Eigen::Vector3d& shift : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(691000, 5333000, 0)}) {
    ASSERT_TRUE(write_ply(path("in.ply"), cloud_, columns_, shift));
    const auto whole = read_cloud(path("in.ply"), LargeCoordinates::kShifted);
    FilterContext context;
    CloudColumns made;
    context.shift = whole->shift;
    context.columns = &whole->columns;
    context.made_columns = &made;
    const auto filtered = local.apply(whole->cloud, context);
    ASSERT_TRUE(filtered);
    ASSERT_TRUE(write_ply(path("whole.ply"), **filtered, made, whole->shift));

    const auto report = tile(local, "in.ply", 1.5);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_GT(report->tiles, 20U);
    EXPECT_LT(report->fullest, cloud_.size() / 4);
    EXPECT_EQ(report->points_in, cloud_.size());
    EXPECT_GT(report->points_out, 1000U);
    EXPECT_EQ(rows("tiled.ply"), rows("whole.ply"));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 3) << "no tiles are left";
}

TEST_F(Tiles, RefuseWhatNeedsTheWhole) {
  const auto message = [&](const std::string& entries, const std::string& input, double tile_m) {
    const auto report = tile(chain(entries), input, tile_m);
    EXPECT_FALSE(fs::exists(path("tiled.ply")));
    return report ? std::string() : report.error().message;
  };
  ASSERT_TRUE(write_ply(path("in.ply"), cloud_, columns_));
  const std::string crop = "  - {type: pass_through}\n";
  EXPECT_NE(
      message(crop + "  - {type: clusters}\n", "in.ply", 2.0).find("filters[1] (clusters): needs the whole"),
      std::string::npos);
  EXPECT_NE(message("  - {type: voxel_grid, leaf: 1 m}\n", "in.ply", 2.0).find("too small"),
            std::string::npos);

  std::ofstream(path("text.ply"))
      << "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n1 2 3\n";
  EXPECT_NE(message(crop, "text.ply", 2.0).find("is a text file"), std::string::npos);
  fs::resize_file(path("in.ply"), fs::file_size(path("in.ply")) - 100);
  EXPECT_NE(message(crop, "in.ply", 2.0).find("is truncated"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::cloud
