// SPDX-License-Identifier: BSD-3-Clause
// A lift in place of a building's stairs. Its cab has no door, so that a rider sees the shaft pass by.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "layout/layout.hpp"
#include "render/path.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kFront = 0.15;  // m, thickness of the wall between lobby and shaft
constexpr double kHalf = 0.5;    // m, half the width of its door, and how far each of its leaves slides
constexpr double kHead = 2.1;    // m, height of its door
constexpr double kCab = 1.8;     // m, the cab's width and depth
constexpr double kCabHeight = 2.3;
constexpr double kStep = MovingDoor::kShareStep;
constexpr double kSlides = 1.2;   // s that a leaf slides
constexpr double kAhead = 1.5;    // s before the cab leaves its door begins to shut
constexpr double kWelcome = 2.2;  // m from the door at which it opens
constexpr double kSame = 0.01;    // m, of two heights that are one

/// Openness of each leaf of a storey's door at each step, 0 (shut) to 1.
std::vector<double> open_shares(const std::vector<char>& wanted) {
  std::vector<double> shares;
  double open = wanted.front();
  for (const char want : wanted) {
    open = std::clamp(open + (want != 0 ? 1.0 : -1.0) * kStep / kSlides, 0.0, 1.0);
    shares.push_back(open);
  }
  return shares;
}

}  // namespace

double LiftShaft::back() const { return door - kFront - 0.02 - kCab; }

void build_lift_storey(const LiftShaft& shaft, int index, bool lowest, bool highest, double height,
                       Builder& b) {
  const core::ConfigMark mark = b.scene().objects.front().mark;
  const auto solid = [&](const Vector3d& lo, const Vector3d& hi, const char* material) {
    b.box({}, lo, hi, {material});
  };
  const double m = shaft.middle(), y = shaft.door - kFront, top = highest ? height : height - kSlab;
  const Vector2d low = shaft.box.min(), high = shaft.box.max();

  // The shaft stays open above the lowest floor.
  b.begin_object("floor", fmt::format("floor of lift {}", index), mark);
  solid({low.x(), lowest ? low.y() : y, -kSlab}, {high.x(), high.y(), 0.0}, "tiles");

  // The front, with an opening for the door.
  b.begin_object("wall", fmt::format("front of lift {}", index), mark);
  solid({low.x(), y, 0.0}, {m - kHalf, shaft.door, top}, "paint_blue");
  solid({m + kHalf, y, 0.0}, {high.x(), shaft.door, top}, "paint_blue");
  solid({m - kHalf, y, kHead}, {m + kHalf, shaft.door, top}, "paint_blue");

  // A sign and a lamp in the lobby.
  b.begin_object("sign", fmt::format("sign of lift {}", index), mark);
  add_panel(b, upright({m + kHalf + 0.45, shaft.door, 1.5}, M_PI), {0.5, 0.7, 0.02, "sign", "metal", false});
  b.begin_object("lamp", "", mark);
  add_ceiling_lamp(b, upright({m, 0.5 * (shaft.door + high.y()), top}, 0.0), 0.5, 0.5, 9.0);

  // The shaft ends at the top.
  if (!highest) return;
  b.begin_object("ceiling", fmt::format("ceiling of lift {}", index), mark);
  b.polygon({{low.x(), high.y(), top},
             {high.x(), high.y(), top},
             {high.x(), low.y(), top},
             {low.x(), low.y(), top}},
            Vector3d::UnitX(), {"ceiling"});
}

