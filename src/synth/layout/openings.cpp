// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "layout/layout.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;

namespace {

constexpr double kStub = 0.13;  // m of wall between an opening and a corner, or two openings

/// A stretch of a wall with the same rooms on its sides.
struct Stretch {
  int wall;
  double from, to;  // m along the wall
  int front, back;  // rooms; back is -1 outside
};

std::pair<double, double> extent(const PlanWall& wall, const PlanFace& face) {
  return std::minmax({wall.along(face.from), wall.along(face.to)});
}

bool ahead(const PlanWall& wall, const PlanFace& face) {
  return wall.direction.dot(face.to - face.from) > 0.0;
}

/// Parts of walls with a room on both sides.
std::vector<Stretch> inner_stretches(const Plan& plan) {
  std::vector<Stretch> out;
  for (std::size_t a = 0; a < plan.rooms.size(); ++a) {
    for (std::size_t b = a + 1; b < plan.rooms.size(); ++b) {
      for (const PlanFace& f : plan.rooms[a].faces) {
        for (const PlanFace& g : plan.rooms[b].faces) {
          const PlanWall& wall = plan.walls[static_cast<std::size_t>(f.wall)];
          if (f.wall != g.wall || ahead(wall, f) == ahead(wall, g)) continue;
          const auto [f0, f1] = extent(wall, f);
          const auto [g0, g1] = extent(wall, g);
          const double from = std::max(f0, g0), to = std::min(f1, g1);
          if (to > from) out.push_back({f.wall, from, to, static_cast<int>(a), static_cast<int>(b)});
        }
      }
    }
  }
  return out;
}

class Openings {
 public:
  Openings(Rng& rng, Plan& plan) : rng_(rng), plan_(plan) {}

  /// Puts an opening of a width somewhere into a stretch; null if there is no room for it.
  PlanOpening* place(const Stretch& stretch, double width, OpeningKind kind) {
    const double lo = stretch.from + kStub, hi = stretch.to - kStub - width;
    if (hi < lo) return nullptr;
    for (int tries = 0; tries < 6; ++tries) {
      const double from = rng_.uniform(lo, hi);
      if (taken(stretch, from, from + width)) continue;
      PlanOpening o;
      o.kind = kind;
      o.wall = stretch.wall;
      o.from = from;
      o.to = from + width;
      o.front = stretch.front;
      o.back = stretch.back;
      o.depth = plan_.walls[static_cast<std::size_t>(o.wall)].thickness;
      plan_.openings.push_back(o);
      return &plan_.openings.back();
    }
    return nullptr;
  }

  /// A way through between two rooms; false if the wall is too short.
  bool connect(const Stretch& s, bool must_be_open) {
    const double lowest = lowest_ceiling(s), length = s.to - s.from - 2.0 * kStub;
    const bool corridors = kind(s.front) == "corridor" && kind(s.back) == "corridor";
    const bool wide = corridors || (rng_.chance(0.12) && length > 1.6);

    // A passage without a leaf.
    if (wide && length > 1.0) {
      const double width = corridors ? length - 1e-6 : rng_.uniform(1.2, std::min(length, 3.0));
      if (PlanOpening* o = place(s, width, OpeningKind::kPassage)) {
        o->head = rng_.chance(0.5) ? lowest : std::min(lowest, rng_.uniform(2.05, 2.5));
        return true;
      }
    }

    // A door, sometimes of double width.
    const double width =
        std::min(length, rng_.chance(0.15) ? rng_.uniform(1.2, 1.8) : rng_.uniform(0.7, 1.05));
    PlanOpening* o = width < 0.7 ? nullptr : place(s, width, OpeningKind::kDoor);
    if (o == nullptr) return false;
    o->head = std::min(lowest - 0.12, rng_.uniform(1.98, 2.15));
    choose_leaf(*o, must_be_open);
    return true;
  }

  void add_half_wall(const Stretch& s) {
    const double width = std::min(s.to - s.from - 2.0 * kStub, rng_.uniform(1.0, 3.5));
    if (PlanOpening* o = place(s, width, OpeningKind::kHalfWall)) {
      o->sill = rng_.uniform(0.85, 1.25);
      o->head = lowest_ceiling(s);
    }
  }

  void add_window(const Stretch& s) {
    if (PlanOpening* o = place(s, rng_.uniform(0.6, 2.0), OpeningKind::kWindow)) {
      o->sill = rng_.chance(0.15) ? 0.12 : rng_.uniform(0.7, 1.1);
      o->head = std::min(height(s.front) - 0.12, std::max(o->sill + 0.6, rng_.uniform(1.95, 2.3)));
    }
  }

