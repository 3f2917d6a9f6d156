// SPDX-License-Identifier: BSD-3-Clause
// Points of a page, read back by the words of viz/viewer/README.md.
#include <gtest/gtest.h>
#include <libdeflate.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>

#include "encode.hpp"
#include "plumbline/viewer/page.hpp"

namespace plumbline::viewer {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

std::vector<std::uint8_t> inflated(const std::string& packed, std::size_t size) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> reader(
      libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  std::vector<std::uint8_t> bytes(size);
  std::size_t got = 0;
  EXPECT_EQ(
      libdeflate_deflate_decompress(reader.get(), packed.data(), packed.size(), bytes.data(), size, &got),
      LIBDEFLATE_SUCCESS);
  EXPECT_EQ(got, size);
  return bytes;
}

struct Read {
  Eigen::Vector3d place;
  std::array<int, 3> color{};
  std::array<int, 2> fold{};
  std::vector<int> layers;
  int level = 0;
};

/// One plane of differences.
std::vector<int> summed(const std::vector<std::uint8_t>& bytes, std::size_t from, std::size_t count,
                        bool is_signed) {
  std::vector<int> values;
  std::uint8_t at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    at = static_cast<std::uint8_t>(at + bytes[from + i]);
    values.push_back(is_signed ? static_cast<std::int8_t>(at) : at);
  }
  return values;
}

void read_chunk(const EncodedCloud& cloud, const Chunk& chunk, const Points& points, std::vector<Read>& out) {
  const std::size_t n = chunk.count;
  const auto bytes = inflated(chunk.points, 9 * n);
  std::vector<Read> read(n);
  for (int k = 0; k < 3; ++k) {
    std::uint16_t at = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t plane = static_cast<std::size_t>(2 * k) * n;
      const int z = bytes[plane + i] | bytes[plane + n + i] << 8;
      at = static_cast<std::uint16_t>(at + ((z & 1) != 0 ? -(z + 1) / 2 : z / 2));
      read[i].place[k] = cloud.origin[static_cast<std::size_t>(k)] + cloud.step_m * at;
      EXPECT_GE(at, chunk.low[static_cast<std::size_t>(k)]);
      EXPECT_LE(at, chunk.high[static_cast<std::size_t>(k)]);
    }
  }

  const auto y = summed(bytes, 6 * n, n, false);
  const auto co = summed(bytes, 7 * n, n, true);
  const auto cg = summed(bytes, 8 * n, n, true);
  for (std::size_t i = 0; i < n; ++i)
    read[i].color = {y[i] - 2 * cg[i] + 2 * co[i], y[i] + 2 * cg[i], y[i] - 2 * cg[i] - 2 * co[i]};
  if (!chunk.normals.empty()) {
    const auto folds = inflated(chunk.normals, 2 * n);
    const auto u = summed(folds, 0, n, false);
    const auto v = summed(folds, n, n, false);
    for (std::size_t i = 0; i < n; ++i) read[i].fold = {u[i], v[i]};
  }
  for (std::size_t l = 0; l < points.layers.size(); ++l) {
    const bool wide = points.layers[l].scale == Scale::kView;
    const auto layer = inflated(chunk.layers[l], (wide ? 2 : 1) * n);
    const auto steps = wide ? std::vector<int>() : summed(layer, 0, n, false);
    for (std::size_t i = 0; i < n; ++i)
      read[i].layers.push_back(wide ? layer[i] | layer[n + i] << 8 : steps[i]);
  }
  for (Read& r : read) r.level = chunk.level;
  out.insert(out.end(), read.begin(), read.end());
}

std::vector<Read> read_back(const EncodedCloud& cloud, const Points& points) {
  std::vector<Read> all;
  for (const Chunk& chunk : cloud.chunks) read_chunk(cloud, chunk, points, all);
  return all;
}

Eigen::Vector3d unfolded(const std::array<int, 2>& fold) {
  const double u = (fold[0] - 1) / 15.0 - 1.0;
  const double v = (fold[1] - 1) / 15.0 - 1.0;
  const double z = 1.0 - std::abs(u) - std::abs(v);
  if (z >= 0.0) return Eigen::Vector3d(u, v, z).normalized();
  return Eigen::Vector3d(std::copysign(1.0 - std::abs(v), u), std::copysign(1.0 - std::abs(u), v), z)
      .normalized();
}

