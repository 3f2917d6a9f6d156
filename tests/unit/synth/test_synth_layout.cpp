// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <set>

#include "plumbline/core/log.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/recording.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

using Eigen::Vector2d;

core::Result<Scene> make(const std::string& kind, int number, int robots, Route path = Route::kScene) {
  SynthOptions options;
  options.layout = number;
  options.robots = robots;
  options.path = path;
  options.floors = 2;
  options.rooms = 6;
  return make_layout(kind, options);
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

bool cross_each_other(const PlanFace& f, const PlanFace& g) {
  const auto side = [](const PlanFace& face, const Vector2d& p) {
    return cross(face.to - face.from, p - face.from) > 0.0;
  };
  return side(f, g.from) != side(f, g.to) && side(g, f.from) != side(g, f.to);
}

/// Area of the faces of one object of a type that belong to room `index`, by the name that its floor has.
double floor_area(const Scene& scene, std::size_t index) {
  double area = 0.0;
  std::size_t number = index;  // within its storey
  while (number > 0 && scene.plan->rooms[index - number].storey != scene.plan->rooms[index].storey) --number;
  const std::string name = "floor of " + scene.plan->rooms[index].kind + " " + std::to_string(number);
  const double floor = scene.plan->storeys[static_cast<std::size_t>(scene.plan->rooms[index].storey)];
  for (const Face& face : scene.faces) {
    if (scene.objects[static_cast<std::size_t>(face.object)].name == name &&
        std::abs(face.origin.z() - floor) < 1e-9)
      area += signed_area(face.polygon);
  }
  return area;
}

/// Rooms are closed, simple and of sensible size; their areas are those of their floors.
void check_rooms(const Scene& scene) {
  ASSERT_GE(scene.plan->rooms.size(), 2U) << scene.name;
  for (std::size_t r = 0; r < scene.plan->rooms.size(); ++r) {
    const PlanRoom& room = scene.plan->rooms[r];
    const std::size_t n = room.faces.size();
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_EQ(room.faces[i].to, room.faces[(i + 1) % n].from) << scene.name;
      for (std::size_t k = i + 2; k < n - (i == 0 ? 1 : 0); ++k)
        EXPECT_FALSE(cross_each_other(room.faces[i], room.faces[k])) << scene.name << " room " << r;
      const PlanWall& wall = scene.plan->walls[static_cast<std::size_t>(room.faces[i].wall)];
      EXPECT_NEAR(std::abs(cross(wall.direction, room.faces[i].from - wall.origin)), 0.5 * wall.thickness,
                  1e-9);
    }

    const bool stairs = room.kind == "stairs";
    if (!stairs) {
      EXPECT_NEAR(room.area(), floor_area(scene, r), 1e-9) << scene.name << " room " << r;
    }
    if (stairs || room.kind == "corridor" || room.kind == "hall") continue;
    EXPECT_GE(room.area(), 4.0) << scene.name << " room " << r;
    EXPECT_LE(room.area(), 60.0) << scene.name << " room " << r;
  }
}

/// Openings lie in the faces of their walls, apart from each other.
void check_openings(const Scene& scene) {
  const auto has_face = [](const PlanRoom& room, const PlanWall& wall, const PlanOpening& o) {
    return std::any_of(room.faces.begin(), room.faces.end(), [&](const PlanFace& f) {
      const auto [from, to] = std::minmax({wall.along(f.from), wall.along(f.to)});
      return std::abs(cross(wall.direction, f.from - wall.origin)) < 0.51 * wall.thickness &&
             from < o.from - 0.1 && to > o.to + 0.1;
    });
  };

  const Plan& plan = *scene.plan;
  for (const PlanOpening& o : plan.openings) {
    const PlanWall& wall = plan.walls[static_cast<std::size_t>(o.wall)];
    const PlanRoom& front = plan.rooms[static_cast<std::size_t>(o.front)];
    EXPECT_TRUE(has_face(front, wall, o)) << scene.name;
    EXPECT_LE(o.head, front.height);
    EXPECT_LT(o.sill + 0.3, o.head);
    EXPECT_LE(o.depth, wall.thickness);
    if (o.kind == OpeningKind::kDoor) {
      EXPECT_GE(o.width(), 0.7 - 1e-9);
      EXPECT_LE(o.width(), 1.8);
    }
    if (o.back >= 0) {
      EXPECT_TRUE(has_face(plan.rooms[static_cast<std::size_t>(o.back)], wall, o)) << scene.name;
      EXPECT_LE(o.head, plan.rooms[static_cast<std::size_t>(o.back)].height);
    }
    for (const PlanOpening& other : plan.openings) {
      if (&other == &o || other.wall != o.wall) continue;
      EXPECT_TRUE(other.to < o.from || other.from > o.to) << scene.name;
    }
  }
}