  /// A recess from one side of the wall.
  void add_niche(const Stretch& s) {
    if (PlanOpening* o = place(s, rng_.uniform(0.4, 1.1), OpeningKind::kNiche)) {
      o->back = -1;
      o->sill = rng_.chance(0.4) ? 0.0 : rng_.uniform(0.5, 1.0);
      o->head = rng_.uniform(1.5, 2.1);
      o->depth = rng_.uniform(0.1, o->depth - 0.06);
    }
  }

  void add_entrance(const Stretch& s) {
    if (PlanOpening* o = place(s, rng_.uniform(0.9, 1.1), OpeningKind::kDoor)) {
      o->head = std::min(height(s.front) - 0.12, 2.1);
      o->leaf = Leaf::kShut;
    }
  }

 private:
  [[nodiscard]] double height(int room) const { return plan_.rooms[static_cast<std::size_t>(room)].height; }
  [[nodiscard]] const std::string& kind(int room) const {
    return plan_.rooms[static_cast<std::size_t>(room)].kind;
  }
  [[nodiscard]] double lowest_ceiling(const Stretch& s) const {
    return std::min(height(s.front), height(s.back));
  }
  [[nodiscard]] bool taken(const Stretch& s, double from, double to) const {
    return std::any_of(plan_.openings.begin(), plan_.openings.end(), [&](const PlanOpening& o) {
      return o.wall == s.wall && from < o.to + kStub && to > o.from - kStub;
    });
  }

  /// The larger room is the one into which a leaf opens.
  void choose_leaf(PlanOpening& o, bool must_be_open) {
    const auto area = [&](int room) { return plan_.rooms[static_cast<std::size_t>(room)].area(); };
    if (area(o.back) > area(o.front)) std::swap(o.front, o.back);

    const double draw = rng_.uniform();
    if (!must_be_open && draw < 0.7) {
      o.leaf = draw < 0.45 ? Leaf::kShut : Leaf::kAjar;
    } else {
      o.leaf = draw < 0.8 ? Leaf::kOpen : draw < 0.88 ? Leaf::kSliding : Leaf::kNone;
    }
    if (o.width() > 1.2 && o.leaf == Leaf::kOpen) o.leaf = Leaf::kNone;  // too wide for one leaf
    if (o.leaf == Leaf::kAjar) o.open_rad = rng_.uniform(0.15, 0.8);
    if (o.leaf == Leaf::kOpen) o.open_rad = rng_.uniform(1.35, 1.62);
  }

  Rng& rng_;
  Plan& plan_;
};

/// Connects all rooms by a spanning tree (Prim) with random weights that prefer corridors; the rest of the
/// stretches get doors of any kind, half-height walls and niches.
bool connect_rooms(Rng& rng, const Plan& plan, Openings& openings) {
  const std::vector<Stretch> stretches = inner_stretches(plan);
  std::vector<double> weights;
  std::vector<char> used(stretches.size(), 0), reached(plan.rooms.size(), 0);

  // Corridors and living rooms come first.
  for (const Stretch& s : stretches) {
    const auto& front = plan.rooms[static_cast<std::size_t>(s.front)].kind;
    const auto& back = plan.rooms[static_cast<std::size_t>(s.back)].kind;
    const int halls = (front == "corridor" ? 1 : 0) + (back == "corridor" ? 1 : 0);
    weights.push_back(rng.uniform() - halls - (front == "living" || back == "living" ? 0.6 : 0.0));
  }

  // Prim's algorithm, from the first room on.
  reached[0] = 1;
  for (std::size_t count = 1; count < plan.rooms.size();) {
    std::size_t best = stretches.size();
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      const bool crosses = reached[static_cast<std::size_t>(stretches[i].front)] !=
                           reached[static_cast<std::size_t>(stretches[i].back)];
      if (crosses && used[i] == 0 && (best == stretches.size() || weights[i] < weights[best])) best = i;
    }

    // The lightest edge that leaves the tree.
    if (best == stretches.size()) return false;
    used[best] = 1;
    if (!openings.connect(stretches[best], true)) continue;
    reached[static_cast<std::size_t>(stretches[best].front)] = 1;
    reached[static_cast<std::size_t>(stretches[best].back)] = 1;
    ++count;
  }

  // Further openings close loops.
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const Stretch& s = stretches[i];
    const bool corridors = weights[i] < -1.0;
    if (used[i] == 0 && rng.chance(corridors ? 0.9 : 0.35)) openings.connect(s, corridors);
    if (s.to - s.from > 1.4 && rng.chance(0.1)) openings.add_half_wall(s);
    if (plan.walls[static_cast<std::size_t>(s.wall)].thickness > 0.2 && rng.chance(0.2))
      openings.add_niche(s);
  }
  return true;
}

}  // namespace