/// A room's walls and floor, 5 mm apart, with noise; `count` points.
Points room(std::size_t count, unsigned seed = 1) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<float>(random() % 100000U) / 1e5F; };
  Points points;
  points.name = "room";
  Layer confidence{"confidence", "Confidence", ""};
  Layer view{"view", "Time seen", "s", Scale::kView};
  for (std::size_t i = 0; i < count; ++i) {
    const float a = 6.0F * uniform();
    const float b = 4.0F * uniform();
    const float noise = 0.002F * (uniform() - 0.5F);
    const bool floor = i % 2 == 0;
    points.positions.push_back(floor ? std::array<float, 3>{a, b, noise}
                                     : std::array<float, 3>{a, noise, 0.6F * b});
    points.normals.push_back(floor ? std::array<float, 3>{0, 0, 1} : std::array<float, 3>{0, 1, 0});
    points.colors.push_back(
        {static_cast<std::uint8_t>(40.0F * a), static_cast<std::uint8_t>(60.0F * b), 200});
    confidence.values.push_back(i % 7 == 0 ? kNaN : b / 4.0F);
    view.values.push_back(std::floor(400.0F * a / 6.0F));
  }
  points.layers = {confidence, view};
  return points;
}

TEST(ViewerEncode, EveryPointComesBackOnceWithWhatItHas) {
  const Points points = room(20000);
  const EncodedCloud cloud = encode(points, true);
  ASSERT_EQ(cloud.chunks.size(), 1U);
  std::vector<Read> read = read_back(cloud, points);
  ASSERT_EQ(read.size(), points.positions.size());

  // Both by their place on the grid; points that share a place are told apart by nothing and left out.
  const auto key = [&](const Eigen::Vector3d& p) {
    std::array<long, 3> steps{};
    for (std::size_t k = 0; k < 3; ++k)
      steps[k] = std::lround((p[static_cast<int>(k)] - cloud.origin[k]) / cloud.step_m);
    return steps;
  };
  std::map<std::array<long, 3>, std::vector<const Read*>> by_place;
  for (const Read& r : read) by_place[key(r.place)].push_back(&r);
  std::size_t compared = 0;
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    const auto& [x, y, z] = points.positions[i];
    const auto found = by_place.find(key({x, y, z}));
    ASSERT_NE(found, by_place.end()) << i;
    if (found->second.size() > 1) continue;
    const Read& r = *found->second.front();
    EXPECT_LT((r.place - Eigen::Vector3d(x, y, z)).lpNorm<Eigen::Infinity>(), 0.0011);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(r.color[k], points.colors[i][k], 5) << i;
    const auto& [nx, ny, nz] = points.normals[i];
    EXPECT_GT(unfolded(r.fold).dot(Eigen::Vector3d(nx, ny, nz)), 0.997);
    const float confidence = points.layers[0].values[i];
    EXPECT_EQ(r.layers[0] == 0, std::isnan(confidence));
    if (r.layers[0] > 0) {
      EXPECT_NEAR((r.layers[0] - 1) / 32.0, confidence, 0.017);
    }
    EXPECT_EQ(r.layers[1] - 1, static_cast<int>(points.layers[1].values[i]));
    ++compared;
  }
  EXPECT_GT(compared, 15000U);
}

