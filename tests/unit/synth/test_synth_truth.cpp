// SPDX-License-Identifier: BSD-3-Clause
// Truth beside a recording: truth.csv, events.csv and masks of what moves.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <sstream>

#include "plumbline/dataset/image_io.hpp"
#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

namespace fs = std::filesystem;

/// Someone walks across, 2.5 m away.
const char* const kTruthCell = R"(
objects:
  - floor: {from: [-2, -3], to: [2, 2.1], material: lino}
  - wall: {name: front, from: [-2, 2.05], to: [2, 2.05], thickness: 0.1, material: poster_wall}
  - lamp: {at: [0, 0, 2.5], power: 2}
robots:
  - path: [{at: [0, -1, 1.2], look: [0, 9, 1.2]}, {at: [0.6, -1, 1.2], look: [2, 9, 1.2]}]
walkers:
  - {from: [-0.5, 1.5], to: [0.5, 1.5], speed: 0.5}
)";

/// Rows of a file of comma-separated values, by the names of its columns.
std::vector<std::map<std::string, std::string>> table_of(const fs::path& file) {
  std::ifstream in(file);
  std::string line, cell;
  std::vector<std::string> names;
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::vector<std::string> values;
    while (std::getline(cells, cell, ',')) values.push_back(cell);
    if (names.empty()) {
      names = values;
      continue;
    }
    values.resize(names.size());
    rows.emplace_back();
    for (std::size_t i = 0; i < names.size(); ++i) rows.back()[names[i]] = values[i];
  }
  return rows;
}

TEST(SynthTruth, RowsHaveMotionMoversAndEvents) {
  const fs::path folder = fs::path(::testing::TempDir()) / ("plumbline_truth_" + std::to_string(::getpid()));
  fs::remove_all(folder);
  SynthOptions options;
  options.frames = 30;
  options.fps = 100.0;
  options.width = 160;
  options.height = 120;
  options.sensor = Sensor::kIdeal;
  options.walkers = 1;
  options.reference_spacing = 0.1;
  options.events = "cover@0.1+0.05,blur@0.12+0.1*5";
  options.moving_masks = true;
  const core::Executor executor(2);
  const auto log = core::null_log();
  const auto scene = parse_scene(kTruthCell, "test.yaml");
  ASSERT_TRUE(scene) << scene.error().message;
  const auto written = write_recordings({*scene, options, folder}, executor, {}, *log, {});
  ASSERT_TRUE(written) << written.error().message;

  const auto rows = table_of(folder / "robot0" / "truth.csv");
  ASSERT_EQ(rows.size(), 30U);
  const auto number = [&](std::size_t i, const char* key) { return std::stod(rows[i].at(key)); };
  for (std::size_t i = 1; i + 1 < rows.size(); ++i) {
    const double dt = number(i + 1, "stamp") - number(i - 1, "stamp");
    for (const auto& [p, v] : {std::pair("x", "vx"), std::pair("y", "vy"), std::pair("z", "vz")})
      EXPECT_NEAR((number(i + 1, p) - number(i - 1, p)) / dt, number(i, v), 2e-3) << i << p;
    // The turn between the rows is the turn rate's, in the frame of the camera.
    const auto turn = [&](std::size_t k) {
      return Eigen::Quaterniond(number(k, "qw"), number(k, "qx"), number(k, "qy"), number(k, "qz"));
    };
    const Eigen::AngleAxisd between(turn(i - 1).conjugate() * turn(i + 1));
    const Eigen::Vector3d rate(number(i, "wx"), number(i, "wy"), number(i, "wz"));
    EXPECT_LT((between.angle() * between.axis() / dt - rate).norm(), 2e-3);

    const cv::Mat mask = *dataset::read_image(folder / "robot0" / "moving" / (rows[i].at("stamp") + ".png"));
    EXPECT_NEAR(cv::countNonZero(mask) / 19200.0, number(i, "moving"), 1e-5);
    EXPECT_GT(number(i, "moving"), 0.02);
    EXPECT_LT(number(i, "moving"), 0.3);
  }

  EXPECT_EQ(rows[5].at("events"), "");
  EXPECT_EQ(rows[11].at("events"), "cover");
  EXPECT_EQ(rows[13].at("events"), "cover blur");
  EXPECT_EQ(rows[13].at("covered"), "1");
  EXPECT_EQ(rows[20].at("covered"), "0");
  const auto events = table_of(folder / "robot0" / "events.csv");
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[1].at("kind"), "blur");
  EXPECT_NEAR(std::stod(events[1].at("to_stamp")) - std::stod(rows[0].at("stamp")), 0.22, 1e-6);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace plumbline::synth
