// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Between messages and what idlc made of messages.idl.
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

/// Texts come from strangers and go to terminals and logs: what cannot be printed becomes '?'.
template <std::size_t kSize>
std::string get_text(const char (&from)[kSize]) {
  std::string text(from, strnlen(from, kSize));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  }
  return text;
}

/// `to` borrows from `from`.
void to_wire(const Hello& from, plumbline_wire_Hello& to);
void to_wire(const Word& from, plumbline_wire_Word& to);
void to_wire(const Piece& from, plumbline_wire_Piece& to);
Hello from_wire(const plumbline_wire_Hello& from);
Word from_wire(const plumbline_wire_Word& from);
Piece from_wire(const plumbline_wire_Piece& from);

}  // namespace plumbline::net
