// SPDX-License-Identifier: BSD-3-Clause
// People who walk, stop, turn, sit and meet each other on the free floor of a scene.
#include <algorithm>
#include <cmath>
#include <map>

#include "layout/layout.hpp"
#include "plumbline/synth/layout.hpp"
#include "render/path.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kFootAside = 0.09;  // m from the middle
constexpr double kFootLift = 0.06;   // m
constexpr double kSeatDepth = 0.5;   // m by which people move back when they sit down

Vector3d lifted(const Vector2d& p, double z) { return {p.x(), p.y(), z}; }
Vector2d ahead_of(double yaw) { return {std::cos(yaw), std::sin(yaw)}; }
double bearing(const Vector2d& from, const Vector2d& to) {
  return std::atan2(to.y() - from.y(), to.x() - from.x());
}
double ease(double x) { return x * x * (3.0 - 2.0 * x); }

/// A place before a seat, and the direction away from it.
struct Seat {
  Vector2d at;
  double yaw;
};

/// Records a person's poses, one after the other.
class Day {
 public:
  Day(const Vector2d& at, double yaw, double floor, double speed) : floor_(floor), speed_(speed) {
    now_.hip = lifted(at, floor + kHipHeight);
    now_.yaw = yaw;
    for (const int side : {0, 1}) now_.foot[side] = sole(at, yaw, side);
    poses_.push_back(now_);
  }

  void stand(double seconds) {
    for (int n = static_cast<int>(std::lround(seconds / kFigureStep)); n > 0; --n) poses_.push_back(now_);
  }

  /// On the spot: first one foot is put down again, then the other.
  void turn(double yaw) {
    const FigurePose before = now_;
    const double angle = wrap(yaw - before.yaw);
    if (std::abs(angle) < 0.02) return;
    over(std::max(0.6, std::abs(angle) / 1.8), [&](double s) {
      now_.yaw = before.yaw + angle * ease(s);
      for (const int side : {0, 1}) {
        const double part = std::clamp(2.0 * s - side, 0.0, 1.0);
        now_.foot[side] = swung(before.foot[side], sole(now_.hip.head<2>(), yaw, side), part);
      }
    });
  }

  /// Along straight pieces with whole steps; a foot on the floor stays where it is until the other one is.
  void walk(const std::vector<Vector2d>& line) {
    const double length = length_of(line);
    if (length < 0.1) return;
    turn(heading(line, 0.0));
    const int count = std::max(1, static_cast<int>(std::lround(length / (0.28 + 0.3 * speed_))));
    const double step = length / count;

    // Footprints at whole steps.
    const Vector3d start[2] = {now_.foot[0], now_.foot[1]};
    const auto footprint = [&](int k, int side) {
      if (k <= 0) return start[side];
      const double d = std::min(k * step, length);
      return sole(point(line, d), heading(line, d), side);
    };

    // One foot swings while the other stands.
    over(length / speed_, [&](double s) {
      const double steps = s * count;
      now_.hip = lifted(point(line, s * length), floor_ + kHipHeight);
      now_.yaw = heading(line, s * length);

      // Left and right are half a cycle apart.
      for (const int side : {0, 1}) {
        const int k = side + 2 * static_cast<int>(std::floor((steps + 0.5 - side) / 2.0));
        const double from = std::max(0.0, k + 0.5), to = std::min(k + 1.5, static_cast<double>(count));
        const double part = to > from ? std::clamp((steps - from) / (to - from), 0.0, 1.0) : 0.0;
        now_.foot[side] = swung(footprint(k, side), footprint(k + 2, side), part);
      }
    });
  }

  void sit(const Seat& seat, double seconds) {
    turn(seat.yaw);

    // Down onto the seat, and up again.
    const Vector3d up = now_.hip;
    Vector3d down = lifted(up.head<2>() - kSeatDepth * ahead_of(seat.yaw), floor_ + 0.53);
    over(1.2, [&](double s) { now_.hip = up + ease(s) * (down - up); });
    stand(seconds);
    over(1.2, [&](double s) { now_.hip = down + ease(s) * (up - down); });
  }

  [[nodiscard]] double seconds() const { return kFigureStep * static_cast<double>(poses_.size()); }
  [[nodiscard]] Vector2d at() const { return now_.hip.head<2>(); }
  std::vector<FigurePose> take() { return std::move(poses_); }