namespace {

/// Doors slide only where the wall beside them is free.
void check_sliding(Plan& plan) {
  for (PlanOpening& o : plan.openings) {
    if (o.leaf != Leaf::kSliding) continue;
    for (const PlanFace& face : plan.rooms[static_cast<std::size_t>(o.front)].faces) {
      const auto door = part_of_face(plan, o.front, face, o);
      if (!door) continue;

      const double end = door->second + o.width();
      bool free = end < (face.to - face.from).norm();
      for (const PlanOpening& other : plan.openings) {
        const auto part = part_of_face(plan, o.front, face, other);
        free = free && (!part || part->second <= door->second || part->first > end);
      }
      if (!free) o.leaf = Leaf::kNone;
    }
  }
}

}  // namespace

bool add_openings(Rng& rng, Plan& plan) {
  Openings openings(rng, plan);
  if (!connect_rooms(rng, plan, openings)) return false;

  // One entrance, from a corridor or living room.
  bool entrance = false;
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    const std::string kind = plan.rooms[i].kind;
    for (const PlanFace& face : plan.rooms[i].faces) {
      const PlanWall& wall = plan.walls[static_cast<std::size_t>(face.wall)];
      if (!wall.outer) continue;

      // The entrance is in the first wall long enough.
      const auto [from, to] = extent(wall, face);
      const Stretch stretch{face.wall, from, to, static_cast<int>(i), -1};
      if (!entrance && (kind == "corridor" || kind == "living") && to - from > 1.3) {
        openings.add_entrance(stretch);
        entrance = true;
      }

      // Windows by the length of the wall.
      for (int k = static_cast<int>((to - from) / 2.4); k > 0; --k) {
        if (rng.chance(kind == "store" || kind == "bath" ? 0.3 : 0.8)) openings.add_window(stretch);
      }
      if (rng.chance(0.15)) openings.add_niche(stretch);
    }
  }

  check_sliding(plan);
  return true;
}

bool connected(const Plan& plan) {
  std::vector<char> reached(plan.rooms.size(), 0);
  reached[0] = 1;

  // Each round reaches one opening farther.
  for (std::size_t round = 0; round < plan.rooms.size(); ++round) {
    for (const PlanOpening& o : plan.openings) {
      if (!o.passable()) continue;
      char &a = reached[static_cast<std::size_t>(o.front)], &b = reached[static_cast<std::size_t>(o.back)];
      a = b = static_cast<char>(a | b);
    }
  }
  return std::all_of(reached.begin(), reached.end(), [](char r) { return r != 0; });
}

bool make_alike(Plan& plan) {
  if (plan.alike.size() < 2) return true;
  const auto room = [&](int index) -> const PlanRoom& { return plan.rooms[static_cast<std::size_t>(index)]; };
  const int first = plan.alike.front(), second = plan.alike[1];
  const auto is_alike = [&](int index) {
    return std::find(plan.alike.begin(), plan.alike.end(), index) != plan.alike.end();
  };

  // Openings of the first room stay in the walls that all of them have.
  const auto common = [&](int wall) {
    const auto has = [&](const PlanFace& face) { return face.wall == wall; };
    return std::any_of(room(first).faces.begin(), room(first).faces.end(), has) &&
           std::any_of(room(second).faces.begin(), room(second).faces.end(), has) &&
           wall != room(first).faces[1].wall && wall != room(first).faces[3].wall;
  };

  // Openings that all rooms alike can have, and those elsewhere.
  std::vector<PlanOpening> kept;
  for (const PlanOpening& o : plan.openings) {
    const bool of_first = o.front == first || o.back == first;
    if (of_first ? common(o.wall) : !is_alike(o.front) && !is_alike(o.back)) kept.push_back(o);
  }

  // Each other room gets copies.
  const std::size_t count = kept.size();
  for (const int other : plan.alike) {
    if (other == first) continue;
    const Vector2d shift = room(other).faces[0].from - room(first).faces[0].from;

    for (std::size_t i = 0; i < count; ++i) {
      PlanOpening o = kept[i];
      if (o.front != first && o.back != first) continue;
      const double along = plan.walls[static_cast<std::size_t>(o.wall)].direction.dot(shift);

      // Moved along the wall to the other room.
      o.from += along;
      o.to += along;
      (o.front == first ? o.front : o.back) = other;
      o.like = static_cast<int>(i);
      kept.push_back(o);
    }
  }

  plan.openings = std::move(kept);
  return connected(plan);
}

}  // namespace plumbline::synth
