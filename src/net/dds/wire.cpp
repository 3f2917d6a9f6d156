// SPDX-License-Identifier: BSD-3-Clause
#include "wire.hpp"

#include <algorithm>
#include <iterator>
#include <type_traits>

namespace plumbline::net {
namespace {

template <typename From, typename To>
void convert(const From& from, To& to) {
  static_assert(std::is_arithmetic_v<From> || std::is_enum_v<From>);
  to = static_cast<To>(from);
}
template <std::size_t kSize>
void convert(const std::string& from, char (&to)[kSize]) {
  put_text(from, to);
}
template <std::size_t kSize>
void convert(const char (&from)[kSize], std::string& to) {
  to = get_text(from);
}
template <std::size_t kSize>
void convert(const std::array<double, kSize>& from, double (&to)[kSize]) {
  std::copy(from.begin(), from.end(), to);
}
template <std::size_t kSize>
void convert(const double (&from)[kSize], std::array<double, kSize>& to) {
  std::copy(std::begin(from), std::end(from), to.begin());
}
/// The sequence refers to the vector's memory.
template <typename T, typename Sequence>
void convert(const std::vector<T>& from, Sequence& to) {
  to._buffer = const_cast<T*>(from.data());
  to._length = to._maximum = static_cast<std::uint32_t>(from.size());
}
template <typename Sequence, typename T>
void convert(const Sequence& from, std::vector<T>& to) {
  if (from._length > 0) to.assign(from._buffer, from._buffer + from._length);
}

/// Converts all fields, in either direction.
template <typename From, typename To>
void convert_robot_status(const From& from, To& to) {
  convert(from.protocol, to.protocol);
  convert(from.store_format, to.store_format);
  convert(from.program, to.program);
  convert(from.name, to.name);
  convert(from.run, to.run);
  convert(from.incarnation, to.incarnation);
  convert(from.heads_at_start, to.heads_at_start);
  convert(from.map_head, to.map_head);
  convert(from.clouds_head, to.clouds_head);
  convert(from.finished, to.finished);
  convert(from.lag_median_s, to.lag_median_s);
  convert(from.lag_p95_s, to.lag_p95_s);
}

template <typename From, typename To>
void convert_hub_status(const From& from, To& to) {
  // Versions and identity of the hub
  convert(from.protocol, to.protocol);
  convert(from.store_format, to.store_format);
  convert(from.program, to.program);
  convert(from.hub, to.hub);
  convert(from.up_s, to.up_s);

  // The robot's run and the answer to it
  convert(from.robot, to.robot);
  convert(from.run, to.run);
  convert(from.incarnation, to.incarnation);
  convert(from.answer, to.answer);
  convert(from.problem, to.problem);

  // The last transactions and chunks received
  convert(from.map_held, to.map_held);
  convert(from.clouds_held, to.clouds_held);
  convert(from.incoming, to.incoming);
  convert(from.checksum, to.checksum);
  convert(from.chunks, to.chunks);

  // The common frame of all robots
  convert(from.frame.frame_of, to.frame.frame_of);
  convert(from.frame.frame_from_robot, to.frame.frame_from_robot);
  convert(from.frame.frame_from_camera, to.frame.frame_from_camera);
  convert(from.frame.covariance, to.frame.covariance);
}

/// One list of fields serves both directions.
template <typename From, typename To>
void convert_chunk(const From& from, To& to) {
  convert(from.protocol, to.protocol);
  convert(from.name, to.name);
  convert(from.run, to.run);
  convert(from.incarnation, to.incarnation);
  convert(from.stream, to.stream);
  convert(from.after, to.after);
  convert(from.number, to.number);
  convert(from.checksum, to.checksum);
  convert(from.index, to.index);
  convert(from.count, to.count);
  convert(from.hash, to.hash);
  convert(from.bytes, to.bytes);
}

}  // namespace

void to_wire(const RobotStatus& from, plumbline_wire_RobotStatus& to) {
  to = {};
  convert_robot_status(from, to);
}

RobotStatus from_wire(const plumbline_wire_RobotStatus& from) {
  RobotStatus to;
  convert_robot_status(from, to);
  return to;
}

void to_wire(const HubStatus& from, plumbline_wire_HubStatus& to) {
  to = {};
  convert_hub_status(from, to);
}

HubStatus from_wire(const plumbline_wire_HubStatus& from) {
  HubStatus to;
  convert_hub_status(from, to);
  return to;
}

void to_wire(const Chunk& from, plumbline_wire_Chunk& to) {
  to = {};
  convert_chunk(from, to);
}

Chunk from_wire(const plumbline_wire_Chunk& from) {
  Chunk to;
  convert_chunk(from, to);
  return to;
}

}  // namespace plumbline::net