/// Rooms are connected by passable openings, and the camera visits all of them without touching anything.
void check_ways(const Scene& scene) {
  const Plan& plan = *scene.plan;
  std::vector<char> reached(plan.rooms.size(), 0);
  reached[0] = 1;
  for (std::size_t round = 0; round < plan.rooms.size(); ++round) {
    for (const PlanOpening& o : plan.openings) {
      if (!o.passable()) continue;
      char &a = reached[static_cast<std::size_t>(o.front)], &b = reached[static_cast<std::size_t>(o.back)];
      a = b = static_cast<char>(a | b);
    }
    bool climbed = false;
    for (std::size_t r = 0; r < plan.rooms.size(); ++r)
      climbed = climbed || (plan.rooms[r].kind == "stairs" && reached[r] != 0);
    for (std::size_t r = 0; r < plan.rooms.size(); ++r) {
      if (plan.rooms[r].kind == "stairs" && climbed) reached[r] = 1;
    }
  }
  EXPECT_EQ(std::count(reached.begin(), reached.end(), 1), static_cast<long>(reached.size())) << scene.name;

  for (const PlanRoom& room : plan.rooms) {
    const auto& waypoints = scene.robots[0].waypoints;
    EXPECT_TRUE(std::any_of(waypoints.begin(), waypoints.end(),
                            [&](const Waypoint& w) {
                              const double up =
                                  w.position.z() - plan.storeys[static_cast<std::size_t>(room.storey)];
                              return up > 1.0 && up < 2.0 && room.contains(w.position.head<2>());
                            }))
        << scene.name << ": " << room.kind;
  }
  const auto free = check_paths(scene, {});
  EXPECT_TRUE(free) << free.error().message;
}

/// Things stand in their rooms and not in each other.
void check_things(const Scene& scene) {
  for (const PlanThing& thing : scene.plan->things) {
    EXPECT_GT(signed_area(thing.outline), 0.0);
    for (const Vector2d& p : thing.outline)
      EXPECT_TRUE(scene.plan->rooms[static_cast<std::size_t>(thing.room)].contains(p)) << scene.name;
    for (const PlanThing& other : scene.plan->things) {
      const auto storey = [&](const PlanThing& t) {
        return scene.plan->rooms[static_cast<std::size_t>(t.room)].storey;
      };
      if (storey(other) != storey(thing)) continue;
      Vector2d middle = Vector2d::Zero();
      for (const Vector2d& p : other.outline) middle += 0.25 * p;
      PlanRoom inside;
      for (std::size_t i = 0; i < 4; ++i)
        inside.faces.push_back({thing.outline[i], thing.outline[(i + 1) % 4], 0});
      EXPECT_EQ(inside.contains(middle), &thing == &other) << scene.name << ": " << thing.type;
    }
  }
}

class SynthLayout : public testing::TestWithParam<const char*> {};

// PLUMBLINE_LAYOUTS=FIRST-END checks other numbers.
TEST_P(SynthLayout, EveryNumberIsAWorldThatCanBeWalkedThrough) {
  int first = 0, end = 40;
  if (const char* asked = std::getenv("PLUMBLINE_LAYOUTS")) {
    ASSERT_EQ(std::sscanf(asked, "%d-%d", &first, &end), 2);
  }
  for (int number = first; number < end; ++number) {
    const auto scene = make(GetParam(), number, 1);
    ASSERT_TRUE(scene) << scene.error().message;
    check_rooms(*scene);
    check_openings(*scene);
    check_ways(*scene);
    check_things(*scene);
  }
}

TEST_P(SynthLayout, TheSameNumberIsTheSameWorldAndAnotherIsAnother) {
  const auto first = make(GetParam(), 3, 1), again = make(GetParam(), 3, 2);
  const auto other = make(GetParam(), 4, 1);
  ASSERT_TRUE(first && again && other);
  const Scene& scene = *first;
  ASSERT_EQ(again->faces.size(), scene.faces.size());
  for (std::size_t i = 0; i < scene.faces.size(); ++i)
    EXPECT_EQ(again->faces[i].origin, scene.faces[i].origin);
  ASSERT_EQ(again->robots.size(), 2U);
  ASSERT_EQ(again->robots[0].waypoints.size(), scene.robots[0].waypoints.size());
  EXPECT_EQ(again->robots[0].waypoints.back().position, scene.robots[0].waypoints.back().position);
  EXPECT_NE(again->robots[1].waypoints[1].position, scene.robots[0].waypoints[1].position);
  EXPECT_NE(other->faces.size(), scene.faces.size());
}

