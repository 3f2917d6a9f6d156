// SPDX-License-Identifier: BSD-3-Clause
#include "idle_work.hpp"

#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace plumbline::pipeline {

struct IdleWork::State : std::enable_shared_from_this<IdleWork::State> {
  State(std::size_t how_many, std::function<void(std::size_t)> what)
      : count(how_many), work(std::move(what)), arena(1, 0, tbb::task_arena::priority::low) {}

  /// Does one piece; false: there is none left to begin.
  bool one() {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (next >= count) return false;
      ++under_way;
    }
    const std::size_t i = next.fetch_add(1);
    if (i < count) work(i);
    const std::lock_guard<std::mutex> lock(mutex);
    --under_way;
    changed.notify_all();
    return i < count;
  }
  /// One piece after another; between them the thread is free for what is more urgent.
  void enqueue() {
    arena.enqueue([self = shared_from_this()] {
      if (self->one()) self->enqueue();
    });
  }
  void wait() {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] { return under_way == 0; });
  }

  const std::size_t count;
  const std::function<void(std::size_t)> work;
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t under_way = 0;
  tbb::task_arena arena;
};

IdleWork::IdleWork(std::size_t count, std::function<void(std::size_t)> work, const core::Executor& executor)
    : state_(std::make_shared<State>(count, std::move(work))), executor_(executor) {
  if (executor.threads() > 1 && count > 0) state_->enqueue();
}

IdleWork::~IdleWork() {
  state_->next.store(state_->count);
  state_->wait();
}

void IdleWork::finish() {
  const std::size_t begun = std::min(state_->count, state_->next.load());
  executor_.parallel_for(state_->count - begun, [&](std::size_t) { state_->one(); });
  state_->wait();
}

}  // namespace plumbline::pipeline
