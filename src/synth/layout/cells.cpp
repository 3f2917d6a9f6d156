// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "layout/layout.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;

namespace {

constexpr double kLeastSide = 2.0;  // m between the middles of a room's walls

Cell& cell(Subdivision& s, int index) { return s.cells[static_cast<std::size_t>(index)]; }

double inner_wall(Rng& rng) { return rng.pick(std::vector<double>{0.08, 0.1, 0.115, 0.14, 0.175, 0.24}); }

/// Cuts across the axis 0 (x) or 1 (y) at a coordinate; one wall in ten is not square to the others.
std::optional<int> cut(Subdivision& s, int index, int axis, double at, Rng& rng, bool may_tilt = true) {
  Vector2d point = s.bounds(cell(s, index)).center();
  point[axis] = at;
  const double tilt =
      may_tilt && rng.chance(0.1) ? rng.uniform(0.06, 0.2) * (rng.chance(0.5) ? 1.0 : -1.0) : 0.0;
  const double angle = (axis == 0 ? 0.5 * M_PI : M_PI) + tilt;
  // On the left of the line is what has the smaller coordinate.
  return s.split(index, point, {std::cos(angle), std::sin(angle)}, inner_wall(rng));
}

/// Cuts a cell in two again and again until its parts are about as large as rooms are.
void divide(Subdivision& s, int index, double least, double most, Rng& rng) {
  const Eigen::AlignedBox2d box = s.bounds(cell(s, index));
  const Vector2d size = box.sizes();
  const int axis = size.x() > size.y() * rng.uniform(0.8, 1.25) ? 0 : 1;
  const double room = std::max({kLeastSide, 5.4 / size[1 - axis], 0.3 * size[axis]});
  if (s.area(cell(s, index)) < rng.uniform(least, most) || size[axis] < 2.0 * room) return;

  const auto other = cut(s, index, axis, box.min()[axis] + rng.uniform(room, size[axis] - room), rng);
  if (!other) return;
  divide(s, index, least, most, rng);
  divide(s, *other, least, most, rng);
}

/// Makes pairs of small neighbours one room, most of them L-shaped.
void merge_some(Subdivision& s, double share, double most_area, Rng& rng) {
  const int count = static_cast<int>(s.cells.size());
  for (int i = 0; i < count; ++i) {
    if (cell(s, i).points.empty() || !cell(s, i).kind.empty() || !rng.chance(share)) continue;
    const int other = rng.integer(0, count - 1);
    for (int k = 0; k < count; ++k) {
      const int j = (other + k) % count;
      if (j == i || cell(s, j).points.empty() || !cell(s, j).kind.empty()) continue;
      if (s.area(cell(s, i)) + s.area(cell(s, j)) < most_area && s.merge(i, j)) break;
    }
  }
}

Subdivision draw_home(Rng& rng) {
  Subdivision s({rng.uniform(6.5, 14.0), rng.uniform(6.0, 10.5)}, rng.uniform(0.24, 0.42));
  const Vector2d size = s.bounds(s.cells[0]).sizes();
  std::vector<int> parts = {0};

  if (rng.chance(0.55)) {  // a hallway from side to side
    const double width = rng.uniform(1.35, 2.1), y = rng.uniform(2.8, size.y() - 2.8 - width);
    if (const auto low = cut(s, 0, 1, y + width, rng, false)) {
      parts.push_back(*low);
      if (const auto lowest = cut(s, *low, 1, y, rng, false)) parts.back() = *lowest;
      cell(s, *low).kind = "corridor";
    }
  }

  const double most = rng.uniform(12.0, 36.0);
  for (const int part : parts) divide(s, part, 6.0, most, rng);

  // A corner of the rectangle that does not belong to the home.
  if (s.cells.size() > 5 && rng.chance(0.35)) {
    Cell& corner = s.cells.back();
    if (corner.kind.empty() && s.area(corner) < 20.0) corner.kind = "outside";
  }
  merge_some(s, 0.15, 55.0, rng);
  return s;
}

/// Rooms side by side along a strip.
void slice(Subdivision& s, int index, double least, double most, Rng& rng) {
  while (true) {
    const Eigen::AlignedBox2d box = s.bounds(cell(s, index));
    const double width = std::min(rng.uniform(least, most), 52.0 / box.sizes().y());
    if (box.sizes().x() < width + least) return;
    const auto left = cut(s, index, 0, box.min().x() + width, rng);
    if (!left) return;
  }
}

/// Makes neighbours in a strip one hall of up to 20 m.
void make_hall(Subdivision& s, Rng& rng) {
  const int count = static_cast<int>(s.cells.size());
  int hall = -1;
  for (int i = rng.integer(0, count - 1), steps = 0; steps < 2 * count; ++steps, i = (i + 1) % count) {
    if (cell(s, i).points.empty() || !(cell(s, i).kind.empty() || i == hall)) continue;
    if (hall < 0) {
      hall = i;
      cell(s, i).kind = "hall";
      continue;
    }
    Eigen::AlignedBox2d both = s.bounds(cell(s, hall));
    both.extend(s.bounds(cell(s, i)));
    if (i != hall && both.sizes().maxCoeff() < 20.0 && both.sizes().minCoeff() < 7.5) s.merge(hall, i);
  }
}

/// Cuts off `alike` rooms of one width, and one before them that keeps them from the outer wall.
void slice_alike(Subdivision& s, int index, int alike, Rng& rng) {
  const Eigen::AlignedBox2d box = s.bounds(cell(s, index));
  const double width = std::min(rng.uniform(3.0, 4.2), (box.sizes().x() - 6.0) / alike);
  const double thickness = inner_wall(rng), first = box.min().x() + rng.uniform(2.6, 3.0);
  for (int i = 0; alike > 1 && i <= alike; ++i) {
    const auto left = s.split(index, {first + i * width, box.center().y()}, Vector2d::UnitY(), thickness);
    if (left && i > 0) cell(s, *left).kind = "alike";
  }
}

/// Cuts off a hall of 20 m between its walls, which begins at the outer wall.
void cut_hall(Subdivision& s, int index, Rng& rng) {
  const Eigen::AlignedBox2d box = s.bounds(cell(s, index));
  const auto hall =
      s.split(index, {box.min().x() + 20.4, box.center().y()}, Vector2d::UnitY(), inner_wall(rng));
  if (hall) cell(s, *hall).kind = "hall";
}

Subdivision draw_office(int alike, bool hall, Rng& rng) {
  const double corridor = rng.uniform(1.5, 2.6), low = rng.uniform(3.6, 6.5);
  const double high = hall ? rng.uniform(6.5, 9.5) : rng.uniform(3.6, 6.5);
  const double length =
      std::max({rng.uniform(16.0, 30.0), alike > 1 ? 6.5 + 3.2 * alike : 0.0, hall ? 24.5 : 0.0});

  // Rooms on both sides of a corridor.
  Subdivision s({length, low + corridor + high}, rng.uniform(0.28, 0.45));
  const int middle = cut(s, 0, 1, low + corridor, rng, false).value_or(0);
  const int lowest = cut(s, middle, 1, low, rng, false).value_or(0);
  cell(s, middle).kind = "corridor";

  // Special rooms are cut off first.
  if (alike > 1) slice_alike(s, 0, alike, rng);
  if (hall) cut_hall(s, 0, rng);
  slice(s, 0, 2.4, rng.uniform(5.0, 9.0), rng);
  slice(s, lowest, 2.4, rng.uniform(5.0, 9.0), rng);
  if (!hall && rng.chance(0.35)) make_hall(s, rng);
  merge_some(s, 0.1, 58.0, rng);
  return s;
}

/// Corridors around blocks of rooms: a ring, a ladder or a comb.
Subdivision draw_corridors(Rng& rng) {
  const int blocks = rng.integer(1, 3);
  const double corridor = rng.uniform(1.4, 2.4), block = rng.uniform(4.5, 9.0), depth = rng.uniform(4.5, 9.0);
  const bool comb = blocks > 1 && rng.chance(0.3);
  const double width = blocks * block + (blocks + 1) * corridor;
  Subdivision s({width, depth + (comb ? 1.0 : 2.0) * corridor}, rng.uniform(0.24, 0.4));

  // Corridors along the blocks.
  int middle = 0;
  if (!comb) {
    middle = cut(s, 0, 1, depth + corridor, rng, false).value_or(0);
    cell(s, 0).kind = "corridor";
  }
  const int lowest = cut(s, middle, 1, corridor, rng, false).value_or(0);
  cell(s, lowest).kind = "corridor";

  // From left to right: corridor, block, corridor, ...
  double x = 0.0;
  for (int i = 0; i < 2 * blocks; ++i) {
    x += i % 2 == 0 ? corridor : block;
    const auto left = cut(s, middle, 0, x, rng, false);
    if (!left) break;

    if (i % 2 == 0) {
      cell(s, *left).kind = "corridor";
    } else {
      divide(s, *left, 12.0, 40.0, rng);
    }
  }

  cell(s, middle).kind = "corridor";
  return s;
}

}  // namespace

