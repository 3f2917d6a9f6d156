// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Many short loops one after another: threads that stay awake in between.
#include <cstddef>
#include <functional>
#include <memory>

#include "plumbline/core/executor.hpp"

namespace plumbline::core {

/// Loops of a fraction of a millisecond, hundreds in a row, as a solver has them: an executor's threads would
/// fall asleep after each of them, or take up something else, and the caller would be done before they come.
/// A crew's helpers look for the next loop until none has come for half a millisecond; then their threads are
/// the executor's again. For one thread at a time.
class Crew {
 public:
  /// No executor, or one of a single thread: loops are done by the caller alone.
  explicit Crew(const Executor* executor);
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  /// Calls body(i) for i in [0, count), `grain` of them at a time, in any order; returns when all are done.
  /// Rethrows what body throws.
  template <typename Body>
  void each(std::size_t count, std::size_t grain, const Body& body) {
    if (shared_ == nullptr || count <= grain) {
      for (std::size_t i = 0; i < count; ++i) body(i);
      return;
    }
    run((count + grain - 1) / grain, [&](std::size_t chunk) {
      const std::size_t end = chunk + 1 < (count + grain - 1) / grain ? (chunk + 1) * grain : count;
      for (std::size_t i = chunk * grain; i < end; ++i) body(i);
    });
  }

 private:
  struct Shared;
  void run(std::size_t chunks, const std::function<void(std::size_t)>& work);
  std::unique_ptr<Shared> shared_;  ///< null: no helpers
};

}  // namespace plumbline::core
