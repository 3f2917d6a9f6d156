// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "scene/builder.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;
using geometry::Rigid3;

namespace {

/// A rectangle of a wall, m along it and above its foot.
struct WallPiece {
  double x0, x1, z0, z1;
};

/// One solid piece of a wall; texture coordinates count from the wall's foot, so pieces continue each other.
void add_piece(Builder& b, const Rigid3& frame, const Wall& wall, const WallPiece& piece) {
  const auto [x0, x1, z0, z1] = piece;
  if (x1 - x0 < 1e-6 || z1 - z0 < 1e-6) return;
  const double half = 0.5 * wall.thickness;
  const std::size_t first = b.scene().faces.size();
  b.box(frame, {x0, -half, z0}, {x1, half, z1}, {wall.material});

  // Textures continue across openings.
  const double length = (wall.to - wall.from).norm();
  for (std::size_t i = first; i < b.scene().faces.size(); ++i) {
    Face& face = b.scene().faces[i];
    const Vector3d foot =
        i == first + 1 ? frame * Vector3d(length, half, 0.0) : frame * Vector3d(0.0, -half, 0.0);
    Builder::anchor(face, foot);
  }

  // Skirting only at the floor.
  if (!wall.skirting.empty() && z0 < 1e-6) {
    const double out = half + 0.012;
    b.box(frame, {x0, -out, z0}, {x1, out, z0 + 0.08}, {wall.skirting});
  }
}

void add_frame(Builder& b, const Rigid3& frame, const Wall& wall, const Opening& o,
               const std::string& material) {
  const double half = 0.5 * wall.thickness + 0.015, bar = 0.05;
  const double x0 = o.at, x1 = o.at + o.width, z0 = o.bottom, z1 = o.bottom + o.height;
  b.box(frame, {x0 - bar, -half, z0}, {x0 + 0.01, half, z1 + bar}, {material});
  b.box(frame, {x1 - 0.01, -half, z0}, {x1 + bar, half, z1 + bar}, {material});
  b.box(frame, {x0, -half, z1 - 0.01}, {x1, half, z1 + bar}, {material});

  // A sill that stands out.
  if (o.window)
    b.box(frame, {x0 - bar, -half - 0.08, z0 - 0.04}, {x1 + bar, half + 0.02, z0 + 0.01}, {material});
}

}  // namespace

void add_glass(Builder& b, const Rigid3& frame, const Opening& o) {
  const double x0 = o.at, x1 = o.at + o.width, z0 = o.bottom, z1 = o.bottom + o.height;
  const Skin view{"window_view", true};
  b.box(frame, {x0, -0.01, z0}, {x1, 0.01, z1}, view, &view);
  const double xm = 0.5 * (x0 + x1);
  b.box(frame, {xm - 0.03, -0.03, z0}, {xm + 0.03, 0.03, z1}, {"paint_white"});

  // Daylight, from slightly inside.
  Lamp lamp;
  lamp.center = frame * Vector3d(xm, -0.05, 0.5 * (z0 + z1));
  lamp.half_u = frame.rotation * Vector3d(0.5 * o.width, 0.0, 0.0);
  lamp.half_v = frame.rotation * Vector3d(0.0, 0.0, 0.5 * o.height);
  lamp.normal = frame.rotation * Vector3d(0.0, -1.0, 0.0);
  lamp.power = 1.1;
  b.scene().lamps.push_back(lamp);
}

void add_leaf(Builder& b, const Rigid3& frame, const Wall& wall, const Opening& o) {
  if (o.open_rad < 0.0) return;
  const Rigid3 hinge =
      placed(frame, {o.at + 0.01, -0.5 * wall.thickness, o.bottom}, {-o.open_rad, Vector3d::UnitZ()});
  const double w = o.width - 0.02, h = o.height - 0.02;
  const Skin leaf{o.material, true};
  const std::size_t first = b.scene().faces.size();
  b.box(hinge, {0.0, 0.0, 0.01}, {w, 0.04, h}, leaf, &leaf);

  // Handles on both sides.
  for (const double y : {-0.05, 0.04})
    b.box(hinge, {w - 0.14, y, 1.02}, {w - 0.03, y + 0.05, 1.05}, {"metal"});
  b.scene().leaves.push_back({first, b.scene().faces.size() - first, hinge.translation, o.open_rad});
}

