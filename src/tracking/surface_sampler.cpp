// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/surface_sampler.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::tracking {
namespace {

/// Depth at half resolution, averaged over up to 6 x 6 pixels of one surface.
struct HalfDepth {
  int width = 0;
  int height = 0;
  std::vector<float> z;
  [[nodiscard]] float at(int x, int y) const { return z[static_cast<std::size_t>(y * width + x)]; }
};

/// Largest difference between depths of one surface at depth `z`, metres.
float same_surface(float z) { return 0.01F * z + 4.0F * static_cast<float>(sensor::depth_sigma(z)); }

/// Mean of the valid values within (2 * radius + 1)^2 that belong to the surface at the middle.
template <typename Read>
float surface_mean(const Read& read, int x, int y, int width, int height, int radius) {
  const float centre = read(x, y);
  if (!(centre > 0.0F)) return 0.0F;
  const float tolerance = same_surface(centre);
  float sum = 0.0F;
  int count = 0;
  for (int v = std::max(0, y - radius); v <= std::min(height - 1, y + radius); ++v) {
    for (int u = std::max(0, x - radius); u <= std::min(width - 1, x + radius); ++u) {
      const float z = read(u, v);
      if (z > 0.0F && std::abs(z - centre) < tolerance) {
        sum += z;
        ++count;
      }
    }
  }
  return sum / static_cast<float>(count);
}

HalfDepth half_depth(const cv::Mat& depth) {
  HalfDepth raw;
  raw.width = depth.cols / 2;
  raw.height = depth.rows / 2;
  raw.z.assign(static_cast<std::size_t>(raw.width * raw.height), 0.0F);

  for (int y = 0; y < raw.height; ++y) {
    const float* r0 = depth.ptr<float>(2 * y);
    const float* r1 = depth.ptr<float>(2 * y + 1);
    for (int x = 0; x < raw.width; ++x) {
      const std::array<float, 4> q{r0[2 * x], r0[2 * x + 1], r1[2 * x], r1[2 * x + 1]};
      float sum = 0.0F;
      int count = 0;
      float low = 1e9F;
      float high = 0.0F;

      for (float v : q) {
        if (!(v > 0.0F)) continue;
        sum += v;
        ++count;
        low = std::min(low, v);
        high = std::max(high, v);
      }

      // No mean across a depth border
      if (count >= 2 && high - low < same_surface(low)) {
        raw.z[static_cast<std::size_t>(y * raw.width + x)] = sum / static_cast<float>(count);
      }
    }
  }

  // Smoothed among neighbours on the same surface
  HalfDepth smooth = raw;
  const auto read = [&raw](int x, int y) { return raw.at(x, y); };
  for (int y = 0; y < raw.height; ++y) {
    for (int x = 0; x < raw.width; ++x) {
      smooth.z[static_cast<std::size_t>(y * raw.width + x)] =
          surface_mean(read, x, y, raw.width, raw.height, 1);
    }
  }

  return smooth;
}

/// Distance (in pixels of HalfDepth) of the farthest pair of opposite neighbours between which depth is
/// linear; 0: none.
int straight_base(const HalfDepth& depth, int x, int y, int dx, int dy) {
  const float centre = depth.at(x, y);
  const float tolerance = 0.5F * same_surface(centre);
  for (const int base : {6, 4, 3}) {
    const int x0 = x - base * dx;
    const int y0 = y - base * dy;
    const int x1 = x + base * dx;
    const int y1 = y + base * dy;
    if (x0 < 0 || y0 < 0 || x1 >= depth.width || y1 >= depth.height) continue;
    const float before = depth.at(x0, y0);
    const float after = depth.at(x1, y1);
    if (before > 0.0F && after > 0.0F && std::abs(before + after - 2.0F * centre) < tolerance) return base;
  }
  return 0;
}

struct SurfaceCandidate {
  maps::SurfaceSample sample;
  int cell = 0;  ///< cell of the image
  int bin = 0;   ///< bin of the normal's direction
};

constexpr int kCellsX = 16;
constexpr int kCellsY = 12;
constexpr int kAzimuths = 8;
constexpr int kElevations = 4;

// Bin of a normal; near the optical axis all azimuths are one.
int direction_bin(const Eigen::Vector3f& n) {
  constexpr float kPi = 3.14159265F;
  const float azimuth = (std::atan2(n.y(), n.x()) + kPi) / (2.0F * kPi);
  const float tilt = std::acos(std::clamp(-n.z(), 0.0F, 1.0F)) / (0.5F * kPi);
  const int e = std::min(kElevations - 1, static_cast<int>(tilt * kElevations));
  const int a = e == 0 ? 0 : std::min(kAzimuths - 1, static_cast<int>(azimuth * kAzimuths));
  return e * kAzimuths + a;
}

std::vector<SurfaceCandidate> candidates(const HalfDepth& depth, const sensor::Pinhole& camera,
                                         const SurfaceSamplerOptions& options) {
  const auto point = [&](int x, int y) {
    const double z = depth.at(x, y);
    return camera.unproject(2.0 * x + 0.5, 2.0 * y + 0.5, z).cast<float>().eval();
  };

  const auto min_cosine = static_cast<float>(std::cos(options.max_incidence_rad));
  std::vector<SurfaceCandidate> result;
  for (int y = 3; y < depth.height - 3; y += 2) {
    for (int x = 3 + (y / 2) % 2; x < depth.width - 3; x += 2) {
      const float z = depth.at(x, y);
      if (z < static_cast<float>(options.min_depth_m) || z > static_cast<float>(options.max_depth_m))
        continue;

      const int bx = straight_base(depth, x, y, 1, 0);
      const int by = straight_base(depth, x, y, 0, 1);
      if (bx == 0 || by == 0) continue;

      // Normal from differences over a wide base
      SurfaceCandidate c;
      c.sample.point = point(x, y);
      const Eigen::Vector3f du = point(x + bx, y) - point(x - bx, y);
      const Eigen::Vector3f dv = point(x, y + by) - point(x, y - by);
      c.sample.normal = dv.cross(du).normalized();  // x right, y down: towards the camera
      const float cosine = -c.sample.normal.dot(c.sample.point.normalized());
      if (!(cosine > min_cosine)) continue;

      // Smoothing leaves part of the noise, which acts along the ray.
      c.sample.sigma =
          0.5F * static_cast<float>(sensor::depth_sigma(z)) * std::max(0.3F, -c.sample.normal.z());
      c.cell = (y * kCellsY / depth.height) * kCellsX + x * kCellsX / depth.width;
      c.bin = direction_bin(c.sample.normal);
      result.push_back(c);
    }
  }

  return result;
}

/// Marks up to `wanted` candidates as taken, in `order`, one from each group in turn.
template <typename GroupOf>
void take_evenly(const std::vector<SurfaceCandidate>& all, const std::vector<std::uint32_t>& order,
                 GroupOf group_of, int groups, int wanted, std::vector<char>& taken) {
  std::vector<std::vector<std::uint32_t>> by_group(static_cast<std::size_t>(groups));
  for (std::uint32_t i : order) {
    if (taken[i] == 0) by_group[static_cast<std::size_t>(group_of(all[i]))].push_back(i);
  }
  for (std::size_t rank = 0; wanted > 0; ++rank) {
    bool any = false;
    for (const auto& group : by_group) {
      if (rank >= group.size() || wanted == 0) continue;
      taken[group[rank]] = 1;
      --wanted;
      any = true;
    }
    if (!any) return;
  }
}

}  // namespace

