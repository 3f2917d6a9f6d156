// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "layout/layout.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::Rigid3;

Rigid3 face_frame(const PlanFace& face) {
  const Vector2d e = face.from - face.to;
  return upright({face.to.x(), face.to.y(), 0.0}, std::atan2(e.y(), e.x()));
}

std::optional<std::pair<double, double>> part_of_face(const Plan& plan, int room, const PlanFace& face,
                                                      const PlanOpening& o) {
  if (o.wall != face.wall || (o.front != room && o.back != room)) return std::nullopt;
  const PlanWall& wall = plan.walls[static_cast<std::size_t>(o.wall)];

  // Positions along the face, from its end.
  const Vector2d e = (face.from - face.to).normalized();
  const auto x = [&](double s) { return e.dot(wall.at(s) - face.to); };
  const auto [x0, x1] = std::minmax({x(o.from), x(o.to)});
  if (x0 < 0.0 || x1 > (face.from - face.to).norm()) return std::nullopt;
  return std::make_pair(x0, x1);
}

namespace {

struct Part {
  double x0, x1;
  const PlanOpening* opening;
};

/// Cuts an outline into convex ones along the lines of walls that end at its inward corners.
std::vector<std::vector<Vector2d>> convex_parts(const std::vector<Vector2d>& outline) {
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d &before = outline[(i + n - 1) % n], &at = outline[i];
    const Vector2d d = (at - before).normalized();
    if (cross(d, outline[(i + 1) % n] - at) > -1e-9) continue;

    // The edge that the continued wall meets first.
    double nearest = 1e9;
    std::size_t edge = n;
    for (std::size_t k = 1; k + 1 < n; ++k) {
      const std::size_t j = (i + k) % n;
      const Vector2d &a = outline[j], b = outline[(j + 1) % n];
      const double ca = cross(d, a - at), cb = cross(d, b - at);
      if ((ca > 0.0) == (cb > 0.0)) continue;

      const double reach = d.dot(a + ca / (ca - cb) * (b - a) - at);
      if (reach > 1e-6 && reach < nearest) {
        nearest = reach;
        edge = k;
      }
    }
    if (edge == n) continue;

    // Two parts along the continued wall.
    std::vector<Vector2d> first = {at}, second = {at + nearest * d};
    for (std::size_t k = 1; k <= edge; ++k) first.push_back(outline[(i + k) % n]);
    first.push_back(at + nearest * d);
    for (std::size_t k = edge + 1; k < n; ++k) second.push_back(outline[(i + k) % n]);

    auto parts = convex_parts(first);
    for (auto& part : convex_parts(second)) parts.push_back(std::move(part));
    return parts;
  }

  std::vector<Vector2d> convex;  // without corners on a straight line
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d &before = outline[(i + n - 1) % n], &after = outline[(i + 1) % n];
    if (std::abs(cross(outline[i] - before, after - outline[i])) > 1e-9) convex.push_back(outline[i]);
  }
  return {convex};
}

class Shell {
 public:
  Shell(const Plan& plan, Builder& builder) : plan_(plan), b_(builder) {}

  /// Walls, floor, ceiling and lamps of one room.
  void add_room(int index, Rng& rng) {
    const PlanRoom& room = plan_.rooms[static_cast<std::size_t>(index)];
    const std::string name = fmt::format("{} {}", room.kind, index);
    for (std::size_t i = 0; i < room.faces.size(); ++i) {
      b_.begin_object("wall", fmt::format("wall {} of {}", i, name), mark());
      add_face(index, room.faces[i], i == 0 ? room.accent_material : room.wall_material);
    }

    if (room.kind == "stairs") return;  // floors and lamps are the stairs' own

    // Faces must be convex.
    const auto parts = convex_parts(room.outline());
    for (const bool floor : {true, false}) {
      b_.begin_object(floor ? "floor" : "ceiling", fmt::format("{} of {}", floor ? "floor" : "ceiling", name),
                      mark());
      for (std::vector<Vector2d> part : parts) {
        if (!floor) std::reverse(part.begin(), part.end());

        // Textures continue over all parts.
        std::vector<Vector3d> corners;
        for (const Vector2d& p : part) corners.emplace_back(p.x(), p.y(), floor ? 0.0 : room.height);
        b_.polygon(corners, Vector3d::UnitX(), {floor ? room.floor_material : "ceiling"});
        b_.anchor(b_.scene().faces.back(), Vector3d(0.0, 0.0, corners[0].z()));
      }
    }
    for (const auto& part : parts) add_lamps(part, room, rng);
  }

