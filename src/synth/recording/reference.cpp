// SPDX-License-Identifier: BSD-3-Clause
#include "recording/reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "render/depth_sensor.hpp"
#include "render/render.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Sine of the smallest angle between ray and surface: 20 degrees. The shipped filters keep points down to 15
/// degrees; surface never seen at a larger angle than this is not required of a map.
constexpr double kLeastSine = 0.342;

/// True if nearly all rays from a spot hit nothing: it faces the outside of the world.
bool faces_nowhere(const World& world, const Face& face, const Vector3d& p) {
  int misses = 0;
  constexpr int kRays = 9;
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2.4 * i, r = std::sqrt((i + 0.5) / kRays);
    const Vector3d d = r * std::cos(angle) * face.u_axis + r * std::sin(angle) * face.v_axis +
                       std::sqrt(1.0 - r * r) * face.normal;
    if (world.cast(p, d, 1e4).face < 0) ++misses;
  }
  return misses >= 7;
}

struct PlySample {
  std::array<float, 3> position, normal;
  std::uint8_t red, green, blue, visible;
};
static_assert(sizeof(PlySample) == 28);

/// A sample with the colour and normal of its face.
PlySample make_sample(const World& world, std::size_t index, double u, double v, const Vector3d& p,
                      bool visible) {
  const cv::Vec3b c = surface_color(world, index, u, v);
  PlySample s{{}, {}, c[2], c[1], c[0], visible ? std::uint8_t{1} : std::uint8_t{0}};
  Eigen::Vector3f::Map(s.position.data()) = p.cast<float>();
  Eigen::Vector3f::Map(s.normal.data()) = world.scene.faces[index].normal.cast<float>();
  return s;
}

std::vector<PlySample> sample_face(const World& world, const Visibility& visibility, std::size_t index,
                                   double spacing) {
  const Face& face = world.scene.faces[index];
  const Eigen::AlignedBox2d b = face.bounds();
  std::vector<PlySample> out;

  // The middle of the grid's cells, whole cells over the face, so that no edge is favoured.
  const int nu = std::max(1, static_cast<int>(std::lround((b.max().x() - b.min().x()) / spacing)));
  const int nv = std::max(1, static_cast<int>(std::lround((b.max().y() - b.min().y()) / spacing)));
  const double du = (b.max().x() - b.min().x()) / nu, dv = (b.max().y() - b.min().y()) / nv;
  std::vector<signed char> outside(static_cast<std::size_t>((nu / 16 + 1) * (nv / 16 + 1)), -1);
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      const Vector2d uv(b.min().x() + (i + 0.5) * du, b.min().y() + (j + 0.5) * dv);
      if (!face.contains(uv, 1e-9)) continue;

      // Surface inside solids or outside the world is left out.
      const Vector3d p = face.at(uv.x(), uv.y()), before = p + 0.002 * face.normal;
      const bool visible = visibility.seen(index, uv.x(), uv.y());
      if (!visible) {
        signed char& skin = outside[static_cast<std::size_t>((j / 16) * (nu / 16 + 1) + i / 16)];
        if (skin < 0) skin = faces_nowhere(world, face, before) ? 1 : 0;
        if (skin == 1 || world.inside_solid(before)) continue;
      }

      out.push_back(make_sample(world, index, uv.x(), uv.y(), p, visible));
    }
  }

  return out;
}

}  // namespace

Visibility::Visibility(std::shared_ptr<const World> world, double spacing)
    : world_(std::move(world)), block_(std::max(0.02, spacing)) {
  std::size_t count = 0;
  for (const Face& face : world_->scene.faces) {
    // A grid of flags over the bounds of each face.
    const Eigen::AlignedBox2d b = face.bounds();
    const Grid grid{b.min().x(), b.min().y(), 1 + static_cast<int>((b.max().x() - b.min().x()) / block_),
                    1 + static_cast<int>((b.max().y() - b.min().y()) / block_), count};
    count += static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows);
    grids_.push_back(grid);
  }
  flags_ = std::vector<std::atomic<std::uint8_t>>(count);
}

bool Visibility::seen(std::size_t face, double u, double v) const {
  const Grid& g = grids_[face];
  const int i = std::clamp(static_cast<int>((u - g.u0) / block_), 0, g.columns - 1);
  const int j = std::clamp(static_cast<int>((v - g.v0) / block_), 0, g.rows - 1);
  return flags_[g.at(i, j)] != 0;
}

double Visibility::seen_share(std::size_t face) const {
  const Grid& g = grids_[face];
  const std::size_t count = static_cast<std::size_t>(g.columns) * static_cast<std::size_t>(g.rows);
  std::size_t seen = 0;
  for (std::size_t i = g.first; i < g.first + count; ++i) seen += flags_[i] != 0 ? 1 : 0;
  return static_cast<double>(seen) / static_cast<double>(count);
}

/// For each face, 1 if a pixel shows it.
static std::vector<char> faces_in(const View& view, std::size_t count) {
  std::vector<char> present(count, 0);
  for (const int id : view.ids) {
    if (id >= 0) present[static_cast<std::size_t>(id)] = 1;
  }
  return present;
}

