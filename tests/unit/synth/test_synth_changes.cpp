// SPDX-License-Identifier: BSD-3-Clause
// The same world another day: what changes.json says is what is different, and nothing else is.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

const std::string kScenesAsShipped = std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes";

SynthOptions another_day(int layout, const std::string& changes) {
  SynthOptions options;
  options.layout = layout;
  options.changes = changes;
  return options;
}

std::string edits(const std::string& text) {
  const auto file = std::filesystem::path(testing::TempDir()) / "edits.yaml";
  std::ofstream(file) << text;
  return file.string();
}

/// Bounds of the objects by name.
std::map<std::string, Eigen::AlignedBox3d> boxes(const Scene& scene) {
  std::map<std::string, Eigen::AlignedBox3d> out;
  for (const Face& face : scene.faces) {
    for (const Eigen::Vector2d& uv : face.polygon)
      out[scene.objects[static_cast<std::size_t>(face.object)].name].extend(face.at(uv.x(), uv.y()));
  }
  return out;
}

/// Whatever is not listed as changed is where it was; what is listed, is where the list says.
void check_truth(const Scene& before, const Scene& after, double shift = 0.005) {
  const auto was = boxes(before), is = boxes(after);
  std::set<std::string> listed;
  bool wall = false;
  for (const SceneChange& c : after.changes) {
    listed.insert(c.thing);
    listed.insert(c.with.begin(), c.with.end());
    wall = wall || c.kind == "wall";
    if (c.kind == "moved" || c.kind == "removed") {
      EXPECT_TRUE(was.at(c.thing).isApprox(c.before)) << c.thing;
    }
    if (c.kind == "removed") {
      EXPECT_EQ(is.count(c.thing), 0U) << c.thing;
    }
    if (c.kind == "moved" || c.kind == "added") {
      EXPECT_TRUE(is.at(c.thing).isApprox(c.after)) << c.thing;
    }
  }

  for (const auto& [name, box] : was) {
    if (listed.count(name) != 0) continue;
    ASSERT_EQ(is.count(name), 1U) << name;
    // Surfaces that end at a moved wall become longer or shorter, and doors belong to openings.
    const std::string type =
        before
            .objects[static_cast<std::size_t>(std::find_if(before.objects.begin(), before.objects.end(),
                                                           [&](const Object& o) { return o.name == name; }) -
                                              before.objects.begin())]
            .type;
    if (type == "opening" || type == "wall") continue;
    const double most = wall ? 1.001 * shift : 1e-9;
    EXPECT_LT((is.at(name).min() - box.min()).norm(), most) << name;
    EXPECT_LT((is.at(name).max() - box.max()).norm(), most) << name;
  }
}

TEST(SynthChanges, ASeedChangesLayoutsAsTheTruthSays) {
  for (const char* kind : {"home", "office", "corridor"}) {
    for (const char* seed : {"1"}) {
      const auto before = make_layout(kind, another_day(5, "")),
                 after = make_layout(kind, another_day(5, seed));
      ASSERT_TRUE(before);
      ASSERT_TRUE(after) << after.error().message;
      EXPECT_GE(after->changes.size(), 4U);
      check_truth(*before, *after);
      for (const SceneChange& c : after->changes) {
        if (c.kind == "moved" && c.turn_rad == 0.0) {
          EXPECT_GE(c.offset.norm(), 0.1 - 1e-12);
        }
      }
      const auto free = check_paths(*after, {});
      EXPECT_TRUE(free) << free.error().message;
      for (std::size_t r = 0; r < after->plan->rooms.size(); ++r) {
        const PlanRoom& room = after->plan->rooms[r];
        for (std::size_t i = 0; i < room.faces.size(); ++i)
          EXPECT_EQ(room.faces[i].to, room.faces[(i + 1) % room.faces.size()].from);
        double area = 0.0;
        for (const Face& face : after->faces) {
          if (after->objects[static_cast<std::size_t>(face.object)].name ==
              "floor of " + room.kind + " " + std::to_string(r))
            area += signed_area(face.polygon);
        }
        EXPECT_NEAR(area, room.area(), 1e-9) << kind << " " << seed << " room " << r;
      }
    }
  }
}

