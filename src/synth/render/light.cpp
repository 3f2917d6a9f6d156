// SPDX-License-Identifier: BSD-3-Clause
// Soft light and shadows, computed once for a grid of nodes on every face: rectangular lamps with 3 x 3
// shadow rays, and ambient light dimmed by nearby obstacles (obscurance after Zhukov, Iones,
// Kronin 1998).
#include <algorithm>
#include <array>
#include <cmath>

#include "render/world.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;

namespace {

constexpr int kDome = 28;       // directions over a face
constexpr double kReach = 1.6;  // m: obstacles further away do not dim

/// Cosine-weighted directions over +z (Fibonacci spiral).
const std::array<Vector3d, kDome>& dome() {
  static const std::array<Vector3d, kDome> kDirections = [] {
    std::array<Vector3d, kDome> d;
    for (int i = 0; i < kDome; ++i) {
      const double r = std::sqrt((i + 0.5) / kDome), a = 2.399963229728653 * i;
      d[static_cast<std::size_t>(i)] = {r * std::cos(a), r * std::sin(a), std::sqrt(1.0 - r * r)};
    }
    return d;
  }();
  return kDirections;
}

/// Ambient light at a point; negative inside a solid.
double ambient_at(const World& world, const Vector3d& p, const Face& face) {
  double open = 0.0;
  int insides = 0;

  for (const Vector3d& d : dome()) {
    const Vector3d direction = d.x() * face.u_axis + d.y() * face.v_axis + d.z() * face.normal;
    const Hit hit = world.cast(p, direction, kReach);
    if (hit.face >= 0 && !hit.front) ++insides;
    open += std::sqrt((hit.face >= 0 ? hit.distance : kReach) / kReach);
  }

  return insides > kDome / 2 ? -1.0 : open / kDome;
}

/// Gives nodes inside solids the mean of their neighbours, so that walls are not dark along their edges.
void fill_hidden(LightMap& map, std::vector<char>& hidden) {
  for (bool changed = true; changed;) {
    changed = false;
    std::vector<std::pair<std::size_t, float>> found;
    for (int j = 0; j < map.rows; ++j) {
      for (int i = 0; i < map.columns; ++i) {
        const auto at = static_cast<std::size_t>(j * map.columns + i);
        if (hidden[at] == 0) continue;

        // Mean of the known neighbours, at most eight.
        float sum = 0.0F;
        int count = 0;
        for (int y = std::max(0, j - 1); y <= std::min(map.rows - 1, j + 1); ++y) {
          for (int x = std::max(0, i - 1); x <= std::min(map.columns - 1, i + 1); ++x) {
            const auto k = static_cast<std::size_t>(y * map.columns + x);
            if (hidden[k] != 0) continue;
            sum += map.nodes[k];
            ++count;
          }
        }

        if (count > 0) found.emplace_back(at, sum / static_cast<float>(count));
      }
    }

    // Applied together, so that order does not matter.
    for (const auto& [at, value] : found) {
      map.nodes[at] = value;
      hidden[at] = 0;
      changed = true;
    }
  }
}

/// Light of all lamps at a point.
double lamps_at(const World& world, const Vector3d& p, const Face& face) {
  double sum = 0.0;
  for (const Lamp& lamp : world.scene.lamps) {
    const double area = 4.0 * lamp.half_u.norm() * lamp.half_v.norm();
    const Vector3d to_lamp = lamp.center - p;
    const double far2 = to_lamp.squaredNorm();

    // Behind the face, or too faint to be seen.
    if (to_lamp.dot(face.normal) < -1.0 || lamp.power * area < 0.012 * far2) continue;

    const double share = lamp.reach > 0.0 ? far2 / (lamp.reach * lamp.reach) : 0.0;
    if (share >= 1.0) continue;

    double part = 0.0;
    for (int i = -1; i <= 1; ++i) {
      for (int k = -1; k <= 1; ++k) {
        const Vector3d q = lamp.center + 0.66 * (i * lamp.half_u + k * lamp.half_v);
        const Vector3d d = q - p;
        const double r2 = d.squaredNorm(), r = std::sqrt(r2);
        const double cosines = face.normal.dot(d) * -lamp.normal.dot(d) / r2;

        // Behind the surface or the lamp, or too near.
        if (face.normal.dot(d) <= 0.0 || lamp.normal.dot(d) >= 0.0 || r < 0.02) continue;
        if (world.free_distance(p, d / r, r - 0.02) < r - 0.021) continue;
        part += cosines / std::max(r2, 0.05);
      }
    }

    sum += (1.0 - share * share) * lamp.power * area * part / 9.0;
  }

  return 2.2 * sum;
}

LightMap light_face(const World& world, std::size_t index) {
  const Face& face = world.scene.faces[index];
  const Eigen::AlignedBox2d bounds = face.bounds();
  const double u0 = bounds.min().x(), v0 = bounds.min().y();
  const double u1 = bounds.max().x(), v1 = bounds.max().y();
  const double w = std::max(u1 - u0, 1e-4), h = std::max(v1 - v0, 1e-4);

  // At most 80 nodes along a side.
  const double pitch = std::max(world.scene.light_pitch, std::max(w, h) / 80.0);

  LightMap map;
  map.columns = 2 + static_cast<int>(w / pitch);
  map.rows = 2 + static_cast<int>(h / pitch);
  map.u0 = static_cast<float>(u0);
  map.v0 = static_cast<float>(v0);
  map.per_u = static_cast<float>((map.columns - 1) / w);
  map.per_v = static_cast<float>((map.rows - 1) / h);

  std::vector<char> hidden;
  const double inset_u = std::min(0.012, 0.3 * w), inset_v = std::min(0.012, 0.3 * h);

  // Nodes a little inside, away from adjoining faces.
  for (int j = 0; j < map.rows; ++j) {
    for (int i = 0; i < map.columns; ++i) {
      const double u = std::clamp(u0 + i / static_cast<double>(map.per_u), u0 + inset_u, u1 - inset_u);
      const double v = std::clamp(v0 + j / static_cast<double>(map.per_v), v0 + inset_v, v1 - inset_v);
      const Vector3d p = face.at(u, v) + 0.003 * face.normal;
      const double open = ambient_at(world, p, face);
      hidden.push_back(open < 0.0 ? 1 : 0);
      const double ambient = world.scene.ambient * std::max(0.0, open);
      const double glow = static_cast<double>(world.materials[index]->glow);

      // Square root, as textures are encoded.
      map.nodes.push_back(static_cast<float>(std::sqrt(ambient + lamps_at(world, p, face) + glow)));
    }
  }

  fill_hidden(map, hidden);
  return map;
}

}  // namespace

void World::prepare_light() {
  light.prepare(scene.faces.size(), [this](std::size_t i) { return light_face(*this, i); });
}

}  // namespace plumbline::synth
