// SPDX-License-Identifier: BSD-3-Clause
// Chains of dimensions along walls.
#include <algorithm>
#include <cmath>

#include "drawings/plan_drawing.hpp"

namespace plumbline::exports {
namespace {

/// A straight side of a room, or a wall that is none; the room lies on the left.
struct DimensionRun {
  Eigen::Vector2d from, to;
  [[nodiscard]] double length() const { return (to - from).norm(); }
  [[nodiscard]] Eigen::Vector2d along() const { return (to - from).normalized(); }
  [[nodiscard]] Eigen::Vector2d inward() const { return {-along().y(), along().x()}; }
};

bool continues(const DimensionRun& run, const Eigen::Vector2d& to) {
  constexpr double kStraight = 0.008;
  const Eigen::Vector2d way = (to - run.to).normalized();
  return way.dot(run.along()) > 0.0 && std::abs(way.dot(run.inward())) < kStraight;
}

/// Sides of a room from corner to corner, without the limits of what was observed.
std::vector<DimensionRun> runs_of(const plans::WallRoom& room) {
  std::vector<DimensionRun> runs;
  const std::size_t count = room.outline.size();
  bool open = true;

  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d &a = room.outline[i], &b = room.outline[(i + 1) % count];

    if (room.side(i) == plans::RoomSide::kLimit) {
      open = true;
    } else if (!open && continues(runs.back(), b)) {
      runs.back().to = b;
    } else {
      runs.push_back({a, b});
      open = false;
    }
  }

  // The first side may go on from the last.
  if (runs.size() > 1 && !open && room.side(0) != plans::RoomSide::kLimit &&
      continues(runs.back(), runs.front().to)) {
    runs.front().from = runs.back().from;
    runs.pop_back();
  }
  return runs;
}

/// Share of a wall that lies along the run.
double common_share(const plans::WallLine& wall, const DimensionRun& run) {
  constexpr double kOff_m = 0.04;
  if (wall.normal.dot(run.inward()) < 0.99 ||
      std::abs(run.inward().dot(wall.at(wall.s0) - run.from)) > kOff_m)
    return 0.0;
  const double s0 = run.along().dot(wall.at(wall.s0) - run.from),
               s1 = run.along().dot(wall.at(wall.s1) - run.from);
  return (std::min(std::max(s0, s1), run.length()) - std::max(std::min(s0, s1), 0.0)) / wall.length();
}

/// Runs that get dimensions, the longest first: sides of rooms, and walls that belong to no room.
std::vector<DimensionRun> all_runs(const plans::WallPlan& plan, double unit) {
  constexpr double kShortest_m = 0.3, kLeastNew = 0.5;
  std::vector<DimensionRun> runs;

  // Sides of rooms come first, for they are cut to the room
  for (const plans::WallRoom& room : plan.rooms) {
    const auto more = runs_of(room);
    runs.insert(runs.end(), more.begin(), more.end());
  }

  // Walls that are mostly new
  for (const plans::WallLine& wall : plan.walls) {
    double share = 0.0;
    for (const DimensionRun& run : runs) share += std::max(0.0, common_share(wall, run));
    if (share < kLeastNew) runs.push_back({wall.at(wall.s1), wall.at(wall.s0)});
  }

  // Short runs have no room for a text
  runs.erase(std::remove_if(runs.begin(), runs.end(),
                            [&](const DimensionRun& run) { return run.length() < kShortest_m * unit; }),
             runs.end());
  std::stable_sort(runs.begin(), runs.end(), [](const DimensionRun& a, const DimensionRun& b) {
    return a.length() > b.length() + 1e-6;
  });
  return runs;
}

/// True if both lengths lie opposite each other and are the same.
bool is_same(const DimensionRun& a, const DimensionRun& b) {
  constexpr double kSame_m = 0.015, kFarthest_m = 12.0;
  if (std::abs(a.along().dot(b.inward())) > 0.02) return false;
  const double s0 = a.along().dot(b.from - a.from), s1 = a.along().dot(b.to - a.from);
  return std::abs(std::min(s0, s1)) < kSame_m && std::abs(std::max(s0, s1) - a.length()) < kSame_m &&
         std::abs(a.inward().dot(b.from - a.from)) < kFarthest_m;
}

/// Places of jambs along the run, of openings that no chain has yet.
std::vector<double> jambs_along(const DimensionRun& run, const std::vector<plans::WallDoor>& doors,
                                std::vector<bool>& used) {
  constexpr double kOff_m = 0.05;
  std::vector<double> places;
  for (std::size_t i = 0; i < doors.size(); ++i) {
    const auto on_run = [&](const std::array<Eigen::Vector2d, 2>& jambs) {
      return std::all_of(jambs.begin(), jambs.end(), [&](const Eigen::Vector2d& jamb) {
        const double s = run.along().dot(jamb - run.from);
        return std::abs(run.inward().dot(jamb - run.from)) < kOff_m && s > -kOff_m &&
               s < run.length() + kOff_m;
      });
    };
    if (used[i] || (!on_run(doors[i].jambs) && !on_run(doors[i].far_jambs))) continue;
    used[i] = true;
    for (const Eigen::Vector2d& jamb : doors[i].jambs) places.push_back(run.along().dot(jamb - run.from));
  }
  return places;
}

/// Draws dimensions, then their texts over their lines, else beside them with a leader: a text must not lie
/// on the lines of any of them.
class DimensionChain {
 public:
  DimensionChain(const PlanStyle& style, std::size_t layer, Drawing& drawing)
      : style_(style), layer_(layer), drawing_(drawing) {}

