// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Work that is done while others leave a core idle.
#include <cstddef>
#include <functional>
#include <memory>

#include "plumbline/core/executor.hpp"

namespace plumbline::pipeline {

/// Calls work(i) for i in [0, count), each once, beside whatever else the program does: in threads that have
/// nothing more urgent to do. The results must not depend on when and by whom it is done.
class IdleWork {
 public:
  /// Begins. `work` must not throw. With an executor of one thread nothing is done before finish().
  IdleWork(std::size_t count, std::function<void(std::size_t)> work, const core::Executor& executor);
  IdleWork(const IdleWork&) = delete;
  IdleWork& operator=(const IdleWork&) = delete;
  /// Leaves undone what has not begun.
  ~IdleWork();

  /// Does the rest with all threads; returns when all is done.
  void finish();

 private:
  struct State;
  std::shared_ptr<State> state_;
  const core::Executor& executor_;
};

}  // namespace plumbline::pipeline