TEST_P(SynthLayout, EveryPathIsFreeAndOfItsKind) {
  const auto length = [](const RobotPath& path) {
    double sum = 0.0;
    for (std::size_t i = 1; i < path.waypoints.size(); ++i)
      sum += (path.waypoints[i].position - path.waypoints[i - 1].position).norm();
    return sum;
  };

  for (int number = 0; number < 3; ++number) {
    std::map<Route, double> lengths;
    for (const Route route : {Route::kTour, Route::kLaps, Route::kWander, Route::kThereAndBack}) {
      const auto scene = make(GetParam(), number, 3, route);
      ASSERT_TRUE(scene) << scene.error().message;
      ASSERT_EQ(scene->robots.size(), 3U);
      SynthOptions three;
      three.robots = 3;
      const auto free = check_paths(*scene, three);
      EXPECT_TRUE(free) << to_string(route) << ": " << free.error().message;
      lengths[route] = length(scene->robots[0]);
    }
    EXPECT_LT(lengths[Route::kLaps], lengths[Route::kTour]) << number;
    EXPECT_LT(lengths[Route::kThereAndBack], lengths[Route::kTour]) << number;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, SynthLayout, testing::Values("home", "office", "corridor", "building"));

TEST(SynthLayoutNumbers, WorldsDiffer) {
  int tilted = 0, walls = 0, many_corners = 0;
  for (int number = 0; number < 40; ++number) {
    const auto scene = make("home", number, 1);
    ASSERT_TRUE(scene);
    for (const PlanWall& wall : scene->plan->walls) {
      tilted += std::min(std::abs(wall.direction.x()), std::abs(wall.direction.y())) > 0.01 ? 1 : 0;
      ++walls;
    }
    for (const PlanRoom& room : scene->plan->rooms) many_corners += room.faces.size() > 4 ? 1 : 0;
  }
  EXPECT_GT(tilted, 0);
  EXPECT_LT(tilted, walls / 5);
  EXPECT_GT(many_corners, 5);
}

TEST(SynthLayoutNumbers, PlanFileHasTheTruth) {
  struct Silent : core::Log {
    void write(core::LogLevel, const std::string&) override {}
  } log;
  const auto scene = make("home", 1, 2);
  ASSERT_TRUE(scene);
  SynthOptions options;
  options.layout = 1;
  options.robots = 2;
  options.frames = 1;
  options.width = 64;
  options.height = 48;
  options.reference_spacing = 0.1;
  const auto folder = std::filesystem::path(testing::TempDir()) / "synth_plan";
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(write_recordings({*scene, options, folder}, core::Executor(1), {}, log, {}));

  const auto plan = nlohmann::json::parse(std::ifstream(folder / "plan.json"));
  ASSERT_EQ(plan["rooms"].size(), scene->plan->rooms.size());
  double most_seen = 0.0, least_seen = 1.0;
  for (const auto& room : plan["rooms"]) {
    std::vector<Vector2d> outline;
    for (const auto& p : room["outline_m"]) outline.emplace_back(p[0], p[1]);
    EXPECT_NEAR(signed_area(outline), room["area_m2"], 1e-9);
    EXPECT_EQ(room["faces"].size(), outline.size());
    for (const auto& face : room["faces"]) {
      most_seen = std::max(most_seen, double(face["seen"]));
      least_seen = std::min(least_seen, double(face["seen"]));
    }
  }

  // One frame of each robot sees part of a wall or two.
  EXPECT_GT(most_seen, 0.02);
  EXPECT_EQ(least_seen, 0.0);
  EXPECT_GT(plan["seen"], 0.0);
  EXPECT_LT(plan["seen"], 0.2);

  for (const auto& o : plan["openings"]) {
    EXPECT_LE(o["jambs_seen"], 1.0);
    const auto& jambs = o["jambs_m"];
    EXPECT_NEAR(
        std::hypot(double(jambs[1][0]) - double(jambs[0][0]), double(jambs[1][1]) - double(jambs[0][1])),
        o["width_m"], 1e-9);
    EXPECT_EQ(o.contains("leaf"), o["kind"] == "door");
  }

  ASSERT_EQ(plan["robots"].size(), 2U);
  const auto truth = dataset::read_trajectory(folder / "robot1/groundtruth.txt");
  ASSERT_TRUE(truth);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(plan["robots"][1]["world_from_first_camera"][i][3],
                truth->front().world_from_camera.translation[i], 0.01);
  }
}

