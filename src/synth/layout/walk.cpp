// SPDX-License-Identifier: BSD-3-Clause
// The camera's way through a generated world: where a person who films it walks and looks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "layout/layout.hpp"
#include "render/path.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kStep = 0.4;  // m between waypoints

double heading(const Vector2d& d) { return std::atan2(d.y(), d.x()); }

/// Free places in a room, far from each other: one for every 6 m^2.
std::vector<Vector2d> stations(const PlanRoom& room, const Ground& ground, const cv::Mat1b& reachable) {
  std::vector<Vector2d> candidates, chosen;

  // Reachable places on a coarse grid.
  for (int y = 0; y < ground.size().height; y += 3) {
    for (int x = 0; x < ground.size().width; x += 3) {
      const Vector2d p = ground.middle_of({x, y});
      if (reachable(y, x) != 0 && room.contains(p)) candidates.push_back(p);
    }
  }

  // Greedy choice of distant places.
  const auto count = static_cast<std::size_t>(std::clamp(room.area() / 6.0, 2.0, 9.0));
  while (chosen.size() < count && !candidates.empty()) {
    const auto worth = [&](const Vector2d& p) {
      double nearest = 4.0;
      for (const Vector2d& other : chosen) nearest = std::min(nearest, (p - other).norm());
      return nearest + 2.0 * std::min(0.7, ground.clearance(p));
    };

    // Enough are chosen if the rest is crowded.
    const auto best =
        std::max_element(candidates.begin(), candidates.end(),
                         [&](const Vector2d& a, const Vector2d& b) { return worth(a) < worth(b); });
    if (!chosen.empty() && worth(*best) < 1.6) break;
    chosen.push_back(*best);
  }
  return chosen;
}

/// Rooms in the order in which a person comes through them: depth first over the ways between them.
void visit(const Plan& plan, int room, Rng& rng, std::vector<char>& seen, std::vector<int>& order) {
  seen[static_cast<std::size_t>(room)] = 1;
  order.push_back(room);
  std::vector<int> next;
  for (const PlanOpening& o : plan.openings) {
    if (o.passable() && (o.front == room || o.back == room))
      next.push_back(o.front == room ? o.back : o.front);
  }
  while (!next.empty()) {
    const auto k = static_cast<std::size_t>(rng.integer(0, static_cast<int>(next.size()) - 1));
    const int to = next[k];
    next.erase(next.begin() + static_cast<long>(k));
    if (seen[static_cast<std::size_t>(to)] == 0) visit(plan, to, rng, seen, order);
  }
}

/// Rounds a closed line's corners and thins it out to steps of kStep, with clearance kept. Corners in the
/// rooms `keep` stay where they are.
std::vector<Vector2d> round_off(const std::vector<Vector2d>& corners, const Ground& ground,
                                const std::vector<const PlanRoom*>& keep) {
  std::vector<Vector2d> fine;
  std::vector<char> fixed;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Vector2d d = corners[i + 1] - corners[i];
    const int n = static_cast<int>(std::ceil(d.norm() / 0.1));
    for (int k = 0; k < n; ++k) fine.push_back(corners[i] + static_cast<double>(k) / n * d);

    // Corners in rooms to visit must not be cut.
    fixed.resize(fine.size(), 0);
    if (n > 0)
      fixed[fine.size() - static_cast<std::size_t>(n)] = std::any_of(
          keep.begin(), keep.end(), [&](const PlanRoom* room) { return room->contains(corners[i]); });
  }

  // Smoothed in rounds, with clearance kept.
  for (int round = 0; round < 12; ++round) {
    for (std::size_t i = 0; i < fine.size(); ++i) {
      const Vector2d &before = fine[(i + fine.size() - 1) % fine.size()],
                     &after = fine[(i + 1) % fine.size()];
      const Vector2d p = 0.25 * before + 0.5 * fine[i] + 0.25 * after;
      if (fixed[i] == 0 && ground.clearance(p) >= std::min(0.35, ground.clearance(fine[i]))) fine[i] = p;
    }
  }

  // Where it is narrow steps are shorter, so that the curve through them keeps to the line.
  std::vector<Vector2d> out = {fine.front()};
  for (std::size_t i = 0; i < fine.size(); ++i) {
    const Vector2d& p = fine[i];
    const double step = ground.clearance(out.back(), p) < 0.35 ? 0.5 * kStep : kStep;
    const bool far = (p - out.back()).norm() >= step && (p - fine.front()).norm() >= 0.5 * step;
    if (far || (fixed[i] != 0 && p != out.back())) out.push_back(p);
  }
  return out;
}

