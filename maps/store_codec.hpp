// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a map consists of as bytes (docs/store.md), before packing. Decoders throw BadBytes.
#include <memory>
#include <vector>

#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/sensor/camera.hpp"
#include "store_bytes.hpp"

namespace plumbline::maps {

/// Landmarks and frame poses of neighbouring numbers share a row.
constexpr std::int32_t kLandmarksPerPage = IdMap<PointId, MapPoint>::kIdsPerPage;
static_assert(kLandmarksPerPage == 64, "the store's format");
constexpr std::size_t kFramesPerPage = 256;

void encode(const Keyframe& keyframe, ByteWriter& to);
/// `picture` is what the look-up grid of the points is made for.
std::shared_ptr<const Keyframe> decode_keyframe(const Bytes& bytes, const sensor::Pinhole& picture);

/// Rounded: points to 0.2 mm, normals to 0.2 degrees, sigma to 0.005 mm.
void encode(const StoredSurface& surface, ByteWriter& to);
StoredSurface decode_surface(const Bytes& bytes);

/// Pose and parent, which change as the map is refined.
struct KeyframeState {
  geometry::Rigid3 camera_from_world;
  KeyframeId parent;
};
void encode(const KeyframeState& state, ByteWriter& to);
KeyframeState decode_state(const Bytes& bytes);

void encode(const MapPoint& point, ByteWriter& to);
void encode(const MapLine& line, ByteWriter& to);
/// Appends a page's landmarks.
void decode_page(const Bytes& bytes, std::vector<MapPoint>& points);
void decode_page(const Bytes& bytes, std::vector<MapLine>& lines);

/// With its number, which tells a row that holds another's bytes.
void encode(const SurfaceEdge& edge, std::uint64_t number, ByteWriter& to);
SurfaceEdge decode_edge(const Bytes& bytes, std::uint64_t number);

void encode(const FramePose& frame, ByteWriter& to);
void decode_page(const Bytes& bytes, std::vector<FramePose>& frames);

void encode(const std::vector<RobotInfo>& robots, ByteWriter& to);
std::vector<RobotInfo> decode_robots(const Bytes& bytes);

/// What belongs to a map as a whole, and how much of everything there must be: tells when rows were lost.
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
void encode(const MapRow& row, ByteWriter& to);
MapRow decode_map(const Bytes& bytes);
/// A line of frames.csv; of a page, they are appended.
void encode(const std::string& line, ByteWriter& to);
void decode_page(const Bytes& bytes, std::vector<std::string>& log);

}  // namespace plumbline::maps
