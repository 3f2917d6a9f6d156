// SPDX-License-Identifier: BSD-3-Clause
// A map of a camera whose depth is 4 % short, brought to scale and place by printed tags.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "program.hpp"
#include "true_frame.hpp"

namespace plumbline::integration {
namespace {

/// Walls near enough to the camera for tags in small pictures.
constexpr const char* kTagRoom = R"(name: small
objects:
  - floor: {from: [-0.1, -0.1], to: [3.4, 3.1], material: planks}
  - ceiling: {from: [-0.1, -0.1], to: [3.4, 3.1], height: 2.5}
  - wall: {name: south, from: [-0.06, -0.06], to: [3.36, -0.06], material: brick}
  - wall: {name: east, from: [3.36, -0.06], to: [3.36, 3.06]}
  - wall: {name: north, from: [3.36, 3.06], to: [-0.06, 3.06], material: brick}
  - wall: {name: west, from: [-0.06, 3.06], to: [-0.06, -0.06]}
  - lamp: {at: [1.6, 1.5, 2.5], width: 0.6, depth: 0.6, power: 3}
  - desk: {at: [0.9, 2.6], size: [1.3, 0.6, 0.74]}
  - clutter: {at: [0.9, 2.6, 0.74], width: 1.2, depth: 0.4, count: 5}
  - cabinet: {at: [2.4, 0.25], yaw: 180 deg, size: [1.2, 0.45, 0.8]}
  - clutter: {at: [2.4, 0.25, 0.8], yaw: 180 deg, width: 1.0, depth: 0.3, count: 4}
  - plant: {at: [0.35, 0.35, 0], height: 1.1}
  - picture: {at: [0.0, 2.0, 1.5], yaw: 90 deg, size: [0.6, 0.5]}
  - poster: {at: [3.3, 2.3, 1.4], yaw: -90 deg, size: [0.5, 0.7]}
robots:
  - {name: one, closed: true, speed: 0.4, turn_rate: 0.5, height: 1.35, pitch: -6 deg,
     path: [{at: [1.8, 1.4], look: [3.3, 1.4, 1.3]}, {at: [1.8, 1.6], look: [2.6, 3, 1.3]},
            {at: [1.5, 1.7], look: [1.2, 3, 1.3]}, {at: [1.4, 1.6], look: [0, 1.6, 1.3]},
            {at: [1.4, 1.4], look: [0.6, 0, 1.3]}, {at: [1.7, 1.3], look: [2.0, 0, 1.3]}]}
)";

/// A row of tags.csv.
struct TagRow {
  Eigen::Vector3d at;
  double sigma = 0.0;
  int keyframes = 0;
  bool used = false;
};

class Tags : public ProgramTest {
 protected:
  static constexpr double kScaleBound = 0.003;

  void SetUp() override {
    write("small.yaml", kTagRoom);
    const Outcome filmed =
        run("synth small.yaml -o world --tags 6 --tag-copies 1 --frames 100 --fps 6 --width 320 --height 240 "
            "--reference-spacing 10cm -q");
    ASSERT_EQ(filmed.code, 0) << filmed;
    std::string camera = slurp(path("world/robot0/camera.yaml"));
    const std::size_t at = camera.find("depth_scale: 5000");
    ASSERT_NE(at, std::string::npos);
    write("world/robot0/camera.yaml", camera.replace(at, 17, "depth_scale: 5200"));
    const Outcome mapped =
        run("map world/robot0 -o m -q --set output.views= --set output.pcd=off --set output.lines=off "
            "--set fuse.voxel=3cm --set store.images=whole");
    ASSERT_EQ(mapped.code, 0) << mapped;

    // Where the tags hang; number 0 hangs twice.
    const auto told = read_json(path("world/scene.json"));
    for (const auto& tag : told["tags"]) {
      const auto& p = tag["middle"];
      truth_.emplace(tag["tag"], Eigen::Vector3d(p[0], p[1], p[2]));
    }
    ASSERT_EQ(truth_.size(), 7U);
    ASSERT_EQ(truth_.count(0), 2U);
  }

  [[nodiscard]] Eigen::Vector3d truth(int tag) const { return truth_.find(tag)->second; }
  [[nodiscard]] Eigen::Matrix4d truth_of(const std::string& result) const {
    return true_frame(path(result) / "trajectory.txt", path("world/robot0/groundtruth.txt"));
  }
  [[nodiscard]] double scale_off(const std::string& result) const {
    return std::abs(std::cbrt(truth_of(result).topLeftCorner<3, 3>().determinant()) - 1.0);
  }
  [[nodiscard]] Outcome adjust(const std::string& output, const std::string& tags,
                               const std::string& more = "") const {
    write("tags.yaml", tags);
    return run("adjust m --force --set output.views= --set output.pcd=off --tags tags.yaml -o " + output +
               more);
  }

