// SPDX-License-Identifier: BSD-3-Clause
#include "render/world.hpp"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <stdexcept>
#include <tuple>

#include "plumbline/synth/layout.hpp"
#include "render/wall_tags.hpp"
#include "scene/builder.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;

World::World(Scene s, SynthOptions o) : scene(std::move(s)), options(std::move(o)), events(scene.events) {
  if (auto more = parse_events(options.events)) events.insert(events.end(), more->begin(), more->end());
  fixed_faces = scene.faces.size();
  const std::size_t walkers = std::min(scene.walkers.size(), static_cast<std::size_t>(options.walkers));

  // People consist of moving parts.
  for (std::size_t i = 0; i < walkers; ++i) {
    for (int part = 0; part < walker_parts(scene.walkers[i]); ++part) {
      const std::size_t first = scene.faces.size();
      Builder builder(scene);
      add_walker(builder, scene.walkers[i], part);
      movers.push_back({i, part, first, scene.faces.size() - first});
    }
  }

  // Leaves that swing take the place of those that stand still.
  gone.assign(fixed_faces, 0);
  for (std::size_t i = 0; i < scene.moving_doors.size(); ++i) {
    const MovingDoor& door = scene.moving_doors[i];
    const DoorLeaf& leaf = scene.leaves[door.leaf];
    movers.push_back({i, -1, scene.faces.size(), leaf.count + door.body.size()});

    // Copies at the place where their light is computed.
    for (std::size_t k = leaf.first; k < leaf.first + leaf.count; ++k) {
      gone[k] = 1;
      scene.faces.push_back(Face(scene.faces[k]));
      scene.faces.back().origin += door.lit * door.slide;
    }
    scene.faces.insert(scene.faces.end(), door.body.begin(), door.body.end());
  }

  for (const Face& face : scene.faces) materials.push_back(find_material(face.material));
  build_bvh();
}

World::~World() {
  if (bvh_ != nullptr) rtcReleaseScene(bvh_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

void World::build_bvh() {
  // No "threads=" here: Embree would limit all of oneTBB in this process to that number for as long as the
  // device lives.
  device_ = rtcNewDevice("set_affinity=0");
  if (device_ == nullptr) throw std::bad_alloc();

  bvh_ = rtcNewScene(device_);
  rtcSetSceneFlags(bvh_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(bvh_, RTC_BUILD_QUALITY_HIGH);

  // Sizes of the buffers.
  std::size_t vertices = 0, triangles = 0;
  for (std::size_t i = 0; i < fixed_faces; ++i) {
    if (gone[i] != 0) continue;
    vertices += scene.faces[i].polygon.size();
    triangles += scene.faces[i].polygon.size() - 2;
  }

  // Embree owns the buffers.
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                        RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices));
  auto* t = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), triangles));
  if (v == nullptr || t == nullptr) throw std::bad_alloc();

  // Corners of each face.
  unsigned base = 0;
  for (std::size_t i = 0; i < fixed_faces; ++i) {
    if (gone[i] != 0) continue;
    const Face& face = scene.faces[i];
    for (const Eigen::Vector2d& uv : face.polygon) {
      const Vector3d p = face.at(uv.x(), uv.y());
      for (int k = 0; k < 3; ++k) *v++ = static_cast<float>(p[k]);
    }

    // Convex polygons are fans of triangles.
    const auto corners = static_cast<unsigned>(face.polygon.size());
    for (unsigned k = 1; k + 1 < corners; ++k) {
      *t++ = base;
      *t++ = base + k;
      *t++ = base + k + 1;
      face_of_triangle_.push_back(static_cast<int>(i));
    }

    base += corners;
  }

  // The geometry belongs to the tree.
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(bvh_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(bvh_);
}

const World::Mover* World::mover_of(int face) const {
  const auto index = static_cast<std::size_t>(std::max(0, face));
  const auto found = std::find_if(movers.begin(), movers.end(), [&](const Mover& m) {
    return index >= m.first && index < m.first + m.count;
  });
  return found == movers.end() ? nullptr : &*found;
}

