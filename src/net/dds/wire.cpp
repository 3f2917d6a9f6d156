// SPDX-License-Identifier: BSD-3-Clause
#include "wire.hpp"

#include <algorithm>
#include <iterator>

namespace plumbline::net {
namespace {

std::uint64_t number(std::int64_t value) { return static_cast<std::uint64_t>(value); }
std::int64_t number(std::uint64_t value) { return static_cast<std::int64_t>(value); }

}  // namespace

void to_wire(const Hello& from, plumbline_wire_Hello& to) {
  to = {};
  to.protocol = from.protocol;
  to.store_format = from.store_format;
  put_text(from.program, to.program);
  put_text(from.name, to.name);
  put_text(from.run, to.run);
  to.incarnation = from.incarnation;
  to.began._buffer = const_cast<std::uint64_t*>(from.began.data());
  to.began._length = to.began._maximum = static_cast<std::uint32_t>(from.began.size());
  to.map_head = number(from.map_head);
  to.clouds_head = number(from.clouds_head);
  to.over = from.over;
  to.lag_median_s = from.lag_median_s;
  to.lag_p95_s = from.lag_p95_s;
}

Hello from_wire(const plumbline_wire_Hello& from) {
  Hello to;
  to.protocol = from.protocol;
  to.store_format = from.store_format;
  to.program = get_text(from.program);
  to.name = get_text(from.name);
  to.run = get_text(from.run);
  to.incarnation = from.incarnation;
  if (from.began._length > 0) to.began.assign(from.began._buffer, from.began._buffer + from.began._length);
  to.map_head = number(from.map_head);
  to.clouds_head = number(from.clouds_head);
  to.over = from.over;
  to.lag_median_s = from.lag_median_s;
  to.lag_p95_s = from.lag_p95_s;
  return to;
}

void to_wire(const Word& from, plumbline_wire_Word& to) {
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
  to.map_held = number(from.map);
  to.clouds_held = number(from.clouds);
  to.number = number(from.number);
  to.edition = from.edition;
  to.pieces = from.pieces;
  put_text(from.place.frame_of, to.place.frame_of);
  std::copy(from.place.frame_from_robot.begin(), from.place.frame_from_robot.end(),
            to.place.frame_from_robot);
  std::copy(from.place.frame_from_camera.begin(), from.place.frame_from_camera.end(),
            to.place.frame_from_camera);
  std::copy(from.place.covariance.begin(), from.place.covariance.end(), to.place.covariance);
}

Word from_wire(const plumbline_wire_Word& from) {
  Word to;
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
  to.map = number(from.map_held);
  to.clouds = number(from.clouds_held);
  to.number = number(from.number);
  to.edition = from.edition;
  to.pieces = from.pieces;
  to.place.frame_of = get_text(from.place.frame_of);
  std::copy(std::begin(from.place.frame_from_robot), std::end(from.place.frame_from_robot),
            to.place.frame_from_robot.begin());
  std::copy(std::begin(from.place.frame_from_camera), std::end(from.place.frame_from_camera),
            to.place.frame_from_camera.begin());
  std::copy(std::begin(from.place.covariance), std::end(from.place.covariance), to.place.covariance.begin());
  return to;
}

void to_wire(const Piece& from, plumbline_wire_Piece& to) {
  to = {};
  to.protocol = from.protocol;
  put_text(from.name, to.name);
  put_text(from.run, to.run);
  to.incarnation = from.incarnation;
  to.share = from.share;
  to.after = number(from.after);
  to.number = number(from.number);
  to.edition = from.edition;
  to.index = from.index;
  to.count = from.count;
  to.hash = from.hash;
  to.bytes._buffer = const_cast<std::uint8_t*>(from.bytes.data());
  to.bytes._length = to.bytes._maximum = static_cast<std::uint32_t>(from.bytes.size());
}

Piece from_wire(const plumbline_wire_Piece& from) {
  Piece to;
  to.protocol = from.protocol;
  to.name = get_text(from.name);
  to.run = get_text(from.run);
  to.incarnation = from.incarnation;
  to.share = from.share;
  to.after = number(from.after);
  to.number = number(from.number);
  to.edition = from.edition;
  to.index = from.index;
  to.count = from.count;
  to.hash = from.hash;
  if (from.bytes._length > 0) to.bytes.assign(from.bytes._buffer, from.bytes._buffer + from.bytes._length);
  return to;
}

}  // namespace plumbline::net