/// The rooms of a plan that a way enters but its rounded line, if there is one, does not.
std::vector<const PlanRoom*> missed(const Plan& plan, const std::vector<Vector2d>& way,
                                    const std::vector<Vector2d>& line) {
  std::vector<const PlanRoom*> out;
  for (const PlanRoom& room : plan.rooms) {
    const auto inside = [&](const Vector2d& p) { return room.contains(p); };
    if (std::any_of(way.begin(), way.end(), inside) && std::none_of(line.begin(), line.end(), inside))
      out.push_back(&room);
  }
  return out;
}

/// Chooses where the camera looks: at what it has not seen yet of walls and openings, without turning
/// abruptly and, where all is seen, ahead.
class Gaze {
 public:
  Gaze(const Plan& plan, const Ground& ground) : ground_(ground) {
    // Points along the walls.
    for (std::size_t r = 0; r < plan.rooms.size(); ++r) {
      for (const PlanFace& face : plan.rooms[r].faces) {
        const Vector2d d = face.to - face.from, inwards = Vector2d(-d.y(), d.x()).normalized();
        const int n = 1 + static_cast<int>(d.norm() / 0.3);
        for (int i = 0; i < n; ++i)
          targets_.push_back({face.from + (i + 0.5) / n * d + 0.1 * inwards, inwards, 1.0});
      }
    }

    // Jambs count three times as much.
    for (const PlanOpening& o : plan.openings) {
      const PlanWall& wall = plan.walls[static_cast<std::size_t>(o.wall)];
      const Vector2d left(-wall.direction.y(), wall.direction.x());
      const double out = 0.5 * wall.thickness + 0.1;
      for (const double side : {1.0, -1.0}) {
        for (const double s : {o.from, o.to})
          targets_.push_back({wall.at(s) + side * out * left, side * left, 3.0});
      }
    }
  }

  /// Direction at a place, moving to `ahead`; marks what is seen.
  double turn(const Vector2d& at, double ahead, double before) {
    struct Seen {
      std::size_t target;
      double yaw, worth;
    };

    // Targets in range that face the camera.
    std::vector<Seen> around;
    for (std::size_t i = 0; i < targets_.size(); ++i) {
      const Vector2d d = targets_[i].at - at;
      const double far = d.norm();
      if (targets_[i].worth < 0.05 || far < 0.7 || far > 4.0 || targets_[i].normal.dot(d) > -0.3 * far)
        continue;
      if (ground_.in_sight(at, targets_[i].at)) around.push_back({i, heading(d), targets_[i].worth});
    }

    // A small turn, towards motion and unseen targets.
    double best = before, most = -1e9;
    for (int k = -4; k <= 4; ++k) {
      const double yaw = before + 0.12 * k;
      double worth = -2.5 * std::abs(wrap(yaw - ahead)) - 0.4 * std::abs(k);
      for (const Seen& s : around) {
        const double off = std::abs(wrap(s.yaw - yaw));
        if (off < 1.6) worth += s.worth * (off < 0.45 ? 1.0 : 0.5 * (1.6 - off));
      }

      if (worth > most) {
        most = worth;
        best = yaw;
      }
    }

    // Seen targets lose half their worth.
    for (const Seen& s : around) {
      if (std::abs(wrap(s.yaw - best)) < 0.45) targets_[s.target].worth *= 0.5;
    }
    return best;
  }

 private:
  struct Target {
    Vector2d at, normal;
    double worth;
  };
  const Ground& ground_;
  std::vector<Target> targets_;
};

/// Waypoints at eye height that look where the gaze turns.
std::vector<Waypoint> film(const Plan& plan, const std::vector<Vector2d>& way, const Ground& ground,
                           Rng& rng) {
  Gaze gaze(plan, ground);
  const double height = rng.uniform(1.3, 1.65), nod = rng.uniform(0.0, 2.0 * M_PI);
  std::vector<Waypoint> out;
  double yaw = heading(way[1] - way[0]);
  for (std::size_t i = 0; i < way.size(); ++i) {
    const Vector2d ahead = way[std::min(i + 2, way.size() - 1)] - way[i > 0 ? i - 1 : 0];
    yaw = gaze.turn(way[i], heading(ahead), yaw);
    const double pitch = -0.17 + 0.16 * std::sin(nod + 0.35 * static_cast<double>(i));
    Waypoint w;
    w.position = {way[i].x(), way[i].y(), height};
    w.look = w.position + 3.0 * Vector3d(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch),
                                         std::sin(pitch));
    out.push_back(w);
  }
  return out;
}

/// The curve that the camera follows, apart from sway, stays away from everything.
bool keeps_clear(const RobotPath& path, const Ground& ground) {
  CameraPath::Options steady;
  steady.wheeled = true;
  const CameraPath curve(path, steady);
  for (double t = 0.0; t <= curve.duration(); t += 0.05) {
    if (ground.clearance(curve.world_from_camera(t).translation.head<2>()) < 0.15) return false;
  }
  return true;
}