  /// An opening is built from its front room.
  void add_opening(const PlanOpening& o) {
    for (const PlanFace& face : plan_.rooms[static_cast<std::size_t>(o.front)].faces) {
      const auto part = part_of_face(plan_, o.front, face, o);
      if (!part) continue;
      b_.begin_object("opening", "", mark());
      add_opening(o, face_frame(face), part->first, part->second);
    }
  }

 private:
  [[nodiscard]] core::ConfigMark mark() const {
    core::ConfigMark mark;
    mark.file = fmt::format("{}?layout={}", plan_.kind, plan_.number);
    return mark;
  }

  void quad(const Rigid3& f, const std::vector<Vector3d>& corners, const Skin& skin) {
    std::vector<Vector3d> world;
    for (const Vector3d& p : corners) world.push_back(f * p);
    b_.polygon(world, world[1] - world[0], skin);
  }

  /// A wall's face around its openings.
  void add_face(int room, const PlanFace& face, const std::string& material) {
    // Openings in order along the face.
    std::vector<Part> parts;
    for (const PlanOpening& o : plan_.openings) {
      if (const auto part = part_of_face(plan_, room, face, o))
        parts.push_back({part->first, part->second, &o});
    }
    std::sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.x0 < b.x0; });

    // A rectangle, with skirting if it meets the floor.
    const Rigid3 f = face_frame(face);
    const double length = (face.from - face.to).norm();
    const auto piece = [&](double x0, double x1, double z0, double z1) {
      if (x1 - x0 < 1e-9 || z1 - z0 < 1e-9) return;
      quad(f, {{x0, 0.0, z0}, {x1, 0.0, z0}, {x1, 0.0, z1}, {x0, 0.0, z1}}, {material});
      b_.anchor(b_.scene().faces.back(), f.translation);
      if (z0 > 0.0 || z1 < 0.3) return;

      // Skirting stands out and has an upper side.
      const double out = 0.008, u0 = x0 > 0.0 ? x0 : out, u1 = x1 < length ? x1 : length - out;
      quad(f, {{u0, -out, 0.0}, {u1, -out, 0.0}, {u1, -out, 0.07}, {u0, -out, 0.07}}, {"paint_white"});
      quad(f, {{u0, -out, 0.07}, {u1, -out, 0.07}, {u1, 0.0, 0.07}, {u0, 0.0, 0.07}}, {"paint_white"});
    };

    // Between the openings, below and above them.
    const double height = plan_.rooms[static_cast<std::size_t>(room)].height;
    double x = 0.0;
    for (const Part& part : parts) {
      piece(x, part.x0, 0.0, height);
      piece(part.x0, part.x1, 0.0, part.opening->sill);
      piece(part.x0, part.x1, part.opening->head, height);
      if (part.opening->kind == OpeningKind::kDoor || part.opening->kind == OpeningKind::kWindow)
        add_casing(f, part);
      x = part.x1;
    }

    // The rest of the face.
    piece(x, length, 0.0, height);
  }

  /// Boards on the wall around an opening; they leave its width free.
  void add_casing(const Rigid3& f, const Part& part) {
    const double board = 0.06, out = -0.015, z0 = part.opening->sill, z1 = part.opening->head;
    b_.box(f, {part.x0 - board, out, z0}, {part.x0, 0.0, z1 + board}, {"paint_white"});
    b_.box(f, {part.x1, out, z0}, {part.x1 + board, 0.0, z1 + board}, {"paint_white"});
    b_.box(f, {part.x0, out, z1}, {part.x1, 0.0, z1 + board}, {"paint_white"});
    if (part.opening->kind != OpeningKind::kWindow) return;
    b_.box(f, {part.x0 - board, -0.09, z0 - 0.03}, {part.x1 + board, 0.0, z0}, {"paint_white"});
  }

  /// The space between the jambs, to a depth of y, and the leaf or the glass in it.
  void add_opening(const PlanOpening& o, const Rigid3& f, double x0, double x1) {
    const PlanRoom& room = plan_.rooms[static_cast<std::size_t>(o.front)];
    const bool framed = o.kind == OpeningKind::kDoor || o.kind == OpeningKind::kWindow;
    const std::string jamb = framed ? "paint_white" : room.wall_material;
    const double y = o.kind == OpeningKind::kWindow ? 0.5 * o.depth : o.depth, z0 = o.sill, z1 = o.head;

    // Both jambs, sill and head.
    quad(f, {{x0, 0.0, z0}, {x0, y, z0}, {x0, y, z1}, {x0, 0.0, z1}}, {jamb});
    quad(f, {{x1, y, z0}, {x1, 0.0, z0}, {x1, 0.0, z1}, {x1, y, z1}}, {jamb});
    quad(f, {{x0, 0.0, z0}, {x1, 0.0, z0}, {x1, y, z0}, {x0, y, z0}},
         {z0 > 0.0 ? jamb : std::string(room.floor_material)});
    quad(f, {{x0, y, z1}, {x1, y, z1}, {x1, 0.0, z1}, {x0, 0.0, z1}}, {jamb});

    // A niche has a back.
    const bool ends_there = o.back < 0 && o.kind != OpeningKind::kWindow;
    if (ends_there) quad(f, {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}}, {jamb});

    // Glass and leaves are those of scene files.
    Wall wall;
    wall.thickness = o.depth;
    Opening part;
    part.at = x0;
    part.width = x1 - x0;
    part.bottom = z0;
    part.height = z1 - z0;
    part.open_rad = o.open_rad;

    // Coordinates of scene files begin in the wall's middle.
    const Rigid3 middle = placed(f, {0.0, 0.5 * o.depth, 0.0}, {0.0, Vector3d::UnitZ()});
    if (o.kind == OpeningKind::kWindow) add_glass(b_, middle, part);
    if (o.leaf == Leaf::kSliding) {
      b_.box(f, {x0 + 0.85 * part.width, -0.05, 0.01}, {x1 + 0.85 * part.width, -0.017, z1 + 0.02},
             {"door", true});
    } else if (o.leaf != Leaf::kNone) {
      add_leaf(b_, middle, wall, part);
    }
  }

  /// One lamp for each 12 m^2 or so.
  void add_lamps(const std::vector<Vector2d>& part, const PlanRoom& room, Rng& rng) {
    Eigen::AlignedBox2d box;
    for (const Vector2d& p : part) box.extend(p);
    const Vector2d size = box.sizes();
    if (signed_area(part) < 1.5) return;
    const double share = 3.6;
    const int nx = std::max(1, static_cast<int>(std::lround(size.x() / share)));
    const int ny = std::max(1, static_cast<int>(std::lround(size.y() / share)));
    const double side = rng.uniform(0.3, 0.7), power = 0.24 * signed_area(part) / (nx * ny * side * side);

    for (int i = 0; i < nx * ny; ++i) {
      const Vector2d at =
          box.min() + Vector2d((i % nx + 0.5) / nx * size.x(), (i / nx + 0.5) / ny * size.y());
      b_.begin_object("lamp", "", mark());
      add_ceiling_lamp(b_, upright({at.x(), at.y(), room.height}, 0.0), side, side, power);
    }
  }

  const Plan& plan_;
  Builder& b_;
};

}  // namespace