  [[nodiscard]] std::map<int, TagRow> rows_of(const std::string& result) const {
    std::map<int, TagRow> rows;
    std::istringstream lines(slurp(path(result) / "tags.csv"));
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line, "tag,x,y,z,sigma,keyframes,used");
    while (std::getline(lines, line)) {
      int tag = 0, used = 0;
      TagRow row;
      EXPECT_EQ(std::sscanf(line.c_str(), "%d,%lf,%lf,%lf,%lf,%d,%d", &tag, &row.at.x(), &row.at.y(),
                            &row.at.z(), &row.sigma, &row.keyframes, &used),
                7)
          << line;
      row.used = used == 1;
      rows.emplace(tag, row);
    }
    return rows;
  }

  /// Middles of used tags lie where they hang, in the frame of the path.
  void expect_in_place(const std::string& result) const {
    const Eigen::Matrix4d frame =
        true_frame(path(result) / "trajectory.txt", path("world/robot0/groundtruth.txt"), false);
    for (const auto& [tag, row] : rows_of(result)) {
      if (!row.used) continue;
      ASSERT_EQ(truth_.count(tag), 1U) << tag;
      const Eigen::Vector3d at = (frame * row.at.homogeneous()).head<3>();
      EXPECT_LT((at - truth(tag)).norm(), 0.01) << result << ": tag " << tag;
    }
  }

  std::multimap<int, Eigen::Vector3d> truth_;
};

class TagWorlds : public ProgramTest {};

TEST_F(TagWorlds, TagsHangOnWallsOfScenesAndOfWorldsByNumber) {
  const std::string small = " --frames 30 --fps 2 --width 480 --height 360 --reference-spacing 10cm -q";
  int count = 0;
  for (const char* world : {"room", "office", "home --layout 7"}) {
    const std::string folder = fmt::format("w{}", count++);
    const Outcome filmed =
        run(fmt::format("synth {} -o {} --tags 3 --tag-copies 1 --texture weak", world, folder) + small);
    ASSERT_EQ(filmed.code, 0) << world << filmed;
    const auto tags = read_json(path(folder + "/scene.json"))["tags"];
    ASSERT_EQ(tags.size(), 4U) << world;
    EXPECT_EQ(tags[3]["tag"], 0) << "the first number is the one that hangs twice";

    // Upright squares of 16 cm, apart from each other.
    for (std::size_t i = 0; i < tags.size(); ++i) {
      const auto place = [](const nlohmann::json& p) { return Eigen::Vector3d(p[0], p[1], p[2]); };
      const Eigen::Vector3d middle = place(tags[i]["middle"]);
      EXPECT_GT(middle.z(), 1.05) << world;
      EXPECT_LT(middle.z(), 1.75) << world;
      const auto& c = tags[i]["corners"];
      EXPECT_NEAR((place(c[0]) - place(c[1])).norm(), 0.16, 1e-9);
      EXPECT_NEAR(place(c[0]).z() - place(c[3]).z(), 0.16, 1e-9);
      EXPECT_NEAR((0.5 * (place(c[0]) + place(c[2])) - middle).norm(), 0.0, 1e-9);
      for (std::size_t j = 0; j < i; ++j) EXPECT_GT((place(tags[j]["middle"]) - middle).norm(), 0.5) << world;
    }
  }

  // More than the cameras see free wall for; more copies than tags.
  const Outcome many = run("synth room -o none --tags 60" + small);
  EXPECT_EQ(many.code, 2) << many;
  EXPECT_TRUE(many.told("the cameras come near free wall for")) << many;
  const Outcome copies = run("synth room -o none --tags 2 --tag-copies 3" + small);
  EXPECT_EQ(copies.code, 2) << copies;
  EXPECT_TRUE(copies.told("tag_copies")) << copies;
  EXPECT_FALSE(fs::exists(path("none")));
}

