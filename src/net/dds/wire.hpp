// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Conversion between messages and the structs that idlc makes of messages.idl.
#include <cstring>
#include <string>

#include "bus.hpp"
#include "messages.h"

namespace plumbline::net {

template <std::size_t kSize>
void put_text(const std::string& from, char (&to)[kSize]) {
  const std::size_t size = from.size() < kSize ? from.size() : kSize - 1;
  std::memcpy(to, from.data(), size);
  std::memset(to + size, 0, kSize - size);
}

/// Texts come from other machines and go to terminals and logs: unprintable characters become '?'.
template <std::size_t kSize>
std::string get_text(const char (&from)[kSize]) {
  std::string text(from, strnlen(from, kSize));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  }
  return text;
}

/// `to` refers to memory of `from`.
void to_wire(const RobotStatus& from, plumbline_wire_RobotStatus& to);
void to_wire(const HubStatus& from, plumbline_wire_HubStatus& to);
void to_wire(const Chunk& from, plumbline_wire_Chunk& to);
RobotStatus from_wire(const plumbline_wire_RobotStatus& from);
HubStatus from_wire(const plumbline_wire_HubStatus& from);
Chunk from_wire(const plumbline_wire_Chunk& from);

}  // namespace plumbline::net
