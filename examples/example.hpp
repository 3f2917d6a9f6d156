// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Shared by the examples.
#include <cstdio>

#include "plumbline/core/error.hpp"

/// Prints the message; returns the exit code that the program uses for this kind of error.
inline int fail(const plumbline::core::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return static_cast<int>(error.kind);
}