TEST(ViewerEncode, LevelsGrowAndCoverTheWhole) {
  const Points points = room(400000);
  const EncodedCloud cloud = encode(points, true);
  ASSERT_GE(cloud.spacing_m.size(), 2U);
  EXPECT_TRUE(std::is_sorted(cloud.spacing_m.rbegin(), cloud.spacing_m.rend()));
  std::vector<std::size_t> counts(cloud.spacing_m.size());
  for (const Chunk& chunk : cloud.chunks) counts[static_cast<std::size_t>(chunk.level)] += chunk.count;
  EXPECT_LE(counts[0], 120000U);
  EXPECT_GT(counts[0], 10000U);

  // Each fifth of a metre of floor that has twenty points or more has some of the first level.
  std::map<std::pair<int, int>, int> all;
  std::set<std::pair<int, int>> first;
  for (const Read& r : read_back(cloud, points)) {
    if (std::abs(r.place.z()) > 0.01) continue;
    const std::pair<int, int> cell(static_cast<int>(r.place.x() / 0.2), static_cast<int>(r.place.y() / 0.2));
    ++all[cell];
    if (r.level == 0) first.insert(cell);
  }
  for (const auto& [cell, count] : all) {
    if (count >= 20) {
      EXPECT_EQ(first.count(cell), 1U) << cell.first << ' ' << cell.second;
    }
  }
}

TEST(ViewerEncode, SmallAndTheSameEachTime) {
  const Points points = room(400000);
  Scene scene;
  scene.name = "a <b> & \"c\"</script>";
  scene.clouds = {points};
  Cost cost;
  const std::string html = page(scene, "test", &cost);
  EXPECT_EQ(html, page(scene, "test"));
  EXPECT_LE(cost.code, 61500U);
  EXPECT_EQ(cost.points, 400000U);
  EXPECT_LT(static_cast<double>(cost.place_and_color) / 4e5,
            5.0);  // at random places; surfaces of maps: under 4.2
  EXPECT_EQ(html.find("<b>"), std::string::npos);
  std::size_t scripts = 0;
  std::size_t ends = 0;
  for (std::size_t at = 0; (at = html.find("<script", at)) != std::string::npos; ++at) ++scripts;
  for (std::size_t at = 0; (at = html.find("</script>", at)) != std::string::npos; ++at) ++ends;
  EXPECT_EQ(scripts, ends);
}

TEST(ViewerEncode, FewPointsAndFarOnes) {
  for (const std::size_t count : {0U, 1U, 2U}) {
    const Points points = room(count);
    EXPECT_EQ(read_back(encode(points, true), points).size(), count);
  }

  Points far = room(2);
  far.positions = {{0, 0, 0}, {1000, 10, 0}};
  far.shift = {500000.0, 6000000.0, 40.0};
  const EncodedCloud cloud = encode(far, true);
  EXPECT_GT(cloud.step_m, 0.015);  // 1 km on 65535 steps
  for (const Read& r : read_back(cloud, far)) {
    EXPECT_NEAR(r.place.y(), r.place.x() > 500500.0 ? 6000010.0 : 6000000.0, cloud.step_m);
  }
}

TEST(ViewerEncode, AMapWhoseYIsDownIsTurnedUpright) {
  Points points = room(1);
  points.positions = {{1, 2, 3}};
  const auto read = read_back(encode(points, false), points);
  EXPECT_LT((read.front().place - Eigen::Vector3d(1, 3, -2)).norm(), 0.003);
}

TEST(ViewerEncode, ErrorsOfAPoseAreTurnedWithItsCamera) {
  Scene scene;
  scene.z_up = false;
  scene.keyframes.resize(1);
  Keyframe& keyframe = scene.keyframes.front();
  keyframe.world_from_camera.rotation =
      Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  keyframe.in_camera.emplace();
  keyframe.in_camera->fill(geometry::Vector6d::Zero());
  keyframe.in_camera->front() << 0.32, 0.0, -0.16, 0.0, 0.0, 0.064;
  const std::string html = page(scene, "test");

  // 16 bits each: the camera's x is the world's y, which is -z of what is shown.
  const std::vector<std::int16_t> steps{0, -16000, -32000, 0, 32000, 0};
  std::string bytes(reinterpret_cast<const char*>(steps.data()), 12);
  EXPECT_NE(html.find("\"s\":\"" + base64(bytes)), std::string::npos);
  EXPECT_NE(html.find("\"e\":[1"), std::string::npos);

  // Of a pose that nothing is known of there is nothing.
  keyframe.in_camera->front()[2] = std::nan("");
  EXPECT_EQ(page(scene, "test").find("\"s\":\""), std::string::npos);
}

TEST(ViewerEncode, Base64) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

}  // namespace
}  // namespace plumbline::viewer