/// Things of like rooms by type and place in the room; with posters, the seeds of their prints.
std::multiset<std::string> contents(const Scene& scene, int room, bool prints) {
  const PlanRoom& r = scene.plan->rooms[static_cast<std::size_t>(room)];
  std::multiset<std::string> out;
  for (const Face& face : scene.faces) {
    const std::string& type = scene.objects[static_cast<std::size_t>(face.object)].type;
    const Eigen::AlignedBox2d b = face.bounds();
    const Eigen::Vector3d p = face.at(b.center().x(), b.center().y()) + 0.001 * face.normal;
    const double up = p.z() - scene.plan->storeys[static_cast<std::size_t>(r.storey)];
    if (!r.contains(p.head<2>()) || up < -0.01 || up > r.height || (prints && face.stretch_u == 0.0))
      continue;
    const Vector2d d = p.head<2>() - r.faces[0].from;
    char text[120];
    std::snprintf(text, sizeof text, "%s %.3f %.3f %.3f %d", type.c_str(), d.x() + 1e-6, d.y() + 1e-6,
                  up + 1e-6, prints ? face.seed : 0);
    out.insert(text);
  }
  return out;
}

TEST(SynthLayoutNumbers, LikeRoomsDifferInPostersOnlyAndCopiesInNothing) {
  for (const char* kind : {"office", "building"}) {
    for (const bool copies : {false, true}) {
      SynthOptions options;
      options.layout = 2;
      options.floors = 2;
      (copies ? options.copies : options.like) = 4;
      const auto scene = make_layout(kind, options);
      ASSERT_TRUE(scene) << scene.error().message;
      check_rooms(*scene);
      check_openings(*scene);
      check_ways(*scene);
      check_things(*scene);
      const std::vector<int>& alike = scene->plan->alike;
      ASSERT_EQ(alike.size(), kind == std::string("office") ? 4U : 8U);
      const auto first = contents(*scene, alike[0], false), prints = contents(*scene, alike[0], true);
      EXPECT_GT(first.size(), 30U);
      for (int i = 1; i < 4; ++i) {
        EXPECT_EQ(contents(*scene, alike[static_cast<std::size_t>(i)], false), first) << kind;
        EXPECT_EQ(contents(*scene, alike[static_cast<std::size_t>(i)], true) == prints, copies) << kind;
      }
    }
  }
}

TEST(SynthLayoutNumbers, HallsOf20MetresCanBeWalked) {
  for (const char* kind : {"office", "building"}) {
    for (int number = 0; number < 8; ++number) {
      SynthOptions options;
      options.layout = number;
      options.floors = 2;
      options.hall = true;
      const auto scene = make_layout(kind, options);
      ASSERT_TRUE(scene) << scene.error().message;
      check_rooms(*scene);
      check_openings(*scene);
      check_ways(*scene);
      const auto& rooms = scene->plan->rooms;
      EXPECT_TRUE(std::any_of(rooms.begin(), rooms.end(), [](const PlanRoom& room) {
        Eigen::AlignedBox2d box;
        for (const Vector2d& p : room.outline()) box.extend(p);
        return room.kind == "hall" && box.sizes().maxCoeff() >= 20.0;
      })) << scene->name;
    }
  }
}

TEST(SynthLayoutNumbers, SceneWithoutLayoutsIsRefused) {
  SynthOptions options;
  options.layout = 3;
  const auto none = open_scene("room", options, std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("home, office, corridor, building"), std::string::npos)
      << none.error().message;
  SynthOptions laps;
  laps.path = Route::kLaps;
  EXPECT_FALSE(open_scene("room", laps, std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes"));
  const auto home = open_scene("home", {}, std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes");
  ASSERT_FALSE(home);
  EXPECT_NE(home.error().message.find("--layout"), std::string::npos) << home.error().message;
}

TEST(SynthLayoutNumbers, FramesAreTheSameForAnyNumberOfThreads) {
  struct Silent : core::Log {
    void write(core::LogLevel, const std::string&) override {}
  } log;
  std::vector<cv::Mat> pictures;
  for (const int threads : {1, 2}) {
    const auto source =
        open_synth("synth:home?layout=1&frames=3&width=160&height=120", "", core::Executor(threads), log);
    ASSERT_TRUE(source) << source.error().message;
    const auto frame = (*source)->read(2);
    ASSERT_TRUE(frame);
    pictures.push_back(frame->color);
    pictures.push_back(frame->depth);
    EXPECT_GT(cv::countNonZero(frame->depth > 0.3F), 160 * 120 / 3);
  }
  EXPECT_EQ(cv::norm(pictures[0], pictures[2], cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(pictures[1], pictures[3], cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace plumbline::synth
