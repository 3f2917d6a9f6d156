// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Parts of a map as bytes (docs/reference/store.md), before packing: `fields` of each type is the format.
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/sensor/camera.hpp"
#include "store/store_bytes.hpp"

namespace plumbline::geometry {

template <typename Io>
void fields(Io& io, Rigid3& transform) {
  io(transform.rotation, transform.translation);
}

}  // namespace plumbline::geometry

namespace plumbline::sensor {

/// A size beyond any camera is damage.
template <typename Io>
void fields(Io& io, Pinhole& p) {
  constexpr int kMost = 1 << 16;
  io(p.width, p.height);
  io.check(p.width >= 0 && p.height >= 0 && p.width <= kMost && p.height <= kMost,
           "an image's size is wrong");
  io(p.fx, p.fy, p.cx, p.cy);
}

template <typename Io>
void fields(Io& io, Lens& lens) {
  auto model = static_cast<std::uint8_t>(lens.model);
  io(model, lens.k);
  lens.model = static_cast<LensModel>(model);
  io.check(lens.model <= LensModel::kEquidistant, "a lens is of no known kind");
}

template <typename Io>
void fields(Io& io, CameraSigma& s) {
  io(s.fx, s.centre, s.distortion, s.readout_s, s.depth_slope, s.depth_delay_s);
}

/// Model and coefficients are stored as one lens.
template <typename Io>
void fields(Io& io, Camera& c) {
  Lens lens = c.lens();
  io(c.name, c.color, lens, c.depth_scale, c.fps, c.color_from_depth, c.depth, c.depth_lens, c.readout_s,
     c.depth_slope, c.depth_delay_s);
  c.model = lens.model;
  c.distortion = lens.k;
}

}  // namespace plumbline::sensor

namespace plumbline::maps {

/// Landmarks and frame poses of neighbouring numbers share a row.
constexpr std::int32_t kLandmarksPerPage = IdMap<PointId, MapPoint>::kIdsPerPage;
static_assert(kLandmarksPerPage == 64, "the store's format");
constexpr std::size_t kFramesPerPage = 256;

template <typename Io>
void fields(Io& io, CameraVersion& version) {
  io(version.camera, version.first_keyframe, version.first_frame);
}

/// Versions of one robot's camera.
struct CameraVersions {
  std::int32_t robot = 0;
  std::vector<CameraVersion> versions;
};
template <typename Io>
void fields(Io& io, CameraVersions& versions) {
  io(versions.robot, versions.versions);
}

template <typename Io>
void fields(Io& io, CameraEstimate& e) {
  io(e.asked_at, e.used_from, e.answers, e.views, e.better, e.gain, e.note, e.doubt, e.found, e.covariance,
     e.wrong);
}
/// With the robots' numbers.
struct CameraEstimates {
  std::vector<std::pair<std::int32_t, CameraEstimate>> each;
  /// Standard deviations in the cameras' files. Older stores end before these, and so do those without any.
  std::vector<std::pair<std::int32_t, sensor::CameraSigma>> told;
};

/// Stores of earlier versions end before the standard deviations.
template <typename Io>
void fields(Io& io, CameraEstimates& estimates) {
  io(estimates.each);
  if constexpr (Io::kReads) {
    if (!io.at_end()) io(estimates.told);
  } else if (!estimates.told.empty()) {
    io(estimates.told);
  }
}

template <typename Io>
void fields(Io& io, RobotInfo& robot) {
  // Versions and estimates have rows of their own, that come later.
  io(robot.number, robot.name, robot.camera);
}

template <typename Io>
void fields(Io& io, SeenPoint& seen) {
  io(seen.point, seen.pixel, seen.depth, seen.sigma_px);
}

template <typename Io>
void fields(Io& io, SeenPoints& seen) {
  io(seen.depth_delay_s, seen.points);
}

template <typename Io>
void fields(Io& io, ResultFrame& frame) {
  io(frame.output_from_map, frame.upright);
}

/// Pose and parent, which change as the map is refined.
struct KeyframeState {
  geometry::Rigid3 camera_from_world;
  KeyframeId parent;
};
template <typename Io>
void fields(Io& io, KeyframeState& state) {
  io(state.camera_from_world, state.parent);
}

/// One bit of the feature's number says that the observation is aligned.
template <typename Io>
void fields(Io& io, Observation& o) {
  constexpr std::int32_t kAligned = 1 << 30;  // beside the number of a feature
  std::int32_t number = o.aligned ? o.feature | kAligned : o.feature;
  io(o.keyframe, number);
  if constexpr (Io::kReads) {
    const bool aligned = number >= 0 && (number & kAligned) != 0;
    o = {o.keyframe, aligned ? number - kAligned : number, aligned};
  }
}

template <typename Io>
void fields(Io& io, MapPoint& p) {
  io(p.id, p.position, p.descriptor, p.angle, p.angle_keyframe, p.view_direction, p.normal,
     p.reference_distance, p.reference_octave, p.visible, p.found, p.observations);
}

template <typename Io>
void fields(Io& io, MapLine& l) {
  io(l.id, l.start, l.end, l.descriptor, l.visible, l.found, l.observations);
}

template <typename Io>
void fields(Io& io, KeyframeEdge& edge) {
  io(edge.a, edge.b, edge.b_from_a, edge.information);
}

/// A surface edge with its number, by which a row with another edge's bytes is detected.
struct EdgeRow {
  std::uint64_t number = 0;
  SurfaceEdge edge;
};
template <typename Io>
void fields(Io& io, EdgeRow& row) {
  io(row.number, row.edge);
}

template <typename Io>
void fields(Io& io, FramePose& f) {
  io(f.stamp, f.reference, f.camera_from_reference, f.tracked, f.camera_from_previous, f.step_sigma_m);
}

/// Data of a map as a whole, and the expected number of everything else: detects lost rows.
struct MapRow {
  std::uint64_t keyframes = 0;
  std::uint64_t points = 0;
  std::uint64_t lines = 0;
  std::uint64_t edges = 0;
  std::uint64_t frames = 0;
  std::uint64_t log = 0;
  NextIds next;
  std::vector<LoopEdge> loops;
};
template <typename Io>
void fields(Io& io, MapRow& row) {
  io(row.keyframes, row.points, row.lines, row.edges, row.frames, row.log, row.next.edge);
  io(row.next.keyframes, row.next.points, row.next.lines, row.loops);
  // Every id ever used takes four bytes of a map.
  const auto check = [&](const auto& ids) {
    for (const auto& id : ids) {
      io.check(id.index >= 0 && id.index <= 1 << 28, "a next id is out of range");
    }
  };
  check(row.next.keyframes);
  check(row.next.points);
  check(row.next.lines);
}

void encode(const Keyframe& keyframe, ByteWriter& to);
/// `camera` is what the look-up grid of the points is made for.
std::shared_ptr<const Keyframe> decode_keyframe(const Bytes& bytes, const sensor::Pinhole& camera);

/// Rounded: points to 0.2 mm, normals to 0.2 degrees, sigma to 0.005 mm.
void encode(const StoredSurface& surface, ByteWriter& to);
StoredSurface decode_surface(const Bytes& bytes);

}  // namespace plumbline::maps
