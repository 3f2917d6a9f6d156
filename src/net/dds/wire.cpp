// SPDX-License-Identifier: BSD-3-Clause
#include "wire.hpp"

#include <algorithm>
#include <iterator>

namespace plumbline::net {
namespace {

std::uint64_t number(std::int64_t value) { return static_cast<std::uint64_t>(value); }
std::int64_t number(std::uint64_t value) { return static_cast<std::int64_t>(value); }

}  // namespace

void to_wire(const RobotStatus& from, plumbline_wire_RobotStatus& to) {
  to = {};
  to.protocol = from.protocol;
  to.store_format = from.store_format;
  put_text(from.program, to.program);
  put_text(from.name, to.name);
  put_text(from.run, to.run);
  to.incarnation = from.incarnation;
  to.heads_at_start._buffer = const_cast<std::uint64_t*>(from.heads_at_start.data());
  to.heads_at_start._length = to.heads_at_start._maximum =
      static_cast<std::uint32_t>(from.heads_at_start.size());
  to.map_head = number(from.map_head);
  to.clouds_head = number(from.clouds_head);
  to.finished = from.finished;
  to.lag_median_s = from.lag_median_s;
  to.lag_p95_s = from.lag_p95_s;
}

RobotStatus from_wire(const plumbline_wire_RobotStatus& from) {
  RobotStatus to;
  to.protocol = from.protocol;
  to.store_format = from.store_format;
  to.program = get_text(from.program);
  to.name = get_text(from.name);
  to.run = get_text(from.run);
  to.incarnation = from.incarnation;
  if (from.heads_at_start._length > 0)
    to.heads_at_start.assign(from.heads_at_start._buffer,
                             from.heads_at_start._buffer + from.heads_at_start._length);
  to.map_head = number(from.map_head);
  to.clouds_head = number(from.clouds_head);
  to.finished = from.finished;
  to.lag_median_s = from.lag_median_s;
  to.lag_p95_s = from.lag_p95_s;
  return to;
}

void to_wire(const HubStatus& from, plumbline_wire_HubStatus& to) {
  to = {};
  to.protocol = from.protocol;
  to.store_format = from.store_format;
  put_text(from.program, to.program);
  put_text(from.hub, to.hub);
  to.up_s = from.up_s;
  put_text(from.robot, to.robot);
  put_text(from.run, to.run);

  to.incarnation = from.incarnation;
  to.answer = static_cast<std::uint8_t>(from.answer);
  put_text(from.problem, to.problem);
  to.map_held = number(from.map_held);
  to.clouds_held = number(from.clouds_held);
  to.incoming = number(from.incoming);
  to.checksum = from.checksum;
  to.chunks = from.chunks;

  put_text(from.frame.frame_of, to.frame.frame_of);
  std::copy(from.frame.frame_from_robot.begin(), from.frame.frame_from_robot.end(),
            to.frame.frame_from_robot);
  std::copy(from.frame.frame_from_camera.begin(), from.frame.frame_from_camera.end(),
            to.frame.frame_from_camera);
  std::copy(from.frame.covariance.begin(), from.frame.covariance.end(), to.frame.covariance);
}

HubStatus from_wire(const plumbline_wire_HubStatus& from) {
  HubStatus to;
  to.protocol = from.protocol;
  to.store_format = from.store_format;
  to.program = get_text(from.program);
  to.hub = get_text(from.hub);
  to.up_s = from.up_s;
  to.robot = get_text(from.robot);

  to.run = get_text(from.run);
  to.incarnation = from.incarnation;
  to.answer = static_cast<Answer>(from.answer);
  to.problem = get_text(from.problem);
  to.map_held = number(from.map_held);
  to.clouds_held = number(from.clouds_held);
  to.incoming = number(from.incoming);
  to.checksum = from.checksum;
  to.chunks = from.chunks;
  to.frame.frame_of = get_text(from.frame.frame_of);

  std::copy(std::begin(from.frame.frame_from_robot), std::end(from.frame.frame_from_robot),
            to.frame.frame_from_robot.begin());
  std::copy(std::begin(from.frame.frame_from_camera), std::end(from.frame.frame_from_camera),
            to.frame.frame_from_camera.begin());
  std::copy(std::begin(from.frame.covariance), std::end(from.frame.covariance), to.frame.covariance.begin());
  return to;
}

void to_wire(const Chunk& from, plumbline_wire_Chunk& to) {
  to = {};
  to.protocol = from.protocol;
  put_text(from.name, to.name);
  put_text(from.run, to.run);
  to.incarnation = from.incarnation;
  to.stream = from.stream;
  to.after = number(from.after);
  to.number = number(from.number);
  to.checksum = from.checksum;
  to.index = from.index;
  to.count = from.count;
  to.hash = from.hash;
  to.bytes._buffer = const_cast<std::uint8_t*>(from.bytes.data());
  to.bytes._length = to.bytes._maximum = static_cast<std::uint32_t>(from.bytes.size());
}

Chunk from_wire(const plumbline_wire_Chunk& from) {
  Chunk to;
  to.protocol = from.protocol;
  to.name = get_text(from.name);
  to.run = get_text(from.run);
  to.incarnation = from.incarnation;
  to.stream = from.stream;
  to.after = number(from.after);
  to.number = number(from.number);
  to.checksum = from.checksum;
  to.index = from.index;
  to.count = from.count;
  to.hash = from.hash;
  if (from.bytes._length > 0) to.bytes.assign(from.bytes._buffer, from.bytes._buffer + from.bytes._length);
  return to;
}

}  // namespace plumbline::net