void add_wall(Builder& b, const Wall& wall) {
  const Eigen::Vector2d along = wall.to - wall.from;
  const Rigid3 frame = upright({wall.from.x(), wall.from.y(), wall.bottom}, std::atan2(along.y(), along.x()));

  // Around the openings.
  double x = 0.0;
  for (const Opening& o : wall.openings) {
    add_piece(b, frame, wall, {x, o.at, 0.0, wall.height});
    add_piece(b, frame, wall, {o.at, o.at + o.width, 0.0, o.bottom});
    add_piece(b, frame, wall, {o.at, o.at + o.width, o.bottom + o.height, wall.height});
    x = o.at + o.width;
  }

  add_piece(b, frame, wall, {x, along.norm(), 0.0, wall.height});

  // Frames, glass and leaves.
  for (const Opening& o : wall.openings) {
    add_frame(b, frame, wall, o, "paint_white");
    if (o.window) {
      add_glass(b, frame, o);
    } else {
      add_leaf(b, frame, wall, o);
    }
  }
}

namespace {
/// Half the thickness to the left of corner `i`, along the bisector of the angle.
Eigen::Vector2d mitre(const std::vector<Eigen::Vector2d>& points, std::size_t i, double half) {
  const auto left = [](const Eigen::Vector2d& d) { return Eigen::Vector2d(-d.y(), d.x()).normalized(); };
  const bool first = i == 0, last = i + 1 == points.size();
  const Eigen::Vector2d before = left(points[first ? 1 : i] - points[first ? 0 : i - 1]);
  const Eigen::Vector2d after = left(points[last ? i : i + 1] - points[last ? i - 1 : i]);
  const Eigen::Vector2d middle = (before + after).normalized();
  return half / std::max(0.2, middle.dot(before)) * middle;
}
}  // namespace

void add_zigzag_panel(Builder& b, const Wall& wall, const std::vector<Eigen::Vector2d>& points,
                      std::size_t index) {
  const double half = 0.5 * wall.thickness;
  const Eigen::Vector2d a = points[index], c = points[index + 1];
  const Eigen::Vector2d ma = mitre(points, index, half), mc = mitre(points, index + 1, half);
  const auto lift = [](const Eigen::Vector2d& p, double z) { return Vector3d(p.x(), p.y(), z); };
  const double z0 = wall.bottom, z1 = wall.bottom + wall.height;
  const Vector3d u = lift(c - a, 0.0);
  const Skin skin{wall.material};

  // Both sides, top and bottom.
  b.polygon({lift(a - ma, z0), lift(c - mc, z0), lift(c - mc, z1), lift(a - ma, z1)}, u, skin);
  b.polygon({lift(c + mc, z0), lift(a + ma, z0), lift(a + ma, z1), lift(c + mc, z1)}, -u, skin);
  b.polygon({lift(a - ma, z1), lift(c - mc, z1), lift(c + mc, z1), lift(a + ma, z1)}, u, skin);
  b.polygon({lift(a + ma, z0), lift(c + mc, z0), lift(c - mc, z0), lift(a - ma, z0)}, u, skin);

  // Only ends of the whole row are visible.
  if (index == 0)
    b.polygon({lift(a + ma, z0), lift(a - ma, z0), lift(a - ma, z1), lift(a + ma, z1)}, lift(-ma, 0.0), skin);
  if (index + 2 == points.size()) {
    b.polygon({lift(c - mc, z0), lift(c + mc, z0), lift(c + mc, z1), lift(c - mc, z1)}, lift(mc, 0.0), skin);
  }
}

}  // namespace plumbline::synth
