// SPDX-License-Identifier: BSD-3-Clause
#include "scene/builder.hpp"

#include <fmt/format.h>

#include <cmath>

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::Rigid3;

Rigid3 upright(const Vector3d& origin, double yaw_rad) {
  Rigid3 frame;
  frame.rotation = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  frame.translation = origin;
  return frame;
}

Rigid3 placed(const Rigid3& frame, const Vector3d& at, const Eigen::AngleAxisd& turn) {
  return {Eigen::Matrix3d(frame.rotation * turn.toRotationMatrix()), frame * at};
}

Eigen::AlignedBox2d Face::bounds() const {
  Eigen::AlignedBox2d box;
  for (const Vector2d& uv : polygon) box.extend(uv);
  return box;
}

bool Face::contains(const Vector2d& uv, double slack) const {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if ((b - a).x() * (uv - a).y() - (b - a).y() * (uv - a).x() < -slack) return false;
  }
  return true;
}

void Builder::begin_object(const std::string& type, const std::string& name, const core::ConfigMark& mark) {
  Object object;
  object.type = type;
  object.name = name.empty() ? fmt::format("{} {}", type, scene_.objects.size() + 1) : name;
  object.mark = mark;
  scene_.objects.push_back(std::move(object));
  seed_ = static_cast<int>(scene_.objects.size());
}

void Builder::polygon(const std::vector<Vector3d>& corners, const Vector3d& u_hint, const Skin& skin) {
  Face face;
  face.normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  face.u_axis = (u_hint - u_hint.dot(face.normal) * face.normal).normalized();
  face.v_axis = face.normal.cross(face.u_axis);
  face.origin = corners[0];

  // Corners in the plane of the face.
  for (const Vector3d& corner : corners) {
    const Vector3d d = corner - face.origin;
    face.polygon.emplace_back(d.dot(face.u_axis), d.dot(face.v_axis));
  }

  const Eigen::AlignedBox2d bounds = face.bounds();
  // Texture coordinates count from the lower left corner of the polygon's bounding rectangle.
  face.origin = face.at(bounds.min().x(), bounds.min().y());

  for (Vector2d& uv : face.polygon) uv -= bounds.min();
  face.material = skin.material;
  face.seed = skin.seed >= 0 ? skin.seed : seed_;

  // Prints cover the whole face.
  if (skin.stretched) {
    face.stretch_u = bounds.sizes().x();
    face.stretch_v = bounds.sizes().y();
  }

  face.object = static_cast<int>(scene_.objects.size()) - 1;
  scene_.faces.push_back(std::move(face));
}

void Builder::anchor(Face& face, const Vector3d& foot) {
  const Vector3d d = foot - face.origin;
  const Vector2d shift(d.dot(face.u_axis), d.dot(face.v_axis));
  face.origin = face.at(shift.x(), shift.y());
  for (Vector2d& uv : face.polygon) uv -= shift;
}

void Builder::box(const Rigid3& f, const Vector3d& lo, const Vector3d& hi, const Skin& skin,
                  const Skin* front) {
  // Corners by their end of each axis: 0 low, 1 high.
  const auto p = [&](int x, int y, int z) {
    return f * Vector3d(x ? hi.x() : lo.x(), y ? hi.y() : lo.y(), z ? hi.z() : lo.z());
  };
  const Vector3d ux = f.rotation.col(0), uy = f.rotation.col(1);
  polygon({p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)}, ux,
          front != nullptr ? *front : skin);                             // front, -y
  polygon({p(1, 1, 0), p(0, 1, 0), p(0, 1, 1), p(1, 1, 1)}, -ux, skin);  // back, +y
  polygon({p(0, 1, 0), p(0, 0, 0), p(0, 0, 1), p(0, 1, 1)}, -uy, skin);  // left, -x
  polygon({p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1)}, uy, skin);   // right, +x
  polygon({p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)}, ux, skin);   // top, +z
  polygon({p(0, 1, 0), p(1, 1, 0), p(1, 0, 0), p(0, 0, 0)}, ux, skin);   // bottom, -z
}

void Builder::cylinder(const Rigid3& f, const Cylinder& of, const Skin& skin) {
  const auto ring = [&](int i, double r, double z) {
    const double angle = 2.0 * M_PI * i / of.segments;
    return Vector3d(f * (of.bottom + Vector3d(r * std::cos(angle), r * std::sin(angle), z)));
  };

  // Sides, collecting both rims.
  std::vector<Vector3d> top, foot;
  for (int i = 0; i < of.segments; ++i) {
    const Vector3d a = ring(i, of.radius, 0.0), b = ring(i + 1, of.radius, 0.0);
    const Vector3d c = ring(i + 1, of.top_radius, of.height), d = ring(i, of.top_radius, of.height);
    polygon({a, b, c, d}, b - a, skin);
    top.push_back(d);
    foot.insert(foot.begin(), a);
  }

  // Polygons close both ends.
  const Vector3d u = f.rotation.col(0);
  polygon(top, u, skin);
  polygon(foot, u, skin);
}

}  // namespace plumbline::synth
