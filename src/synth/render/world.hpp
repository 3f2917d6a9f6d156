// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A scene made ready to render. Private to the module.
#include <vector>

#include "materials/materials.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/synth/scene.hpp"
#include "plumbline/synth/source.hpp"
#include "render/on_demand.hpp"
#include "scene/builder.hpp"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace plumbline::synth {

/// Light falling on a face on a grid of nodes that spans its bounding rectangle: square root of irradiance.
struct LightMap {
  int columns = 0;
  int rows = 0;
  float per_u = 0.0F;  ///< nodes per metre
  float per_v = 0.0F;
  float u0 = 0.0F;  ///< of the first node, metres
  float v0 = 0.0F;
  std::vector<float> nodes;

  [[nodiscard]] float at(float u, float v) const {
    float x = (u - u0) * per_u, y = (v - v0) * per_v;

    // Constant beyond the border.
    x = x < 0.0F ? 0.0F : (x > static_cast<float>(columns - 1) ? static_cast<float>(columns - 1) : x);
    y = y < 0.0F ? 0.0F : (y > static_cast<float>(rows - 1) ? static_cast<float>(rows - 1) : y);
    int ix = static_cast<int>(x), iy = static_cast<int>(y);
    if (ix > columns - 2) ix = columns - 2;
    if (iy > rows - 2) iy = rows - 2;
    const float sx = x - static_cast<float>(ix), sy = y - static_cast<float>(iy);
    const float* p = nodes.data() + static_cast<std::size_t>(iy) * static_cast<std::size_t>(columns) +
                     static_cast<std::size_t>(ix);
    const float top = p[0] + sx * (p[1] - p[0]), low = p[columns] + sx * (p[columns + 1] - p[columns]);
    return top + sy * (low - top);
  }
};

struct Hit {
  int face = -1;
  double distance = 0.0;
  bool front = true;  ///< seen from outside
};

class World {
 public:
  World(Scene scene, SynthOptions options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Faces [first, first + count) of the scene walk or swing: they are where that begins and move with the
  /// time.
  struct Mover {
    std::size_t which = 0;  ///< index into Scene::walkers or Scene::moving_doors
    int part = 0;           ///< of a walker; -1: a door
    std::size_t first = 0;
    std::size_t count = 0;
  };

  Scene scene;  ///< its own faces, then those of the walkers and moving doors
  SynthOptions options;
  std::size_t fixed_faces = 0;  ///< the scene's own; only these are cast against
  std::vector<char> gone;       ///< of these: 1 where a moving door was, which is a mover instead
  std::vector<Mover> movers;
  std::vector<Event> events;               ///< of scene and options
  std::vector<const Material*> materials;  ///< per face
  OnDemand<LightMap> light;                ///< per face
  Recent<Texture2d> textures;
  std::vector<cv::Size> texture_sizes;  ///< px, of level 0
  std::vector<int> texture_of;          ///< per face
  std::vector<double> tile_m;           ///< per face: metres one copy of a tiled texture covers
  std::vector<float> offset_u;          ///< per face: shift of tiled textures, metres
  std::vector<float> offset_v;

  void prepare_textures();
  void prepare_light();

  /// First thing along a ray; direction need not be unit (distance is in its lengths).
  [[nodiscard]] Hit cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double far) const;
  /// Distance to the nearest thing or `far`.
  [[nodiscard]] double free_distance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                     double far) const;
  /// Number of rays that are cast together.
  static constexpr int kPacket = 16;
  /// kPacket rays from one origin; faces[k] = -1 for nothing. dx, dy, dz: directions.
  void cast_packet(const float origin[3], const float* dx, const float* dy, const float* dz,
                   int* faces) const;
  [[nodiscard]] geometry::Rigid3 motion(const Mover& mover, double t) const;
  /// The mover that a face belongs to; null: it is fixed.
  [[nodiscard]] const Mover* mover_of(int face) const;
  /// True if a point lies inside a solid.
  [[nodiscard]] bool inside_solid(const Eigen::Vector3d& point) const;

 private:
  void build_bvh();
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* bvh_ = nullptr;
  std::vector<int> face_of_triangle_;
};

}  // namespace plumbline::synth
