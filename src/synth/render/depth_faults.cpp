// SPDX-License-Identifier: BSD-3-Clause
#include "render/depth_faults.hpp"

#include <algorithm>
#include <cmath>

#include "scene/random.hpp"

namespace plumbline::synth {

namespace {

/// Light that goes round by other surfaces, and mirror images: rays from the surface of a pixel.
class Bounces {
 public:
  Bounces(const World& world, const View& view) : world_(world), view_(view) {}

  /// Depth of what a mirror shows, straight on behind it; 0: nothing, or a second mirror.
  [[nodiscard]] float mirrored(int face, int x, int y, float z) const {
    const Spot s = spot(face, x, y, z);
    const Eigen::Vector3d out = s.ray - 2.0 * s.ray.dot(s.normal) * s.normal;
    const Hit hit = world_.cast(s.point, out, 50.0);
    if (hit.face < 0 || world_.materials[static_cast<std::size_t>(hit.face)]->infrared < 0.1F) return 0.0F;
    return static_cast<float>(static_cast<double>(z) * (s.range + hit.distance) / s.range);
  }

  /// Nearness of other surfaces round a spot, 0-1: mean over directions of 1 - distance / 0.5 m. A surface in
  /// a corner of three faces has about 0.5.
  [[nodiscard]] float enclosure(int face, int x, int y, float z) const {
    constexpr double kReach = 0.5;
    constexpr int kRays = 8;
    const Spot s = spot(face, x, y, z);
    const Eigen::Vector3d u = s.normal.unitOrthogonal(), v = s.normal.cross(u);
    double sum = 0.0;
    for (int i = 0; i < kRays; ++i) {
      const double angle = 2.0 * M_PI * (i + 0.5) / kRays, sine = i % 2 == 0 ? 0.45 : 0.85;
      const Eigen::Vector3d d =
          sine * (std::cos(angle) * u + std::sin(angle) * v) + std::sqrt(1.0 - sine * sine) * s.normal;
      sum += 1.0 - world_.free_distance(s.point, d, kReach) / kReach;
    }
    return static_cast<float>(sum / kRays);
  }

