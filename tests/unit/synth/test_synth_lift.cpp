// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <optional>

#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

SynthOptions lift_options() {
  SynthOptions options;
  options.layout = 3;
  options.fps = 10.0;
  options.width = 160;
  options.height = 120;
  options.floors = 2;
  options.rooms = 4;
  options.lift = true;
  return options;
}

TEST(SynthLift, CarriesTheCameraFromStoreyToStorey) {
  const SynthOptions options = lift_options();
  Scene scene = *make_layout("building", options);
  choose_moving_doors(options, scene);
  std::map<std::string, const MovingDoor*> parts;
  for (const MovingDoor& part : scene.moving_doors) parts[part.drawer] = &part;
  ASSERT_EQ(parts.size(), 5U);

  const core::Executor executor(1);
  const auto world = build_world(*make_layout("building", options), options, executor);
  ASSERT_TRUE(world) << world.error().message;
  const auto source = SynthSource::create(*world, 0);
  ASSERT_TRUE(source) << source.error().message;

  // The cab rises with the camera, and nobody walks through a door that is not open.
  const MovingDoor& cab = *parts.at("lift");
  const auto leaf = [&](int storey) {
    return *parts.at(fmt::format("left leaf of the lift's door {}", storey));
  };
  const Face& panel = scene.faces[scene.leaves[leaf(0).leaf].first];
  const double pitch = cab.slide.z(), door_y = panel.origin.y(), door_x = panel.origin.x();
  std::optional<std::size_t> riding;
  double lowest = 1e9, highest = -1e9;
  int rides = 0, through = 0;
  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const double t = 0.1 * static_cast<double>(i);
    const Eigen::Vector3d eye = (*source)->world_from_camera((*source)->start() + t).translation;
    const double floor = cab.angle(t) * pitch;
    if (cab.angle(t) > 0.02 && cab.angle(t) < 0.98) {
      ++rides;
      riding = i;
      lowest = std::min(lowest, eye.z() - floor);
      highest = std::max(highest, eye.z() - floor);
    }
    if (std::abs(eye.y() - door_y) > 0.25 || std::abs(eye.x() - door_x) > 1.2 ||
        std::abs(eye.z() - floor - 1.5) > 0.4)
      continue;
    ++through;
    EXPECT_GT(leaf(floor > 1.0 ? 1 : 0).angle(t), 0.98) << t;
  }
  EXPECT_GT(rides, 60);
  EXPECT_GT(through, 10);
  EXPECT_GT(lowest, 1.2);
  EXPECT_LT(highest - lowest, 0.12);

  // Up and down again; the doors move as well. Inside, most of what is seen moves.
  const auto moves = (*source)->swings();
  EXPECT_EQ(std::count_if(moves.begin(), moves.end(), [](const DoorSwing& s) { return s.drawer == "lift"; }),
            2);
  EXPECT_GE(moves.size(), 2U + 8U);
  ASSERT_TRUE(riding);
  EXPECT_GT(cv::mean((*source)->moving(*riding))[0], 0.4 * 255.0);
}

TEST(SynthLift, IsRefusedWhereNoneCanBe) {
  SynthOptions options = lift_options();
  options.robots = 2;
  EXPECT_FALSE(make_layout("building", options));
  options.robots = 1;
  EXPECT_FALSE(make_layout("office", options));
  options.floors = 1;
  EXPECT_FALSE(make_layout("building", options));
}

}  // namespace
}  // namespace plumbline::synth