void build_shell(const Plan& plan, Rng& rng, Builder& builder) {
  Shell shell(plan, builder);
  std::vector<Face>& faces = builder.scene().faces;
  const auto adopt = [&](std::size_t from, std::size_t to) {  // the textures of what is the same
    for (std::size_t i = to; i < faces.size(); ++i) faces[i].seed = faces[from + i - to].seed;
  };

  // Rooms alike repeat the first one's random numbers.
  std::size_t first = 0;
  Rng first_rng = rng;
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    const bool like =
        std::find(plan.alike.begin(), plan.alike.end(), static_cast<int>(i)) != plan.alike.end();
    const bool copy = like && static_cast<int>(i) != plan.alike.front();
    const std::size_t begin = faces.size();

    if (like && !copy) {
      first = begin;
      first_rng = rng;
    }
    Rng same = first_rng;
    shell.add_room(static_cast<int>(i), copy ? same : rng);

    if (copy) adopt(first, begin);
  }

  // Openings alike repeat textures.
  std::vector<std::size_t> begins;
  for (const PlanOpening& o : plan.openings) {
    begins.push_back(faces.size());
    shell.add_opening(o);
    if (o.like >= 0) adopt(begins[static_cast<std::size_t>(o.like)], begins.back());
  }
}

}  // namespace plumbline::synth
