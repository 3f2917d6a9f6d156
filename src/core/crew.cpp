// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/crew.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace plumbline::core {
namespace {

constexpr int kFieldBits = 20;
constexpr std::size_t kMostChunks = (std::size_t{1} << kFieldBits) - 1;

// A ticket: number of the loop, its chunks, the next one of them. In one word, so that whoever claims a chunk
// knows what it is a chunk of.
std::uint64_t first_ticket(std::uint64_t loop, std::size_t chunks) {
  return loop << (2 * kFieldBits) | static_cast<std::uint64_t>(chunks) << kFieldBits;
}
std::size_t chunks_of(std::uint64_t ticket) {
  return static_cast<std::size_t>(ticket >> kFieldBits) & kMostChunks;
}
std::size_t next_of(std::uint64_t ticket) { return static_cast<std::size_t>(ticket) & kMostChunks; }

void relax() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

}  // namespace

struct Crew::Shared {
  explicit Shared(const Executor& which)
      : executor(which), helpers(static_cast<std::size_t>(which.threads() - 1)) {}

  /// Does one chunk of the loop that is on; false: there is none to begin.
  bool one() {
    std::uint64_t now = ticket.load(std::memory_order_acquire);
    do {
      if (next_of(now) >= chunks_of(now)) return false;
    } while (!ticket.compare_exchange_weak(now, now + 1, std::memory_order_acq_rel));
    // Until it is done the loop cannot end, and `work` stays.
    try {
      (*work)(next_of(now));
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!failure) failure = std::current_exception();
    }
    done.fetch_add(1, std::memory_order_release);
    return true;
  }
  void help(std::atomic<bool>& awake) {
    constexpr std::chrono::microseconds kPatience(500);
    using Clock = std::chrono::steady_clock;
    Clock::time_point last = Clock::now();
    while (!ended.load(std::memory_order_acquire)) {
      if (one()) {
        last = Clock::now();
      } else if (Clock::now() - last > kPatience) {
        break;  // without giving way before: who comes next would keep the processor for milliseconds
      } else {
        relax();
      }
    }
    awake.store(false, std::memory_order_release);
  }

  struct Helper {
    std::atomic<bool> awake{false};
    Executor::Job job;
  };
  const Executor& executor;
  std::atomic<std::uint64_t> ticket{0};
  std::atomic<std::size_t> done{0};  ///< chunks of the loop that is on
  std::atomic<bool> ended{false};
  const std::function<void(std::size_t)>* work = nullptr;  ///< of the loop that is on
  std::uint64_t loops = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  std::vector<Helper> helpers;  ///< go first: they use the others
};

Crew::Crew(const Executor* executor) {
  if (executor != nullptr && executor->threads() > 1) shared_ = std::make_unique<Shared>(*executor);
}

Crew::~Crew() {
  if (shared_ != nullptr) shared_->ended.store(true, std::memory_order_release);
}

void Crew::run(std::size_t chunks, const std::function<void(std::size_t)>& work) {
  if (chunks > kMostChunks) throw std::length_error("Crew: too many chunks");
  Shared& s = *shared_;
  s.work = &work;
  s.done.store(0, std::memory_order_relaxed);
  s.ticket.store(first_ticket(++s.loops, chunks), std::memory_order_release);
  for (Shared::Helper& helper : s.helpers) {
    if (helper.awake.exchange(true, std::memory_order_acq_rel)) continue;
    helper.job = s.executor.submit([&s, &helper] { s.help(helper.awake); });
  }
  while (s.one()) {
  }
  constexpr int kBeforeGivingWay = 10000;
  for (int spins = 0; s.done.load(std::memory_order_acquire) < chunks; ++spins) {
    spins < kBeforeGivingWay ? relax() : std::this_thread::yield();
  }
  if (s.failure) std::rethrow_exception(std::exchange(s.failure, nullptr));
}

}  // namespace plumbline::core