/// One place of each corridor or, where these are few, of the first rooms, in the order around their middle.
std::vector<std::vector<Vector2d>> lap(const Plan& plan, const std::vector<int>& order,
                                       const std::vector<std::vector<Vector2d>>& rooms) {
  std::vector<Vector2d> corridors, first, all;
  for (const int room : order) {
    const bool corridor = plan.rooms[static_cast<std::size_t>(room)].kind == "corridor";
    const Vector2d& place = rooms[static_cast<std::size_t>(room)].front();
    if (corridor) corridors.push_back(place);
    if (first.size() < 4) first.push_back(place);
  }

  // Three corridors make a lap.
  all = corridors.size() > 2 ? corridors : first;
  Vector2d middle = Vector2d::Zero();
  for (const Vector2d& p : all) middle += p / static_cast<double>(all.size());
  std::sort(all.begin(), all.end(),
            [&](const Vector2d& a, const Vector2d& b) { return heading(a - middle) < heading(b - middle); });

  std::vector<std::vector<Vector2d>> out;
  for (const Vector2d& p : all) out.push_back({p});
  return out;
}

/// Places to go to, group after group, in any order within one; empty if a room has none.
std::vector<std::vector<Vector2d>> destinations(const Plan& plan, const Ground& ground, Route route,
                                                Rng& rng) {
  std::vector<int> order;
  std::vector<char> seen(plan.rooms.size(), 0);
  visit(plan, rng.integer(0, static_cast<int>(plan.rooms.size()) - 1), rng, seen, order);
  const auto door = std::find_if(plan.openings.begin(), plan.openings.end(),
                                 [](const PlanOpening& o) { return o.passable(); });
  if (door == plan.openings.end()) return {};

  // Every room needs a free place.
  const cv::Mat1b reachable = ground.reachable(plan.middle(*door));
  std::vector<std::vector<Vector2d>> rooms, out;
  for (const PlanRoom& room : plan.rooms) {
    rooms.push_back(stations(room, ground, reachable));
    if (rooms.back().empty()) return {};
  }

  const auto& start = rooms[static_cast<std::size_t>(order.front())];
  if (route == Route::kLaps) return lap(plan, order, rooms);

  // To the farthest room.
  if (route == Route::kThereAndBack) {
    Vector2d far = start.front();
    for (const auto& places : rooms) {
      if ((places.front() - start.front()).norm() > (far - start.front()).norm()) far = places.front();
    }
    return {{start.front()}, {far}};
  }

  // Random places, or all of them room by room.
  if (route == Route::kWander) {
    for (int i = 0; i < 24; ++i) out.push_back({rng.pick(rng.pick(rooms))});
  } else {
    for (const int room : order) out.push_back(rooms[static_cast<std::size_t>(room)]);
  }
  return out;
}

RobotPath try_path(const Plan& plan, const Ground& ground, Route route, int robot, Rng& rng,
                   const std::optional<Vector2d>& start) {
  RobotPath path;
  path.name = fmt::format("robot{}", robot);
  path.speed = rng.uniform(0.55, 0.8);
  path.turn_rate = 0.8;

  // Nearest place first within each group.
  std::vector<Vector2d> way;
  for (std::vector<Vector2d>& places : destinations(plan, ground, route, rng)) {
    if (way.empty()) way = {start.value_or(places.back())};

    while (!places.empty()) {
      const auto nearest =
          std::min_element(places.begin(), places.end(), [&](const Vector2d& a, const Vector2d& b) {
            return (a - way.back()).norm() < (b - way.back()).norm();
          });

      // The way there, around obstacles.
      const std::vector<Vector2d> leg = ground.straight_way(way.back(), *nearest);
      if (leg.empty()) return path;
      way.insert(way.end(), leg.begin(), leg.end());
      places.erase(nearest);
    }
  }
  if (way.empty()) return path;

  // Closed, with rounded corners.
  const std::vector<Vector2d> back = ground.straight_way(way.back(), way.front());
  way.insert(way.end(), back.begin(), back.end());
  std::vector<Vector2d> line = round_off(way, ground, {});
  if (const auto rooms = missed(plan, way, line); !rooms.empty()) line = round_off(way, ground, rooms);
  if (line.size() < 4) return path;

  // Camera poses along the line.
  path.closed = true;
  path.waypoints = film(plan, line, ground, rng);
  return path;
}

}  // namespace

RobotPath plan_path(const Plan& plan, const Ground& ground, Route route, int robot, Rng& rng,
                    const std::optional<Vector2d>& start) {
  // A random path may come too close to obstacles.
  for (int tries = 0; tries < 6; ++tries) {
    RobotPath path = try_path(plan, ground, route, robot, rng, start);
    if (!path.waypoints.empty() && keeps_clear(path, ground)) return path;
  }
  return {};
}

}  // namespace plumbline::synth