 private:
  [[nodiscard]] Vector3d sole(const Vector2d& at, double yaw, int side) const {
    const double y = side == 0 ? kFootAside : -kFootAside;
    return lifted(at + y * Vector2d(-std::sin(yaw), std::cos(yaw)), floor_);
  }

  static Vector3d swung(const Vector3d& from, const Vector3d& to, double part) {
    const double lift = (to - from).norm() > 0.01 ? kFootLift * std::sin(M_PI * part) : 0.0;
    return from + ease(part) * (to - from) + lift * Vector3d::UnitZ();
  }

  /// Poses at the figure's rate; `pose` gets the share of the time that has passed.
  template <typename Pose>
  void over(double seconds, const Pose& pose) {
    const int n = std::max(1, static_cast<int>(std::lround(seconds / kFigureStep)));
    for (int i = 1; i <= n; ++i) {
      pose(static_cast<double>(i) / n);
      poses_.push_back(now_);
    }
  }

  static double length_of(const std::vector<Vector2d>& line) {
    double sum = 0.0;
    for (std::size_t i = 1; i < line.size(); ++i) sum += (line[i] - line[i - 1]).norm();
    return sum;
  }

  /// Point of a line at a distance from its start.
  static Vector2d point(const std::vector<Vector2d>& line, double d) {
    for (std::size_t i = 1; i < line.size(); ++i) {
      const double piece = (line[i] - line[i - 1]).norm();
      if (d <= piece && piece > 0.0) return line[i - 1] + std::max(0.0, d) / piece * (line[i] - line[i - 1]);
      d -= piece;
    }
    return line.back();
  }

  /// Smooth around corners.
  static double heading(const std::vector<Vector2d>& line, double d) {
    const double length = length_of(line), reach = 0.25;
    return bearing(point(line, std::min(d, length - 0.05) - reach), point(line, std::max(d, 0.05) + reach));
  }

  double floor_, speed_;
  FigurePose now_;
  std::vector<FigurePose> poses_;
};

/// The floor around the camera's path on one storey, with its seats.
class Stage {
 public:
  Stage(const Scene& scene, double height) : floor(height), ground_(scene, height) {
    // Camera paths on this storey.
    for (const Waypoint& w : scene.robots.front().waypoints) {
      if (w.position.z() > floor + 0.5 && w.position.z() < floor + 2.2) path_.push_back(w.position.head<2>());
    }

    // Extent and first face of each object.
    std::vector<Eigen::AlignedBox3d> boxes(scene.objects.size());
    std::vector<const Face*> fronts(scene.objects.size(), nullptr);
    for (const Face& face : scene.faces) {
      const auto k = static_cast<std::size_t>(face.object);
      if (fronts[k] == nullptr) fronts[k] = &face;
      for (const Vector2d& uv : face.polygon) boxes[k].extend(face.at(uv.x(), uv.y()));
    }

    // Seats that people can walk up to.
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      const std::string& type = scene.objects[k].type;
      if ((type != "sofa" && type != "chair" && type != "bed") || fronts[k] == nullptr) continue;
      if (std::abs(boxes[k].min().z() - floor) > 0.2) continue;
      const Face& front = *fronts[k];  // the first face of what people sit on
      const Eigen::AlignedBox2d b = front.bounds();
      const Vector2d out = front.normal.head<2>(),
                     middle = front.at(b.center().x(), b.center().y()).head<2>();

      const Vector2d at = middle + 0.28 * out;
      if (ground_.walkable(ground_.cell_of(at))) seats_.push_back({at, bearing({0.0, 0.0}, out)});
    }
  }

  /// A place near the camera's path, at a share of it; nothing if none is free.
  [[nodiscard]] std::optional<Vector2d> place(double share, double spread, Rng& rng) const {
    if (path_.empty()) return std::nullopt;
    const auto n = static_cast<double>(path_.size());
    for (int tries = 0; tries < 30; ++tries) {
      const double at = std::clamp(share * n + rng.uniform(-spread, spread), 0.0, n - 1.0);
      const double angle = rng.uniform(-M_PI, M_PI), far = rng.uniform(0.0, 1.2);
      const Vector2d p = path_[static_cast<std::size_t>(at)] + far * ahead_of(angle);
      if (ground_.walkable(ground_.cell_of(p))) return p;
    }
    return std::nullopt;
  }

  /// Walks there; false, without a change, if there is no way.
  bool go(const Vector2d& to, Day& day) const {
    std::vector<Vector2d> line = ground_.straight_way(day.at(), to);
    if (line.empty()) return false;
    line.front() = day.at();
    line.back() = to;
    day.walk(line);
    return true;
  }

  /// Nearest seat within 4 m; none: there is no such seat.
  [[nodiscard]] const Seat* nearest_seat(const Vector2d& p) const {
    const Seat* best = nullptr;
    for (const Seat& seat : seats_) {
      const double far = (seat.at - p).norm();
      if (far < 4.0 && (best == nullptr || far < (best->at - p).norm())) best = &seat;
    }
    return best;
  }

  /// A place to stand before someone and talk.
  [[nodiscard]] std::optional<Vector2d> opposite(const Vector2d& p) const {
    for (int i = 0; i < 8; ++i) {
      const Vector2d q = p + 0.9 * ahead_of(0.25 * M_PI * i);
      if (ground_.walkable(ground_.cell_of(q)) && ground_.clearance(p, q) > 0.2) return q;
    }
    return std::nullopt;
  }

  double floor;

 private:
  Ground ground_;
  std::vector<Vector2d> path_;
  std::vector<Seat> seats_;
};