void SurfaceSamplerOptions::declare(core::OptionTable& table) {
  table.integer("surface.samples", samples, {100, 20000}, "",
                "Surface samples kept of a keyframe's depth image");
  table.number("surface.min_depth", min_depth_m, {0.0, 10.0}, "m", "Smallest depth that is aligned");
  table.number("surface.max_depth", max_depth_m, {0.1, 50.0}, "m", "Largest depth that is aligned");
  table.number("surface.max_incidence", max_incidence_rad, {0.1, 1.57}, "rad",
               "Largest angle between surface normal and viewing ray");
}

std::vector<maps::SurfaceSample> sample_surface(const cv::Mat& depth, const sensor::Pinhole& camera,
                                                const SurfaceSamplerOptions& options) {
  if (depth.empty()) return {};
  const std::vector<SurfaceCandidate> all = candidates(half_depth(depth), camera, options);

  // A fixed scrambled order, so that the first of a group is not always the one at its top left.
  std::vector<std::uint32_t> order(all.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto scramble = [](std::uint32_t i) {
    i ^= i >> 16;
    i *= 0x7feb352dU;
    i ^= i >> 15;
    i *= 0x846ca68bU;
    return i ^ (i >> 16);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return scramble(a) < scramble(b); });

  // Half by cells of the image, half by normals
  std::vector<char> taken(all.size(), 0);
  take_evenly(
      all, order, [](const SurfaceCandidate& c) { return c.cell; }, kCellsX * kCellsY, options.samples / 2,
      taken);
  take_evenly(
      all, order, [](const SurfaceCandidate& c) { return c.bin; }, kAzimuths * kElevations,
      options.samples - options.samples / 2, taken);

  std::vector<maps::SurfaceSample> result;
  result.reserve(static_cast<std::size_t>(options.samples));
  for (std::uint32_t i : order) {
    if (taken[i] != 0) result.push_back(all[i].sample);
  }

  return result;
}

std::vector<maps::SurfaceSample> transformed(std::vector<maps::SurfaceSample> samples,
                                             const geometry::Rigid3& to_from_here) {
  for (maps::SurfaceSample& s : samples) {
    s.point = (to_from_here * s.point.cast<double>()).cast<float>();
    s.normal = (to_from_here.rotation * s.normal.cast<double>()).cast<float>();
  }
  return samples;
}

}  // namespace plumbline::tracking
