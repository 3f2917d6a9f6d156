// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a command leaves in memory when all is written.
#include "plumbline/pipeline/run.hpp"

namespace plumbline::cli {

/// Never taken apart: the program ends, and the system takes all of it back at once.
inline pipeline::DeferredDestruction& deferred_destruction() {
  static auto* const kept = new pipeline::DeferredDestruction;
  return *kept;
}

}  // namespace plumbline::cli
