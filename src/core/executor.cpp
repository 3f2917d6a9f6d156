// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/executor.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <utility>

namespace plumbline::core {

struct Executor::Impl {
  explicit Impl(int threads)
      : allowed(tbb::global_control::max_allowed_parallelism,
                static_cast<std::size_t>(std::max(threads, tbb::info::default_concurrency()))),
        arena(threads) {
    arena.initialize();
  }
  tbb::global_control allowed;  ///< allows more threads than cores if requested
  mutable tbb::task_arena arena;
  mutable tbb::task_group beside;  ///< submitted jobs
};

/// Done by whoever claims it first: a thread of the arena or the one that waits.
struct Executor::Job::State {
  explicit State(std::function<void()> what) : work(std::move(what)) {}

  void run_unless_claimed() {
    // Whoever comes second leaves the job to the first
    if (claimed.exchange(true)) return;
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    work = nullptr;

    // Notified under the lock, so that no waiter misses it
    const std::lock_guard<std::mutex> lock(mutex);
    done = true;
    changed.notify_all();
  }

  std::function<void()> work;
  std::atomic<bool> claimed{false};
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  std::exception_ptr failure;
};

Executor::Executor(int threads)
    : impl_(std::make_unique<Impl>(threads > 0 ? threads : tbb::info::default_concurrency())) {}
Executor::~Executor() {
  impl_->arena.execute([&] { impl_->beside.wait(); });
}

int Executor::threads() const { return impl_->arena.max_concurrency(); }

void Executor::parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) const {
  if (count == 0) return;
  if (count == 1 || threads() == 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  // Isolated: a thread that waits here runs no other jobs, so that a short loop in a serial stage is not
  // delayed by another frame's long work, and a lock held by the caller cannot be requested again by the same
  // thread.
  impl_->arena.execute(
      [&] { tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, count, body); }); });
}

Executor::Job Executor::submit(std::function<void()> work) const {
  Job job;
  job.state_ = std::make_shared<Job::State>(std::move(work));
  impl_->arena.execute([&] { impl_->beside.run([state = job.state_] { state->run_unless_claimed(); }); });
  return job;
}

void Executor::run(const std::function<void()>& work) const { impl_->arena.execute(work); }

Executor::Job::Job() = default;
Executor::Job::Job(Job&&) noexcept = default;
Executor::Job& Executor::Job::operator=(Job&& other) noexcept {
  Job taken(std::move(other));
  std::swap(state_, taken.state_);
  return *this;  // waits for the previous job
}
Executor::Job::~Job() {
  if (!state_) return;
  try {
    wait();
  } catch (...) {  // nobody waits for this result
  }
}
bool Executor::Job::valid() const { return state_ != nullptr; }
bool Executor::Job::ready() const {
  if (!state_) return false;
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->done;
}
void Executor::Job::wait() {
  if (!state_) return;
  const auto state = std::move(state_);
  state->run_unless_claimed();

  // Another thread is still at it
  std::unique_lock<std::mutex> lock(state->mutex);
  state->changed.wait(lock, [&] { return state->done; });
  if (state->failure) std::rethrow_exception(state->failure);
}

}  // namespace plumbline::core