  void draw(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Eigen::Vector2d& beside) {
    DrawnDimension d{layer_, from, to, beside, (to - from).norm() / style_.unit, {}, false};
    const Eigen::Vector2d along = (to - from).normalized();
    d.label = {layer_, 0.5 * (from + to) + beside, 1.8 * style_.mm, std::atan2(along.y(), along.x()),
               style_.number(d.measure_m, 3)};
    dimensions_.push_back(d);
  }

  void place_texts() {
    LabelPlaces places(drawing_);
    for (const DrawnDimension& d : dimensions_) {
      // Texts must avoid all lines of dimensions
      for (const DrawnLine& line : lines_of(d)) places.add(line);
    }

    for (DrawnDimension& d : dimensions_) {
      const Eigen::Vector2d middle = d.label.at, along = (d.to - d.from).normalized();
      const Eigen::Vector2d across(-along.y(), along.x());
      const double width = d.label.width_m(), length = (d.to - d.from).norm();
      std::vector<Eigen::Vector2d> near, far;

      // Places over and under the line, the middle first
      for (const double share : {0.0, 0.12, -0.12, 0.25, -0.25, 0.36, -0.36}) {
        if (width + 2.0 * std::abs(share) * length > 0.95 * length) continue;
        for (const double side : {0.95, -0.95})
          near.emplace_back(middle + share * length * along + side * d.label.height_m * across);
      }

      // A text that does not fit gets a leader
      if (!places.place(d.label, near)) {
        for (const Eigen::Vector2d& at : places_around(middle, style_.mm, 45.0 * style_.mm)) {
          if (places.is_free(middle, at)) far.push_back(at);
        }
        places.place(d.label, far);
        d.leader = true;
        places.add(lines_of(d).back());
      }
      drawing_.dimensions.push_back(d);
    }
  }

 private:
  const PlanStyle& style_;
  std::size_t layer_;
  Drawing& drawing_;
  std::vector<DrawnDimension> dimensions_;
};

}  // namespace

void draw_dimensions(const plans::WallPlan& plan, const PlanStyle& style, const PlanLayers& layers,
                     Drawing& drawing) {
  constexpr double kNone_m = 0.02;
  const double first = 5.0 * style.mm, second = 10.0 * style.mm;
  DimensionChain chain(style, layers.dimensions, drawing);
  std::vector<bool> used(plan.doors.size(), false);
  std::vector<DimensionRun> done;

  for (const DimensionRun& run : all_runs(plan, style.unit)) {
    std::vector<double> places = jambs_along(run, plan.doors, used);
    const bool with_openings = !places.empty();
    const bool again =
        std::any_of(done.begin(), done.end(), [&](const auto& other) { return is_same(other, run); });
    if (again && !with_openings) continue;

    // The chain of jambs is nearer to the wall than the total
    places.insert(places.end(), {0.0, run.length()});
    std::sort(places.begin(), places.end());
    const auto at = [&](double s) { return Eigen::Vector2d(run.from + s * run.along()); };
    for (std::size_t i = 0; with_openings && i + 1 < places.size(); ++i) {
      if (places[i + 1] - places[i] > kNone_m)
        chain.draw(at(places[i]), at(places[i + 1]), first * run.inward());
    }

    // A length is drawn once, even if two walls have it
    if (!again) chain.draw(run.from, run.to, (with_openings ? second : first) * run.inward());
    if (!again) done.push_back(run);
  }

  // Openings that no chain holds, over their own line.
  for (std::size_t i = 0; i < plan.doors.size(); ++i) {
    if (!used[i]) chain.draw(plan.doors[i].jambs[0], plan.doors[i].jambs[1], Eigen::Vector2d::Zero());
  }
  chain.place_texts();
}

}  // namespace plumbline::exports
