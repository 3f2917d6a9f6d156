// SPDX-License-Identifier: BSD-3-Clause
#include "store_codec.hpp"

namespace plumbline::maps {
namespace {

constexpr std::size_t kObservationBytes = 12;
constexpr std::int32_t kAligned = 1 << 30;  // beside the number of a feature
constexpr std::size_t kIdBytes = 8;

void write(const std::vector<Observation>& observations, ByteWriter& to) {
  to.count(observations.size());
  for (const Observation& o : observations) {
    to.put(o.keyframe);
    to.put(static_cast<std::int32_t>(o.aligned ? o.feature | kAligned : o.feature));
  }
}
void read(ByteReader& from, std::vector<Observation>& observations) {
  observations.resize(from.count(kObservationBytes));
  for (Observation& o : observations) {
    KeyframeId keyframe;
    from.get(keyframe);
    const auto number = from.get<std::int32_t>();
    const bool aligned = number >= 0 && (number & kAligned) != 0;
    o = {keyframe, aligned ? number - kAligned : number, aligned};
  }
}

template <typename IdType>
void write(const std::vector<IdType>& ids, ByteWriter& to) {
  to.count(ids.size());
  for (const IdType& id : ids) to.put(id);
}
template <typename IdType>
void read(ByteReader& from, std::vector<IdType>& ids) {
  ids.resize(from.count(kIdBytes));
  for (IdType& id : ids) {
    from.get(id);
    // Every id that was ever given takes four bytes of a map.
    if (id.index < 0 || id.index > 1 << 28) throw BadBytes("a next id is out of range");
  }
}

void write(const sensor::Pinhole& pinhole, ByteWriter& to) {
  to.put(static_cast<std::int32_t>(pinhole.width));
  to.put(static_cast<std::int32_t>(pinhole.height));
  for (const double value : {pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy}) to.put(value);
}
void read(ByteReader& from, sensor::Pinhole& pinhole) {
  pinhole.width = from.get<std::int32_t>();
  pinhole.height = from.get<std::int32_t>();
  constexpr int kMost = 1 << 16;
  if (pinhole.width < 0 || pinhole.height < 0 || pinhole.width > kMost || pinhole.height > kMost) {
    throw BadBytes("a picture's size is wrong");
  }
  for (double* value : {&pinhole.fx, &pinhole.fy, &pinhole.cx, &pinhole.cy}) from.get(*value);
}

void write(const sensor::Camera& camera, ByteWriter& to) {
  to.put(std::string_view(camera.name));
  write(camera.color, to);
  for (const double k : camera.distortion) to.put(k);
  to.put(camera.depth_scale);
  to.put(camera.fps);
  to.flag(camera.color_from_depth.has_value());
  if (camera.color_from_depth) to.put(*camera.color_from_depth);
  to.flag(camera.depth.has_value());
  if (camera.depth) write(*camera.depth, to);
  to.flag(camera.readout_s.has_value());
  if (camera.readout_s) to.put(*camera.readout_s);
  for (const double slope : camera.depth_slope) to.put(slope);
}
void read(ByteReader& from, sensor::Camera& camera) {
  from.get(camera.name);
  read(from, camera.color);
  for (double& k : camera.distortion) from.get(k);
  from.get(camera.depth_scale);
  from.get(camera.fps);
  if (from.flag()) from.get(camera.color_from_depth.emplace());
  if (from.flag()) read(from, camera.depth.emplace());
  if (from.flag()) from.get(camera.readout_s.emplace());
  for (double& slope : camera.depth_slope) from.get(slope);
}

}  // namespace

void encode(const KeyframeState& state, ByteWriter& to) {
  to.put(state.camera_from_world);
  to.put(state.parent);
}
KeyframeState decode_state(const Bytes& bytes) {
  ByteReader from(bytes);
  KeyframeState state;
  from.get(state.camera_from_world);
  from.get(state.parent);
  from.expect_end();
  return state;
}

void encode(const MapPoint& p, ByteWriter& to) {
  to.put(p.id);
  to.put(p.position);
  to.put(p.descriptor);
  to.put(p.angle);
  to.put(p.angle_keyframe);
  to.put(p.view_direction);
  to.put(p.normal);
  to.put(p.reference_distance);
  to.put(static_cast<std::int32_t>(p.reference_octave));
  to.put(static_cast<std::int32_t>(p.visible));
  to.put(static_cast<std::int32_t>(p.found));
  write(p.observations, to);
}
void decode_page(const Bytes& bytes, std::vector<MapPoint>& points) {
  for (ByteReader from(bytes); !from.at_end();) {
    MapPoint p;
    from.get(p.id);
    from.get(p.position);
    from.get(p.descriptor);
    from.get(p.angle);
    from.get(p.angle_keyframe);
    from.get(p.view_direction);
    from.get(p.normal);
    from.get(p.reference_distance);
    p.reference_octave = from.get<std::int32_t>();
    p.visible = from.get<std::int32_t>();
    p.found = from.get<std::int32_t>();
    read(from, p.observations);
    points.push_back(std::move(p));
  }
}

void encode(const MapLine& l, ByteWriter& to) {
  to.put(l.id);
  to.put(l.start);
  to.put(l.end);
  to.put(l.descriptor);
  to.put(static_cast<std::int32_t>(l.visible));
  to.put(static_cast<std::int32_t>(l.found));
  write(l.observations, to);
}
void decode_page(const Bytes& bytes, std::vector<MapLine>& lines) {
  for (ByteReader from(bytes); !from.at_end();) {
    MapLine l;
    from.get(l.id);
    from.get(l.start);
    from.get(l.end);
    from.get(l.descriptor);
    l.visible = from.get<std::int32_t>();
    l.found = from.get<std::int32_t>();
    read(from, l.observations);
    lines.push_back(std::move(l));
  }
}

void encode(const SurfaceEdge& edge, std::uint64_t number, ByteWriter& to) {
  to.put(number);
  to.put(edge.a);
  to.put(edge.b);
  to.put(edge.b_from_a);
  to.put(edge.information);
}
SurfaceEdge decode_edge(const Bytes& bytes, std::uint64_t number) {
  ByteReader from(bytes);
  if (from.get<std::uint64_t>() != number) throw BadBytes("it holds what belongs to another row");
  SurfaceEdge edge;
  from.get(edge.a);
  from.get(edge.b);
  from.get(edge.b_from_a);
  from.get(edge.information);
  from.expect_end();
  return edge;
}

void encode(const FramePose& frame, ByteWriter& to) {
  to.put(frame.stamp);
  to.put(frame.reference);
  to.put(frame.camera_from_reference);
  to.flag(frame.tracked);
  to.flag(frame.camera_from_previous.has_value());
  if (frame.camera_from_previous) to.put(*frame.camera_from_previous);
  to.put(frame.step_sigma_m);
}
void decode_page(const Bytes& bytes, std::vector<FramePose>& frames) {
  for (ByteReader from(bytes); !from.at_end();) {
    FramePose frame;
    from.get(frame.stamp);
    from.get(frame.reference);
    from.get(frame.camera_from_reference);
    frame.tracked = from.flag();
    if (from.flag()) from.get(frame.camera_from_previous.emplace());
    from.get(frame.step_sigma_m);
    frames.push_back(frame);
  }
}

void encode(const std::string& line, ByteWriter& to) { to.put(std::string_view(line)); }
void decode_page(const Bytes& bytes, std::vector<std::string>& log) {
  for (ByteReader from(bytes); !from.at_end();) from.get(log.emplace_back());
}

void encode(const std::vector<RobotInfo>& robots, ByteWriter& to) {
  for (const RobotInfo& robot : robots) {
    to.put(robot.number);
    to.put(std::string_view(robot.name));
    write(robot.camera, to);
  }
}
std::vector<RobotInfo> decode_robots(const Bytes& bytes) {
  std::vector<RobotInfo> robots;
  for (ByteReader from(bytes); !from.at_end();) {
    RobotInfo& robot = robots.emplace_back();
    from.get(robot.number);
    from.get(robot.name);
    read(from, robot.camera);
  }
  return robots;
}

void encode(const MapRow& row, ByteWriter& to) {
  for (const std::uint64_t value :
       {row.keyframes, row.points, row.lines, row.edges, row.frames, row.log, row.next.edge}) {
    to.put(value);
  }
  write(row.next.keyframes, to);
  write(row.next.points, to);
  write(row.next.lines, to);
  for (const LoopEdge& loop : row.loops) {
    to.put(loop.a);
    to.put(loop.b);
    to.put(loop.b_from_a);
    to.put(loop.information);
  }
}
MapRow decode_map(const Bytes& bytes) {
  ByteReader from(bytes);
  MapRow row;
  for (std::uint64_t* value :
       {&row.keyframes, &row.points, &row.lines, &row.edges, &row.frames, &row.log, &row.next.edge}) {
    from.get(*value);
  }
  read(from, row.next.keyframes);
  read(from, row.next.points);
  read(from, row.next.lines);
  while (!from.at_end()) {
    LoopEdge& loop = row.loops.emplace_back();
    from.get(loop.a);
    from.get(loop.b);
    from.get(loop.b_from_a);
    from.get(loop.information);
  }
  return row;
}

}  // namespace plumbline::maps
