// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages and progress on stderr that do not run into each other; stdout is for results.
#include <chrono>
#include <cstddef>
#include <functional>
#include <mutex>
#include <string>

#include "plumbline/core/log.hpp"

namespace plumbline::cli {

class Console : public core::Log {
 public:
  Console(bool quiet, bool verbose);
  ~Console() override;

  void write(core::LogLevel level, const std::string& message) override;

  /// A bar with rate and time left on a terminal, a line every few seconds elsewhere; nothing when quiet.
  /// `total` 0: nobody knows.
  void progress(std::size_t done, std::size_t total, const char* what);
  /// progress() for those who only tell how much is done.
  [[nodiscard]] std::function<void(std::size_t, std::size_t)> counting(const char* what) {
    return [this, what](std::size_t done, std::size_t total) { progress(done, total, what); };
  }
  /// One line that is kept up on a terminal, a line every few seconds elsewhere; nothing when quiet. While
  /// there is a bar, it stands behind that.
  void status(const std::string& line);
  /// Ends the bar's line.
  void end_progress();

 private:
  using Clock = std::chrono::steady_clock;
  void clear_bar();
  void draw_bar(std::size_t done, std::size_t total, const char* what, double elapsed_s) const;

  std::mutex mutex_;
  bool quiet_;
  core::LogLevel threshold_;
  bool terminal_;
  bool bar_shown_ = false;
  bool started_ = false;
  std::string note_;  ///< behind the bar
  Clock::time_point start_;
  Clock::time_point last_;
};

/// "1:02:03", "2:03"
std::string clock_text(double seconds);

}  // namespace plumbline::cli