geometry::Rigid3 World::motion(const Mover& mover, double t) const {
  if (mover.part >= 0) return walker_motion(scene.walkers[mover.which], mover.part, t);
  const MovingDoor& door = scene.moving_doors[mover.which];
  const DoorLeaf& leaf = scene.leaves[door.leaf];
  geometry::Rigid3 swung;
  if (!door.drawer.empty()) {  // its faces are where their light is computed
    swung.translation = (door.angle(t) - door.lit) * door.slide;
    return swung;
  }

  // Doors turn about the hinge.
  swung.rotation = Eigen::AngleAxisd(leaf.open_rad - door.angle(t), Vector3d::UnitZ()).toRotationMatrix();
  swung.translation = leaf.hinge - swung.rotation * leaf.hinge;
  return swung;
}

Hit World::cast(const Vector3d& origin, const Vector3d& direction, double far) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);

  // Embree takes single precision.
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(origin.x());
  query.ray.org_y = static_cast<float>(origin.y());
  query.ray.org_z = static_cast<float>(origin.z());
  query.ray.dir_x = static_cast<float>(direction.x());
  query.ray.dir_y = static_cast<float>(direction.y());
  query.ray.dir_z = static_cast<float>(direction.z());

  // All geometry, up to a distance.
  query.ray.tfar = static_cast<float>(far);
  query.ray.mask = 0xffffffffU;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(bvh_, &context, &query);
  Hit hit;
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;

  // The face, and the side that was hit.
  hit.face = face_of_triangle_[query.hit.primID];
  hit.distance = static_cast<double>(query.ray.tfar);
  hit.front = scene.faces[static_cast<std::size_t>(hit.face)].normal.dot(direction) < 0.0;
  return hit;
}

double World::free_distance(const Vector3d& origin, const Vector3d& direction, double far) const {
  const Hit hit = cast(origin, direction, far);
  return hit.face < 0 ? far : hit.distance;
}

bool World::inside_solid(const Vector3d& point) const {
  const Hit hit = cast(point, Vector3d(0.0123, 0.0211, 1.0).normalized(), 1e4);
  return hit.face >= 0 && !hit.front;
}

void World::cast_packet(const float origin[3], const float* dx, const float* dy, const float* dz,
                        int* faces) const {
  alignas(64) static constexpr int kAll[kPacket] = {-1, -1, -1, -1, -1, -1, -1, -1,
                                                    -1, -1, -1, -1, -1, -1, -1, -1};
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) RTCRayHit16 q;

  // All rays start at one place.
  for (int k = 0; k < kPacket; ++k) {
    q.ray.org_x[k] = origin[0];
    q.ray.org_y[k] = origin[1];
    q.ray.org_z[k] = origin[2];
    q.ray.dir_x[k] = dx[k];
    q.ray.dir_y[k] = dy[k];
    q.ray.dir_z[k] = dz[k];
    q.ray.tnear[k] = 0.0F;

    // No limit of distance, no hit yet.
    q.ray.tfar[k] = std::numeric_limits<float>::infinity();
    q.ray.time[k] = 0.0F;
    q.ray.mask[k] = 0xffffffffU;
    q.ray.id[k] = 0;
    q.ray.flags[k] = 0;
    q.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    q.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
  }

  rtcIntersect16(kAll, bvh_, &context, &q);
  for (int k = 0; k < kPacket; ++k) {
    faces[k] = q.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? -1 : face_of_triangle_[q.hit.primID[k]];
  }
}

