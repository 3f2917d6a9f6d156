// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/executor.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_group.h>

#include <algorithm>
#include <utility>

namespace plumbline::core {

struct Executor::Impl {
  explicit Impl(int threads)
      : allowed(tbb::global_control::max_allowed_parallelism,
                static_cast<std::size_t>(std::max(threads, tbb::info::default_concurrency()))),
        arena(threads) {
    arena.initialize();
  }
  tbb::global_control allowed;  ///< more threads than cores are given when they are asked for
  mutable tbb::task_arena arena;
};

struct Executor::Job::State {
  tbb::task_arena* arena = nullptr;
  tbb::task_group group;
};

Executor::Executor(int threads)
    : impl_(std::make_unique<Impl>(threads > 0 ? threads : tbb::info::default_concurrency())) {}
Executor::~Executor() = default;

int Executor::threads() const { return impl_->arena.max_concurrency(); }

void Executor::parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) const {
  if (count == 0) return;
  if (count == 1 || threads() == 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  // Isolated: a thread that waits here takes up nothing else, so that a short loop in a serial stage is not
  // held up by another frame's long work, and a lock held by the caller cannot meet itself.
  impl_->arena.execute(
      [&] { tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, count, body); }); });
}

Executor::Job Executor::submit(std::function<void()> work) const {
  Job job;
  job.state_ = std::make_unique<Job::State>();
  job.state_->arena = &impl_->arena;
  impl_->arena.execute([&] { job.state_->group.run(std::move(work)); });
  return job;
}

void Executor::run(const std::function<void()>& work) const { impl_->arena.execute(work); }

Executor::Job::Job() = default;
Executor::Job::Job(Job&&) noexcept = default;
Executor::Job& Executor::Job::operator=(Job&& other) noexcept {
  if (this != &other) {
    if (state_) {
      try {
        wait();
      } catch (...) {  // a result nobody asked for
      }
    }
    state_ = std::move(other.state_);
  }
  return *this;
}
Executor::Job::~Job() {
  if (!state_) return;
  try {
    wait();
  } catch (...) {  // a result nobody asked for
  }
}
bool Executor::Job::valid() const { return state_ != nullptr; }
void Executor::Job::wait() {
  if (!state_) return;
  const auto state = std::move(state_);
  state->arena->execute([&] { state->group.wait(); });
}

}  // namespace plumbline::core