void add_lift(const LiftShaft& shaft, const std::vector<double>& storeys, Scene& scene) {
  Builder b(scene);
  const core::ConfigMark mark = scene.objects.front().mark;
  const double m = shaft.middle(), y = shaft.door - kFront;
  const auto moves = [&](const std::string& name, std::size_t first, const Vector3d& slide) {
    MovingDoor part;
    part.leaf = scene.leaves.size();
    part.opening = -1;
    part.drawer = name;
    part.slide = slide;
    scene.leaves.push_back({first, scene.faces.size() - first, Vector3d::Zero(), 0.0});
    scene.moving_doors.push_back(std::move(part));
  };

  // The cab stands on the lowest storey; a picture hangs at its back.
  const double back = shaft.back(), left = m - 0.5 * kCab, right = m + 0.5 * kCab, wall = 0.03;
  std::size_t first = scene.faces.size();
  b.begin_object("lift", "lift", mark);
  b.box({}, {left, back, 0.0}, {right, y - 0.02, 0.02}, {"lino"});
  b.box({}, {left, back, kCabHeight}, {right, y - 0.02, kCabHeight + wall}, {"paint_white"});
  b.box({}, {left - wall, back, 0.0}, {left, y - 0.02, kCabHeight}, {"wood"});
  b.box({}, {right, back, 0.0}, {right + wall, y - 0.02, kCabHeight}, {"wood"});
  b.box({}, {left, back - wall, 0.0}, {right, back, kCabHeight}, {"metal"});
  add_panel(b, upright({m, back, 1.5}, M_PI), {0.7, 0.9, 0.02, "poster", "wood_dark", false});
  moves("lift", first, {0.0, 0.0, storeys.back()});

  // Two leaves on every storey, built shut.
  for (std::size_t k = 0; k < storeys.size(); ++k) {
    for (const double side : {-1.0, 1.0}) {
      first = scene.faces.size();
      b.begin_object("lift", fmt::format("{} leaf of the lift's door {}", side < 0.0 ? "left" : "right", k),
                     mark);
      b.box({}, {side < 0.0 ? m - kHalf - 0.02 : m, y + 0.05, storeys[k] + 0.005},
            {side < 0.0 ? m : m + kHalf + 0.02, y + 0.09, storeys[k] + kHead + 0.02}, {"metal"});
      moves(scene.objects.back().name, first, {side * kHalf, 0.0, 0.0});
      scene.moving_doors.back().lit = 0.0;  // open, it is inside the wall
    }
  }
}

std::vector<Vector3d> lift_ride(const LiftShaft& shaft, double from, double to) {
  const double m = shaft.middle(), front = shaft.door - kFront, middle = 0.5 * (front + shaft.back());
  std::vector<Vector3d> out = {{m, shaft.door + 0.6, from}, {m, front - 0.3, from}, {m - 0.25, middle, from}};

  // Small sideways motion during the ride.
  constexpr int kPieces = 6;
  for (int i = 0; i <= kPieces; ++i) {
    const double s = static_cast<double>(i) / kPieces;
    out.emplace_back(m - 0.25 + 0.4 * s, middle - 0.25, from + s * (to - from));
  }
  out.insert(out.end(), {{m + 0.05, middle, to}, {m, front - 0.3, to}, {m, shaft.door + 0.6, to}});
  return out;
}

void run_lift(const SynthOptions& options, const CameraPath& path, Scene& scene) {
  const std::vector<double>& storeys = scene.plan->storeys;
  const auto cab = std::find_if(scene.moving_doors.begin(), scene.moving_doors.end(),
                                [](const MovingDoor& d) { return d.drawer == "lift"; });
  Eigen::AlignedBox3d box;
  const DoorLeaf& faces = scene.leaves[cab->leaf];
  for (std::size_t i = faces.first; i < faces.first + faces.count; ++i) {
    for (const Vector2d& uv : scene.faces[i].polygon) box.extend(scene.faces[i].at(uv.x(), uv.y()));
  }

  // The camera starts on a storey; the cab waits where the camera left it, and rises with it.
  const bool once = options.frames < 0 || options.repeat > 1;
  const double end = once ? path.duration() : options.frames / options.fps;
  const auto start = std::prev(std::upper_bound(storeys.begin(), storeys.end(), path.height(0.0)));
  const double eye = path.height(0.0) - *start;
  std::vector<double> floors;
  std::vector<char> inside, welcome;

  cab->shares.push_back(*start / storeys.back());
  for (int i = 0; i * kStep < end + 1.0; ++i) {
    const Vector2d at = path.world_from_camera(i * kStep).translation.head<2>();
    floors.push_back(1e-6 * std::round(1e6 * (path.height(i * kStep) - eye)));  // at rest it is the same
    inside.push_back(box.min().x() < at.x() && at.x() < box.max().x() && at.y() < box.max().y() &&
                     at.y() > box.min().y());

    // The cab follows the camera inside.
    welcome.push_back((at - Vector2d(box.center().x(), box.max().y())).norm() < kWelcome);
    cab->shares.push_back(inside.back() != 0 ? floors.back() / storeys.back() : cab->shares.back());
  }
  cab->shares.erase(cab->shares.begin());

  // A door is open while its cab is there and somebody is near, and shuts before the cab leaves.
  const std::size_t n = floors.size();
  for (auto door = std::next(cab); door != scene.moving_doors.end() && door->opening < 0; ++door) {
    const double floor = storeys[static_cast<std::size_t>(std::distance(cab, door) - 1) / 2];
    std::vector<char> wanted(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t later = std::min(n - 1, i + static_cast<std::size_t>(kAhead / kStep));
      const auto there = [&](std::size_t k) {
        return std::abs(floors[k] - floor) < kSame && welcome[k] != 0;
      };
      wanted[i] = there(i) && (inside[i] == 0 || there(later));
    }
    door->shares = open_shares(wanted);
  }
}

}  // namespace plumbline::synth