void World::prepare_textures() {
  // Faces of one material share a texture when it tiles; a print that is stretched is drawn for its seed and
  // shape.
  struct Job {
    const Material* material;
    std::uint64_t seed;
    double aspect;
  };

  // One texture per material, print and shape.
  std::vector<Job> jobs;
  std::map<std::tuple<std::string, int, int>, int> known;
  texture_of.resize(scene.faces.size());
  offset_u.assign(scene.faces.size(), 0.0F);
  offset_v.assign(scene.faces.size(), 0.0F);

  const auto seed = static_cast<std::uint64_t>(options.seed);
  for (std::size_t i = 0; i < scene.faces.size(); ++i) {
    const Face& face = scene.faces[i];
    const bool tiled = face.stretch_u <= 0.0 || (options.texture == Texture::kNone && materials[i]->large);
    const double aspect = tiled ? 0.0 : face.stretch_u / face.stretch_v;
    const int variant = tiled ? 0 : 1 + face.seed % 4096;
    const auto key = std::make_tuple(face.material, variant,
                                     static_cast<int>(std::lround(16.0 * std::log2(std::max(aspect, 1e-3)))));
    const auto [entry, fresh] = known.emplace(key, static_cast<int>(jobs.size()));

    // The seed depends on the name, not on the order.
    if (fresh) {
      std::uint64_t name_hash = 0;
      for (const char letter : face.material) name_hash = mix(name_hash, static_cast<std::uint64_t>(letter));
      const auto number = static_cast<std::uint64_t>(variant);
      jobs.push_back(
          {materials[i], materials[i]->numbered ? number - 1 : mix(seed, name_hash, number), aspect});
    }

    // Tiled textures begin anywhere.
    texture_of[i] = entry->second;
    tile_m.push_back(worn(*materials[i], options.texture).tile_m);
    if (tiled) {
      Rng rng(static_cast<std::uint64_t>(face.seed), 0x0ff5e7);
      offset_u[i] = static_cast<float>(rng.uniform(0.0, 8.0));
      offset_v[i] = materials[i]->large ? 0.0F : static_cast<float>(rng.uniform(0.0, 8.0));
    }
  }

  for (const Job& job : jobs)
    texture_sizes.push_back(texture_size(*job.material, options.texture, job.aspect));

  // Textures are drawn when they are first needed.
  constexpr std::size_t kMostBytes = 96U << 20U;
  const auto draw = [jobs, texture = options.texture](std::size_t k) {
    return draw_texture(*jobs[k].material, texture, jobs[k].seed, jobs[k].aspect);
  };
  const auto size = [](const Texture2d& t) {
    std::size_t texels = 0;
    for (const Texture2d::Level& level : t.levels) texels += level.texels.size();
    return sizeof(std::uint32_t) * texels;
  };
  textures.prepare(jobs.size(), draw, size, kMostBytes);
}

core::Result<std::shared_ptr<const World>> build_world(const Scene& scene, const SynthOptions& options,
                                                       const core::Executor&) {
  if (auto ok = check(options); !ok) return tl::unexpected<core::Error>(ok.error());

  // Surfaces, robots and known materials are needed.
  if (scene.faces.empty())
    return core::usage_error(fmt::format("scene '{}' has no surfaces; add `objects:`", scene.name));
  if (scene.robots.empty())
    return core::usage_error(fmt::format("scene '{}' has no robots; add `robots:`", scene.name));
  for (const Face& face : scene.faces) {
    if (find_material(face.material) == nullptr) {
      return core::usage_error(fmt::format("scene '{}': no material '{}'", scene.name, face.material));
    }
  }

  if (options.moving_doors > 0 && !scene.plan) {
    return core::usage_error(fmt::format(
        "moving_doors: doors swing in worlds made from a number (layout), not in scene '{}'", scene.name));
  }

  // Doors and people that the options add.
  Scene peopled = scene;
  choose_moving_doors(options, peopled);
  if (!add_people(options.walkers, options.seed, peopled)) {
    return core::usage_error(
        fmt::format("walkers: scene '{}' has {}, not {}, and no free floor near its first path for more; ask "
                    "for fewer, or add some to a copy of the scene",
                    scene.name, scene.walkers.size(), options.walkers));
  }

  if (auto hung = hang_tags(options, peopled); !hung) return tl::unexpected<core::Error>(hung.error());

  // Cameras must not run into anything.
  auto world = std::make_shared<World>(std::move(peopled), options);
  if (auto free = check_paths(world); !free) return tl::unexpected<core::Error>(free.error());
  world->prepare_textures();
  world->prepare_light();

  return std::shared_ptr<const World>(world);
}

}  // namespace plumbline::synth