 private:
  struct Spot {
    Eigen::Vector3d point;   ///< just above the surface
    Eigen::Vector3d ray;     ///< unit, from the camera
    Eigen::Vector3d normal;  ///< unit, towards the camera
    double range;            ///< m
  };
  [[nodiscard]] Spot spot(int face, int x, int y, float z) const {
    const Eigen::Vector3d p = view_.camera.unproject(x, y, static_cast<double>(z));
    const Eigen::Vector3d ray = view_.world_from_camera.rotation * p.normalized();
    Eigen::Vector3d normal = world_.scene.faces[static_cast<std::size_t>(face)].normal;
    if (normal.dot(ray) > 0.0) normal = -normal;
    return {view_.world_from_camera * p + 1e-3 * normal, ray, normal, p.norm()};
  }
  const World& world_;
  const View& view_;
};

/// Depth that a fault does not lose: with mirror images and light that goes round; 0: nothing comes back.
FaultyDepth lit_depth(const World& world, const View& view, const DepthFaults& faults) {
  constexpr int kCell = 8;  // pixels of a face that share the light of their surroundings
  const Bounces bounces(world, view);
  FaultyDepth out{exact_depth(view), {}};
  cv::Mat1f& depth = out.depth;
  if (faults.mirrors > 0.0) out.mirror = cv::Mat1b::zeros(depth.size());
  std::vector<int> last_face(static_cast<std::size_t>(depth.cols / kCell) + 1);
  std::vector<float> enclosed(last_face.size());

  for (int y = 0; y < depth.rows; ++y) {
    if (y % kCell == 0) std::fill(last_face.begin(), last_face.end(), -1);
    for (int x = 0; x < depth.cols; ++x) {
      const int face = view.ids(y, x);
      float& z = depth(y, x);
      if (face < 0 || !(z > 0.0F)) continue;

      // The surface, and the angle at which it is seen.
      const Material& m = *world.materials[static_cast<std::size_t>(face)];
      const float cosine = incidence(view, face, x, y);
      const bool fixed = static_cast<std::size_t>(face) < world.fixed_faces;
      const float reflectance = m.gloss + (1.0F - m.gloss) * std::pow(1.0F - cosine, 5.0F);  // Schlick

      // Mirrors show the depth of mirror images.
      if (faults.mirrors > 0.0 && fixed && m.gloss >= 0.1F &&
          static_cast<double>(reflectance) > faults.mirrors) {
        z = bounces.mirrored(face, x, y, z);
        out.mirror(y, x) = 1;
        continue;
      }

      // Grazing, dark and glossy surfaces return nothing.
      const bool glint = m.gloss > 0.25F && cosine > 0.995F;
      if (faults.holes > 0.0 && (static_cast<double>(cosine) < faults.holes || m.infrared < 0.1F || glint)) {
        z = 0.0F;
        continue;
      }

      // Light from surrounding surfaces lengthens the path.
      if (faults.multipath > 0.0 && fixed) {
        const auto cell = static_cast<std::size_t>(x / kCell);
        if (last_face[cell] != face) enclosed[cell] = bounces.enclosure(face, x, y, z);
        last_face[cell] = face;
        z += static_cast<float>(faults.multipath) * enclosed[cell];
      }
    }
  }

  return out;
}

/// Pixels at borders become a mean of the depths on both sides.
void let_fly(double share, std::uint64_t bits, cv::Mat1f& depth) {
  const cv::Mat1f before = depth.clone();
  for (int y = 0; y < depth.rows; ++y) {
    Rng rng(bits, 0xf1 + static_cast<std::uint64_t>(y));
    for (int x = 1; x + 1 < depth.cols; ++x) {
      const float left = before(y, x - 1), right = before(y, x + 1);
      if (!(left > 0.0F && right > 0.0F) || std::abs(left - right) < 0.05F + 0.03F * std::min(left, right))
        continue;
      const bool flies = rng.chance(share);
      const auto part = static_cast<float>(rng.uniform());
      if (flies) depth(y, x) = left + part * (right - left);
    }
  }
}

}  // namespace

FaultyDepth faulty_depth(const World& world, const View& view, const DepthFaults& faults,
                         std::uint64_t bits) {
  if (!faults.any()) return {exact_depth(view), {}};
  FaultyDepth out = lit_depth(world, view, faults);
  cv::Mat1f& depth = out.depth;
  if (faults.flying > 0.0) let_fly(faults.flying, bits, depth);

  const double warm = 1.0 - std::exp(-view.time.value_or(0.0) / 60.0);
  const double cx = 0.5 * (depth.cols - 1), cy = 0.5 * (depth.rows - 1);
  for (int y = 0; y < depth.rows; ++y) {
    // Bands 24 rows high, three of them a second past each row.
    const double band = std::sin(2.0 * M_PI * (y / 24.0 + 3.0 * view.time.value_or(0.0)));
    for (int x = 0; x < depth.cols; ++x) {
      float& z = depth(y, x);
      if (!(z > 0.0F)) continue;

      // All factors multiply, the offset adds to inverse depth.
      const double radius2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (cx * cx + cy * cy);
      const double length = view.camera.unproject(x, y, 1.0).norm();
      const double inverse = 1.0 / static_cast<double>(z) + faults.offset;
      const double factor = (1.0 + faults.scale) * (1.0 + faults.radial * radius2) *
                            (1.0 + faults.drift * warm) * (1.0 + faults.stripes * band) *
                            (1.0 + faults.ray * (length - 1.0));
      z = inverse > 0.0 ? static_cast<float>(factor / inverse) : 0.0F;
    }
  }

  return out;
}

}  // namespace plumbline::synth
