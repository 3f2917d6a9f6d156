// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The one source of parallelism: passed in, never created by a module.
#include <cstddef>
#include <functional>
#include <memory>

namespace plumbline::core {

/// Runs work on a fixed number of threads (oneTBB under it). Results must not depend on that number:
/// write each index's result to its own place and reduce in index order.
class Executor {
 public:
  /// `threads` >= 1; 0 means one per core.
  explicit Executor(int threads = 0);
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  [[nodiscard]] int threads() const;

  /// Calls body(i) for i in [0, count), in any order; returns when all are done. Rethrows exceptions of body.
  void parallel_for(std::size_t count, const std::function<void(std::size_t)>& body) const;

  /// Work that runs beside the caller. Destroying a Job waits for it. wait() runs the job itself if it has
  /// not started, and never runs other jobs meanwhile, so it cannot take longer than the job and works with
  /// one thread. The work itself must not wait for other jobs.
  class Job {
   public:
    Job();
    Job(Job&&) noexcept;
    Job& operator=(Job&&) noexcept;
    ~Job();
    [[nodiscard]] bool valid() const;
    /// True if the work is done already; false for a Job without work.
    [[nodiscard]] bool ready() const;
    /// Returns when the work is done; rethrows its exception.
    void wait();

   private:
    friend class Executor;
    struct State;
    std::shared_ptr<State> state_;
  };
  [[nodiscard]] Job submit(std::function<void()> work) const;

  /// Runs `work` inside this executor's arena, so that oneTBB algorithms in it use these threads.
  void run(const std::function<void()>& work) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace plumbline::core