/// A round from a place and back: a talk, four errands with stops or a seat.
Day live(const Stage& stage, const Vector2d& home, double yaw, double share, double speed, Rng& rng) {
  Day day(home, yaw, stage.floor, speed);
  day.stand(rng.uniform(1.0, 5.0));
  for (int errand = 0; errand < 4; ++errand) {
    const Seat* seat = errand == 1 ? stage.nearest_seat(day.at()) : nullptr;
    if (seat != nullptr && stage.go(seat->at, day)) {
      day.sit(*seat, rng.uniform(4.0, 10.0));
      continue;
    }
    const auto to = stage.place(share, 12.0, rng);
    if (to && stage.go(*to, day)) day.stand(rng.chance(0.4) ? rng.uniform(1.0, 4.0) : 0.2);
  }
  stage.go(home, day);
  day.turn(yaw);
  return day;
}

}  // namespace

bool add_people(int count, int seed, Scene& scene) {
  const auto wanted = static_cast<std::size_t>(count);
  static const std::vector<std::string> kClothes = {"curtain", "sofa",      "plastic_blue",
                                                    "rug",     "lampshade", "leaf"};
  std::map<double, Stage> stages;
  const std::vector<Waypoint>& path = scene.robots.front().waypoints;

  Rng rng(static_cast<std::uint64_t>(seed), 0x3a1c);

  // The storey on which the path is at that point.
  for (int tries = 0; scene.walkers.size() < wanted && tries < 100; ++tries) {
    const double eyes = rng.pick(path).position.z();
    double floor = 0.0;
    for (const double storey : scene.plan ? scene.plan->storeys : std::vector<double>{}) {
      if (storey < eyes - 1.0) floor = storey;
    }
    const Stage& stage = stages.try_emplace(floor, scene, floor).first->second;

    // More of them at the beginning of the path, which short recordings see. They meet in pairs.
    const double share = std::pow(rng.uniform(), 2.0);
    const auto home = stage.place(share, 6.0, rng);
    if (!home) continue;
    const Vector2d other = stage.opposite(*home).value_or(*home);
    std::vector<Day> days;

    // Two people who face each other at first.
    for (const Vector2d& at : {*home, other}) {
      if (at == *home && !days.empty()) break;
      const Vector2d& to = days.empty() ? other : *home;
      const double yaw = at == to ? rng.uniform(-M_PI, M_PI) : bearing(at, to);
      days.push_back(live(stage, at, yaw, share, rng.uniform(0.6, 1.1), rng));
    }

    // They wait, so that both days have one length.
    for (Day& day : days) {
      if (scene.walkers.size() >= wanted) break;
      day.stand(std::max(days.front().seconds(), days.back().seconds()) - day.seconds());
      Walker person;
      person.mark.file = scene.file.string();
      person.material = rng.pick(kClothes);
      person.carries = rng.chance(0.2);
      person.day = day.take();
      scene.walkers.push_back(std::move(person));
    }
  }

  return scene.walkers.size() >= wanted;
}

}  // namespace plumbline::synth