Subdivision draw_cells(const std::string& kind, int alike, bool hall, Rng& rng) {
  if (kind == "home") return draw_home(rng);
  return kind == "office" ? draw_office(alike, hall, rng) : draw_corridors(rng);
}

namespace {

/// Rooms side by side along a strip, so many of them.
void slice_into(Subdivision& s, int index, int count, Rng& rng) {
  for (; count > 1; --count) {
    const Eigen::AlignedBox2d box = s.bounds(cell(s, index));
    cut(s, index, 0, box.min().x() + box.sizes().x() / count * rng.uniform(0.75, 1.25), rng);
  }
}

}  // namespace

Subdivision draw_storey(const BuildingFrame& frame, int rooms, int alike, bool hall, Rng& rng) {
  Subdivision s(frame.size, frame.outer);
  constexpr double kThickness = 0.24;
  const auto level = [&](int index, double y) {
    return s.split(index, {0.0, y}, -Vector2d::UnitX(), kThickness).value_or(0);
  };

  // A corridor between two rows of rooms.
  const int middle = level(0, frame.low + frame.corridor);
  const int lowest = level(middle, frame.low);
  cell(s, middle).kind = "corridor";

  // Stairs at one end of the lower row.
  const int stairs = s.split(lowest, {frame.stairs, 0.0}, Vector2d::UnitY(), kThickness).value_or(0);
  cell(s, stairs).kind = "stairs";

  // The upper row gets the larger half.
  const int high = std::max((rooms + 1) / 2, alike > 1 ? alike + 2 : 0);
  if (alike > 1) slice_alike(s, 0, alike, rng);
  if (hall) cut_hall(s, 0, rng);
  const int taken = alike > 1 ? alike + 1 : hall ? static_cast<int>(high * 20.4 / frame.size.x()) : 0;
  slice_into(s, 0, high - taken, rng);
  slice_into(s, lowest, std::max(1, rooms - high), rng);
  if (alike < 2 && !hall && rng.chance(0.5)) make_hall(s, rng);
  return s;
}

