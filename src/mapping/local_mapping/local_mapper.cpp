// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_mapping/local_mapper.hpp"

#include <algorithm>
#include <utility>

#include "plumbline/core/release.hpp"
#include "plumbline/features/depth_delay.hpp"
#include "plumbline/mapping/local_mapping/landmark_normal.hpp"

namespace plumbline::mapping {
namespace {

bool still(const geometry::Rigid3& motion) {
  return motion.translation.isZero(0.0) && motion.rotation.isIdentity(0.0);
}

}  // namespace

void LocalMapperOptions::declare(core::OptionTable& table) {
  table.number("landmark.max_depth", max_landmark_depth_m, {0.5, 100.0}, "m",
               "Largest depth of landmarks made from depth");
  table.number("landmark.max_turn_rate", max_landmark_turn_rate, {0.0, 100.0}, "rad/s",
               "Largest turn rate of images used to triangulate, find or merge landmarks: faster ones are "
               "distorted by the rolling shutter");
  culling.declare(table);

  table.boolean("triangulate", triangulate, "Triangulate landmarks without depth from several keyframes");
  triangulation.declare(table);
  table.boolean("fuse", fuse, "Find landmarks in neighbouring keyframes and merge duplicates");
  fusion.declare(table);
  table.boolean("bundle", bundle, "Local bundle adjustment after each keyframe");
  table.integer("bundle.keyframes", bundle_keyframes, {2, 200}, "", "Keyframes that are adjusted together");
  bundle_noise.declare(table, "bundle.");

  table.boolean("edges", edges,
                "Align the surfaces of neighbouring keyframes, as edges for bundle adjustment");
  table.integer("edges.keyframes", edge_keyframes, {1, 100}, "",
                "Number of neighbours that a new keyframe is aligned with");
  table.number("edges.min_overlap", edge_min_overlap, {0.0, 1.0}, "",
               "Smallest share of a neighbour's surface in view that is confirmed");
  table.boolean("edges.photometric", edge_photometric, "Align their grey values, too");
  bundle_options.declare(table);
  surface.declare(table);
}

LocalMapper::LocalMapper(const LocalMapperOptions& options, const tracking::TrackerOptions& tracker,
                         const sensor::Pinhole& camera, std::int32_t robot)
    : options_(options),
      camera_(camera),
      robot_(robot),
      photometric_(tracker.photometric),
      local_map_(tracker.local_map),
      culler_(options.culling) {
  options_.triangulation.scale_factor = tracker.association.scale_factor;
  options_.triangulation.aligned = tracker.association.aligned_sigma;
  options_.edges = options.edges && tracker.depth;
  local_map_.max_surface_depth_m = options.surface.max_depth_m;
}

core::KeyframeId LocalMapper::insert(maps::Map& map, const sensor::RgbdFrame& frame,
                                     const tracking::TrackResult& track, const std::vector<cv::Mat>& levels,
                                     bool begins_component) {
  auto keyframe = std::make_shared<maps::Keyframe>();
  keyframe->id = map.next_keyframe_id(robot_);
  keyframe->frame_index = frame.index;
  keyframe->stamp = frame.stamp;
  keyframe->turn_rate = track.turn_rate;

  if (track.reference.valid()) {
    keyframe->reference = track.reference;
    keyframe->camera_from_reference =
        track.camera_from_world * map.camera_from_world(track.reference).inverse();
    keyframe->reference_sigma_m = track.sigma_m();
  }

  if (options_.culling.by_keyframes) count(map, track);
  auto own = std::make_shared<features::FrameFeatures>(*track.features);
  if (!still(track.depth_from_camera))
    features::undo_line_depth_delay(*own, frame.depth, camera_, track.depth_from_camera);
  keyframe->features = own;

  // A keyframe's pose is that of its colour image, so the surface that the depth image measured a little
  // later or earlier is moved there. Otherwise every keyframe would be off by a few milliseconds of motion,
  // all in the direction of travel.
  keyframe->surface = tracking::sample_surface(frame.depth, camera_, options_.surface);

  if (!still(track.depth_from_camera))
    keyframe->surface =
        tracking::transformed(std::move(keyframe->surface), track.depth_from_camera.inverse());
  const core::KeyframeId id = map.add_keyframe(keyframe, track.camera_from_world);
  for (const tracking::PointMatch& m : track.points) {
    if (map.observe(m.point, id, m.feature, m.aligned)) map.refresh_point(m.point);
  }

  for (const tracking::LineMatch& m : track.lines) map.observe(m.line, id, m.feature);
  add_points(map, id, frame.depth);
  add_lines(map, id);
  if (!begins_component) map.attach(id);
  if (options_.triangulate && !distorted(map, id)) triangulate(map, id, {levels, *own});
  core::release(own->slants);  // corners do not move from here on
  return id;
}

void LocalMapper::add_points(maps::Map& map, core::KeyframeId id, const cv::Mat& depth) {
  const features::FrameFeatures& features = *map.keyframe(id).features;
  const geometry::Rigid3 world_from_camera = map.camera_from_world(id).inverse();
  for (std::size_t i = 0; i < features.points.size(); ++i) {
    const features::PointFeature& f = features.points[i];

    // Corners without depth or beyond its useful range are left to triangulation.
    if (!(f.depth > 0.0F) || static_cast<double>(f.depth) > options_.max_landmark_depth_m) continue;
    if (map.point_of(id, static_cast<int>(i)).valid()) continue;

    maps::MapPoint point;
    const Eigen::Vector3d in_camera = camera_.unproject(
        static_cast<double>(f.pixel.x()), static_cast<double>(f.pixel.y()), static_cast<double>(f.depth));
    point.position = world_from_camera * in_camera;
    point.descriptor = features.descriptors[i];
    point.angle = f.angle;
    point.angle_keyframe = id;

    // Descriptors match only in similar views, so the direction and distance of the first one are stored.
    point.view_direction = (point.position - world_from_camera.translation).normalized();
    point.normal = world_from_camera.rotation *
                   depth_normal(depth, f.pixel.cast<double>(), static_cast<double>(f.depth), camera_);
    point.reference_distance = in_camera.norm();
    point.reference_octave = f.octave;
    point.visible = 1;
    point.found = 1;

    const core::PointId point_id = map.add_point(id.robot, point);
    map.observe(point_id, id, static_cast<int>(i), true);
    culler_.watch(point_id, id);
  }
}

void LocalMapper::add_lines(maps::Map& map, core::KeyframeId id) {
  const features::FrameFeatures& features = *map.keyframe(id).features;
  const geometry::Rigid3 world_from_camera = map.camera_from_world(id).inverse();
  for (std::size_t i = 0; i < features.lines.size(); ++i) {
    const features::LineFeature& f = features.lines[i];
    if (!f.line3 || map.line_of(id, static_cast<int>(i)).valid()) continue;
    if (std::max(f.line3->start.z(), f.line3->end.z()) > options_.max_landmark_depth_m) continue;
    maps::MapLine line;
    line.start = world_from_camera * f.line3->start;
    line.end = world_from_camera * f.line3->end;
    line.descriptor = f.descriptor;
    line.visible = 1;
    line.found = 1;
    const core::LineId line_id = map.add_line(id.robot, line);
    map.observe(line_id, id, static_cast<int>(i));
    culler_.watch(line_id, id);
  }
}

void LocalMapper::count(maps::Map& map, const tracking::TrackResult& track) {
  for (core::PointId id : track.visible_points) ++map.point(id).visible;
  for (core::LineId id : track.visible_lines) ++map.line(id).visible;
  for (const tracking::PointMatch& m : track.points) ++map.point(m.point).found;
  for (const tracking::LineMatch& m : track.lines) ++map.line(m.line).found;
}

std::optional<SurfaceEdgeJob> LocalMapper::begin_surface_edges(const maps::Map& map, core::KeyframeId id,
                                                               const cv::Mat& depth,
                                                               const tracking::TrackResult& track,
                                                               const core::Executor& executor) const {
  if (!options_.edges) return std::nullopt;

  std::vector<NeighbourSurface> surfaces;
  const geometry::Rigid3& camera_from_world = map.camera_from_world(id);
  for (const core::KeyframeId other : around_.local_map.keyframes) {
    if (other == id) continue;
    surfaces.push_back({&map.keyframe(other), camera_from_world * map.camera_from_world(other).inverse(),
                        options_.edge_photometric ? around_.photometric.find(other) : nullptr});
  }

  NewestSurface newest{id, depth, track.depth_from_camera, track.photometric};
  return SurfaceEdgeJob(std::move(newest), std::move(surfaces), options_.edge_keyframes, camera_,
                        {options_.edge_min_overlap, options_.surface.max_depth_m}, executor);
}

void LocalMapper::keep_intensities(core::KeyframeId id, const cv::Mat& depth,
                                   const tracking::TrackResult& track) {
  if (!photometric_ || track.photometric == nullptr) return;
  around_.photometric.add(id,
                          std::make_shared<const features::PhotometricSamples>(features::sample_photometric(
                              *track.photometric, depth, camera_, track.depth_from_camera.inverse())));
}

std::vector<core::KeyframeId> LocalMapper::nearest_undistorted(const maps::Map& map, core::KeyframeId id,
                                                               int count) const {
  std::vector<core::KeyframeId> neighbours = map.neighbours(id, static_cast<std::size_t>(count));
  const auto bad = [&](core::KeyframeId k) { return distorted(map, k); };
  neighbours.erase(std::remove_if(neighbours.begin(), neighbours.end(), bad), neighbours.end());
  return neighbours;
}

void LocalMapper::triangulate(maps::Map& map, core::KeyframeId id, const NewestImage& image) {
  const std::vector<core::KeyframeId> neighbours =
      nearest_undistorted(map, id, options_.triangulation.keyframes);
  const TriangulationOptions& how = options_.triangulation;
  const double measured = options_.max_landmark_depth_m;
  for (core::PointId p : triangulate_points(map, id, neighbours, measured, camera_, how, &image))
    culler_.watch(p, id);
  for (core::LineId l : triangulate_lines(map, id, neighbours, measured, camera_, how)) culler_.watch(l, id);
}

void LocalMapper::refine(maps::Map& map, core::KeyframeId id) {
  if (options_.fuse && !distorted(map, id)) {
    const std::vector<core::KeyframeId> neighbours = nearest_undistorted(map, id, options_.fusion.keyframes);
    fuse_points(map, id, neighbours, {{id.robot, camera_}}, options_.fusion);
    fuse_lines(map, id, neighbours, {{id.robot, camera_}}, options_.fusion);
  }
  culler_.judge(map, id);
}

}  // namespace plumbline::mapping