TEST_F(Tags, LengthsBringScaleAndACopySaysNothing) {
  ASSERT_GT(scale_off("m"), 0.03);
  const Outcome found = adjust("found", "family: 36h11\n");
  ASSERT_EQ(found.code, 0) << found;
  const std::map<int, TagRow> rows = rows_of("found");
  ASSERT_EQ(rows.count(0), 1U);
  EXPECT_FALSE(rows.at(0).used);
  EXPECT_TRUE(found.told("tag 0: is at several places, a copy")) << found;
  EXPECT_GT(scale_off("found"), 0.03) << "nothing was measured";

  // Of the tags that were seen, the two that are farthest from each other.
  int a = -1, b = -1;
  double longest = 0.0;
  std::size_t used = 0;
  for (const auto& [i, row] : rows) {
    used += row.used ? 1 : 0;
    for (const auto& [j, other] : rows) {
      if (!row.used || !other.used || (truth(i) - truth(j)).norm() <= longest) continue;
      longest = (truth(i) - truth(j)).norm();
      a = i;
      b = j;
    }
  }
  ASSERT_GE(used, 4U) << slurp(path("found/tags.csv"));
  ASSERT_GT(longest, 1.5);

  const std::string length =
      fmt::format("control:\n  - {{tags: [{}, {}], length: {:.4f} m}}\n", a, b, longest);
  const Outcome scaled = adjust("scaled", length);
  ASSERT_EQ(scaled.code, 0) << scaled;
  EXPECT_LT(scale_off("scaled"), kScaleBound);
  EXPECT_TRUE(scaled.told(fmt::format("tags {} to {}", a, b))) << scaled;
  expect_in_place("scaled");

  // A wrong length to the copy is told and changes nothing.
  const Outcome copied =
      adjust("copied", length + fmt::format("  - {{tags: [0, {}], length: {:.4f} m}}\n", a, longest + 1.0));
  ASSERT_EQ(copied.code, 0) << copied;
  EXPECT_TRUE(copied.told("tag 0: is at several places, a copy")) << copied;
  EXPECT_TRUE(copied.told(fmt::format("tags 0 to {}: was not seen at one place; it is not used", a)))
      << copied;
  for (const char* file : {"trajectory.txt", "map.ply", "tags.csv"})
    EXPECT_EQ(slurp(path("scaled") / file), slurp(path("copied") / file)) << file;
}

TEST_F(Tags, WorldCoordinatesBringScaleAndPlace) {
  const Outcome found = adjust("found", "family: 36h11\n");
  ASSERT_EQ(found.code, 0) << found;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto in_grid = [&](const Eigen::Vector3d& p) {
    Eigen::Vector3d w = turn * p;
    w.head<2>() *= 0.9996;  // of UTM on its central meridian
    return Eigen::Vector3d(w + Eigen::Vector3d(500000.0, 5330000.0, 510.0));
  };
  std::string control = "control:\n";
  for (const auto& [tag, row] : rows_of("found")) {
    if (!row.used) continue;
    const Eigen::Vector3d w = in_grid(truth(tag));
    control += fmt::format("  - {{tag: {}, at: [{:.4f}, {:.4f}, {:.4f}]}}\n", tag, w.x(), w.y(), w.z());
  }

  const Outcome placed = adjust("placed", control, " --epsg 25832");
  ASSERT_EQ(placed.code, 0) << placed;
  EXPECT_LT(scale_off("placed"), kScaleBound);
  EXPECT_FALSE(placed.told("BLUNDER")) << placed;
  expect_in_place("placed");

  // The cloud lies in the world where the tags hang on walls of both directions.
  const auto place = read_json(path("placed/georeference.json"));
  ASSERT_TRUE(place.contains("export")) << place;
  const Outcome written = run("export placed -o placed.ply " + place["export"].get<std::string>());
  ASSERT_EQ(written.code, 0) << written;
  const auto cloud = cloud::read_cloud(path("placed.ply"), cloud::LargeCoordinates::kShifted);
  ASSERT_TRUE(cloud.has_value());
  for (const auto& [tag, row] : rows_of("placed")) {
    if (!row.used) continue;
    const Eigen::Vector3d at = in_grid(truth(tag)) - cloud->shift;
    double nearest = 1e3;
    for (const auto& p : *cloud->cloud)
      nearest = std::min(nearest, (p.getVector3fMap().cast<double>() - at).norm());
    EXPECT_LT(nearest, 0.03) << tag;
  }
}

TEST_F(Tags, MistakesInTheFileAreNamed) {
  const Outcome typed = adjust("none", "family: 36h11\ncontrol:\n  - {tags: [1, 2], lenght: 2 m}\n");
  EXPECT_EQ(typed.code, 2) << typed;
  EXPECT_TRUE(typed.told("tags.yaml:3")) << typed;
  EXPECT_TRUE(typed.told("length")) << typed;

  const Outcome half = adjust("none", "control:\n  - {tag: 1, length: 2 m}\n");
  EXPECT_EQ(half.code, 2) << half;
  EXPECT_TRUE(half.told("tags.yaml:2")) << half;
  EXPECT_TRUE(half.told("write {tag: 3, at: [E, N, H]}")) << half;

  const Outcome family = adjust("none", "family: 36h10\n");
  EXPECT_EQ(family.code, 2) << family;
  EXPECT_TRUE(family.told("tags.yaml:1")) << family;
  EXPECT_FALSE(fs::exists(path("none")));
}

}  // namespace
}  // namespace plumbline::integration
