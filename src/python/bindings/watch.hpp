// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages and progress of a run, which the waiting thread of the interpreter collects.
#include <atomic>
#include <mutex>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::python {

using LogLine = std::tuple<std::string, std::string>;  ///< level as Python's logging names it, message

/// Keeps messages until they are collected. Thread-safe.
class Watch : public core::Log {
 public:
  void write(core::LogLevel level, const std::string& message) override {
    constexpr const char* kNames[] = {"DEBUG", "INFO", "WARNING", "ERROR"};
    const std::lock_guard lock(mutex_);
    lines_.emplace_back(kNames[static_cast<int>(level)], core::printable(message));
  }
  std::vector<LogLine> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(lines_, {});
  }

  std::atomic<std::size_t> frames{0};  ///< done
  std::atomic<std::size_t> total{0};   ///< 0: not known

 private:
  std::mutex mutex_;
  std::vector<LogLine> lines_;
};

}  // namespace plumbline::python