void Visibility::mark(const geometry::Rigid3& world_from_camera, const sensor::Pinhole& camera) {
  const View view = look(*world_, camera, world_from_camera);
  const DepthRange range = depth_range(world_->options.sensor);
  const geometry::Rigid3 camera_from_world = world_from_camera.inverse();
  const std::vector<char> present = faces_in(view, world_->scene.faces.size());

  // In range, in the image, measurable and not hidden.
  const auto sees = [&](std::size_t index, const Vector3d& p) {
    const Vector3d c = camera_from_world * p;
    if (c.z() < range.min || c.z() > std::min(range.max, world_->options.visible_range)) return false;
    const Vector2d pixel = camera.project(c);
    if (!camera.contains(pixel, 1.0)) return false;

    // The sensor must get enough light back.
    const Vector3d ray = (p - world_from_camera.translation).normalized();
    if (!measures(world_->options.sensor, *world_->materials[index], {camera.width, camera.height},
                  {pixel.x(), pixel.y()}, c.z(), std::abs(ray.dot(world_->scene.faces[index].normal)))) {
      return false;
    }

    return view.ids(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x()))) ==
           static_cast<int>(index);
  };

  // Each block by its middle and corners.
  for (std::size_t index = 0; index < present.size(); ++index) {
    if (present[index] == 0) continue;
    const Face& face = world_->scene.faces[index];
    const Grid& g = grids_[index];
    const Eigen::AlignedBox2d b = face.bounds();
    for (int j = 0; j < g.rows; ++j) {
      for (int i = 0; i < g.columns; ++i) {
        std::atomic<std::uint8_t>& flag = flags_[g.at(i, j)];
        if (flag.load(std::memory_order_relaxed) != 0) continue;

        // The block's middle decides first.
        const double ua = g.u0 + i * block_, va = g.v0 + j * block_;
        const double ub = std::min(ua + block_, b.max().x()), vb = std::min(va + block_, b.max().y());
        const Vector3d middle = face.at(0.5 * (ua + ub), 0.5 * (va + vb));
        if (!sees(index, middle)) continue;

        const Vector3d ray = (middle - world_from_camera.translation).normalized();
        if (std::abs(ray.dot(face.normal)) < kLeastSine) continue;

        // Only blocks seen in full count.
        const double e = 1e-3;
        if (sees(index, face.at(ua + e, va + e)) && sees(index, face.at(ub - e, va + e)) &&
            sees(index, face.at(ua + e, vb - e)) && sees(index, face.at(ub - e, vb - e))) {
          flag.store(1, std::memory_order_relaxed);
        }
      }
    }
  }
}

void Visibility::add(const SynthSource& source, const core::Executor& executor, const core::StopToken& stop) {
  // About 200 frames of one round suffice.
  const std::size_t step = std::max<std::size_t>(3, source.round() / 200);
  const std::size_t looks = (source.round() + step - 1) / step;
  executor.parallel_for(looks, [&](std::size_t k) {
    const dataset::PairInfo info = source.true_info(k * step);
    if (!stop.stop_requested() && !source.blind(k * step)) {
      mark(source.world_from_camera(info.depth_stamp), source.true_camera().color);
    }
  });
}

double default_spacing(const Scene& scene) {
  double area = 0.0;
  for (const Face& face : scene.faces) area += face.bounds().volume();
  return std::max(0.005, std::ceil(1000.0 * std::sqrt(area / 2.0e7)) / 1000.0);
}

core::Result<ReferenceCounts> write_reference(const std::filesystem::path& file, const World& world,
                                              const Visibility& visibility, double spacing,
                                              const core::Executor& executor) {
  // Faces in parallel, samples in their order.
  std::vector<std::vector<PlySample>> parts(world.fixed_faces);
  executor.parallel_for(parts.size(), [&](std::size_t i) {
    if (world.gone[i] == 0) parts[i] = sample_face(world, visibility, i, spacing);
  });

  ReferenceCounts counts;
  for (const auto& part : parts) {
    counts.samples += part.size();
    for (const PlySample& s : part) counts.visible += s.visible;
  }

  // The header counts all samples.
  std::ofstream out(file, std::ios::binary);
  out << fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment samples of the true surfaces, {:.4f} m apart; visible = "
      "1 where a camera saw the spot within range\ncomment frame: of the scene; metres, right-handed, z up\n"
      "element vertex {}\n",
      spacing, counts.samples);

  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) out << "property float " << name << "\n";
  for (const char* name : {"red", "green", "blue", "visible"}) out << "property uchar " << name << "\n";
  out << "end_header\n";

  // Samples are stored as in memory.
  for (const auto& part : parts) {
    out.write(reinterpret_cast<const char*>(part.data()),
              static_cast<std::streamsize>(part.size() * sizeof(PlySample)));
  }

  // Errors of the disk appear at the latest now.
  out.flush();
  if (!out)
    return core::output_error(
        fmt::format("{}: cannot be written (disk full, no permission?)", file.string()));

  return counts;
}

}  // namespace plumbline::synth