namespace {

/// The kind of a room of so many square metres.
std::string room_kind(const std::string& world, double area, bool largest, Rng& rng) {
  using Kinds = std::vector<std::string>;
  if (world != "home") {
    if (area < 9.0) return rng.pick(Kinds{"store", "bath", "kitchen", "office"});
    return area < 28.0 ? rng.pick(Kinds{"office", "office", "office", "meeting", "kitchen"})
                       : rng.pick(Kinds{"office", "meeting"});
  }
  if (largest) return "living";
  if (area < 6.5) return rng.pick(Kinds{"bath", "bath", "store"});
  return area < 24.0 ? rng.pick(Kinds{"bedroom", "bedroom", "kitchen", "study"})
                     : rng.pick(Kinds{"living", "bedroom", "kitchen"});
}

std::string floor_of(const std::string& kind, Rng& rng) {
  using Floors = std::vector<std::string>;
  if (kind == "bath" || kind == "kitchen") return rng.pick(Floors{"tiles", "tiles", "lino"});
  if (kind == "corridor" || kind == "hall" || kind == "store")
    return rng.pick(Floors{"tiles", "lino", "planks"});
  return rng.pick(Floors{"planks", "planks", "carpet"});
}

}  // namespace

bool add_rooms(const Subdivision& cells, Rng& rng, Plan& plan) {
  plan.walls = cells.walls;
  const double storey = plan.kind == "home" ? rng.uniform(2.35, 3.1) : rng.uniform(2.5, 3.4);

  std::size_t largest = 0;
  for (const Cell& cell : cells.cells) {
    if (cell.points.empty() || cell.kind == "outside") continue;
    const auto faces = cells.faces(cell);
    if (!faces) return false;

    // The largest room without a kind.
    PlanRoom room;
    room.faces = *faces;
    room.kind = cell.kind;
    plan.rooms.push_back(room);
    if (room.kind.empty() && (plan.rooms[largest].area() < room.area() || !plan.rooms[largest].kind.empty()))
      largest = plan.rooms.size() - 1;
  }

  // Like rooms begin with the outer wall, so that their faces correspond.
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    PlanRoom& room = plan.rooms[i];
    if (room.kind != "alike") continue;
    const auto outer = std::min_element(room.faces.begin(), room.faces.end(),
                                        [](const PlanFace& a, const PlanFace& b) { return a.wall < b.wall; });
    std::rotate(room.faces.begin(), outer, room.faces.end());
    plan.alike.push_back(static_cast<int>(i));
  }

  const std::string usual = rng.pick(std::vector<std::string>{"plaster", "plaster", "paint_white"});
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    PlanRoom& room = plan.rooms[i];
    const double area = room.area();
    const bool limited = room.kind.empty();

    if (area < 4.0 && limited) return false;
    if (area > 60.0 && limited) return false;
    if (limited || room.kind == "alike") room.kind = room_kind(plan.kind, area, i == largest, rng);

    room.height = rng.chance(0.3) ? std::max(2.3, storey - rng.uniform(0.1, 0.4)) : storey;
    room.floor_material = floor_of(room.kind, rng);

    // Materials, often the usual ones.
    static const std::vector<std::string> kWalls = {"plaster", "paint_blue", "paint_green", "paint_grey"};
    room.wall_material = rng.chance(0.55) ? usual : rng.pick(kWalls);
    room.accent_material = rng.chance(0.25)
                               ? rng.pick(std::vector<std::string>{"brick", "wood", "poster_wall"})
                               : room.wall_material;
  }

  // Rooms alike are copies but for their place.
  for (const int like : plan.alike) {
    PlanRoom &room = plan.rooms[static_cast<std::size_t>(like)],
             copy = plan.rooms[static_cast<std::size_t>(plan.alike.front())];
    copy.faces = room.faces;
    room = copy;
  }

  return plan.rooms.size() > 1;
}

}  // namespace plumbline::synth