TEST(SynthChanges, LeavesAndTheLiftKeepTheirFacesWhenThingsGo) {
  SynthOptions options = another_day(3, "");
  options.lift = true;
  const auto before = make_layout("building", options);
  options.changes = "3";
  const auto after = make_layout("building", options);
  ASSERT_TRUE(before && after);
  EXPECT_NE(after->faces.size(), before->faces.size());
  EXPECT_FALSE(after->leaves.empty());
  ASSERT_EQ(after->leaves.size(), before->leaves.size());

  // Each leaf has as many faces as before, of the same objects.
  const auto object_of = [](const Scene& scene, std::size_t face) {
    return scene.objects[static_cast<std::size_t>(scene.faces[face].object)].name;
  };
  for (std::size_t k = 0; k < after->leaves.size(); ++k) {
    const DoorLeaf &was = before->leaves[k], &is = after->leaves[k];
    ASSERT_EQ(is.count, was.count) << k;
    for (std::size_t i = 0; i < is.count; ++i)
      EXPECT_EQ(object_of(*after, is.first + i), object_of(*before, was.first + i)) << k;
  }
}

TEST(SynthChanges, ASeedChangesShippedScenesAndLeavesTheirPathsFree) {
  for (const char* name : {"room", "office", "corridor", "structure"}) {
    const auto before = open_scene(name, {}, kScenesAsShipped);
    for (int seed = 0; seed < 6; ++seed) {
      const auto after = open_scene(name, another_day(-1, std::to_string(seed)), kScenesAsShipped);
      ASSERT_TRUE(before && after);
      check_truth(*before, *after);
      SynthOptions all;
      all.robots = static_cast<int>(after->robots.size());
      const auto free = check_paths(*after, all);
      EXPECT_TRUE(free) << seed << ": " << free.error().message;
    }
  }
}

TEST(SynthChanges, EditsOfAFileAreDoneAsTheySay) {
  const auto before = make_layout("home", another_day(5, ""));
  ASSERT_TRUE(before);
  const PlanThing& thing = before->plan->things.front();
  int door = 0, wall = 4;  // the first inner one that is square to all others
  while (before->plan->openings[static_cast<std::size_t>(door)].leaf != Leaf::kOpen) ++door;

  const auto change = [&] {
    return make_layout("home", another_day(5, edits("- {move: " + thing.name +
                                                    ", by: [0.02, 0.01], turn: 2 deg}\n"
                                                    "- {remove: " +
                                                    before->plan->things[1].name +
                                                    "}\n"
                                                    "- {door: " +
                                                    std::to_string(door) +
                                                    ", open: 60 deg}\n"
                                                    "- {wall: " +
                                                    std::to_string(wall) +
                                                    ", shift: -12 mm}\n"
                                                    "- {light: 0.5}\n")));
  };
  auto after = change();
  while (!after && after.error().message.find("is not square to") != std::string::npos && ++wall < 30)
    after = change();
  ASSERT_TRUE(after) << after.error().message;
  ASSERT_EQ(after->changes.size(), 5U);
  check_truth(*before, *after, 0.012);
  EXPECT_EQ(after->plan->things.size(), before->plan->things.size() - 1);
  EXPECT_NEAR(after->plan->openings[static_cast<std::size_t>(door)].open_rad, M_PI / 3.0, 1e-9);
  EXPECT_NEAR(after->lamps.front().power, 0.5 * before->lamps.front().power, 1e-9);
  const auto place = static_cast<std::size_t>(wall);
  EXPECT_NEAR((after->plan->walls[place].origin - before->plan->walls[place].origin).norm(), 0.012, 1e-12);

  const auto none = make_layout("home", another_day(5, edits("- {move: dek 14, by: [0.2, 0]}\n")));
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("there is no 'dek 14'"), std::string::npos) << none.error().message;
}

}  // namespace
}  // namespace plumbline::synth
