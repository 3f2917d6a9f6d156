// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages and progress on stderr that do not run into each other; stdout is for results.
#include <chrono>
#include <cstddef>
#include <functional>
#include <mutex>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"

namespace plumbline::cli {

/// Style of progress output.
enum class ProgressStyle {
  kAuto,  ///< one line that is rewritten on a terminal, lines now and then elsewhere
  kJson,  ///< one JSON object a line, for programs
  kNone
};

class Console : public core::Log {
 public:
  Console(bool quiet, bool verbose, ProgressStyle style = ProgressStyle::kAuto);
  ~Console() override;

  void write(core::LogLevel level, const std::string& message) override;

  /// Several problems on separate lines, so that an editor can follow file:line:column. Lines that are
  /// indented belong to the one above.
  void problems(const core::Error& error);
  /// Shows a bar with rate and time left on a terminal, a line every few seconds elsewhere, or one object per
  /// second as JSON; nothing when quiet. `total` 0: not known.
  void progress(std::size_t done, std::size_t total, const char* what);
  /// progress() as a function for work that only reports its counts.
  [[nodiscard]] std::function<void(std::size_t, std::size_t)> counting(const char* what) {
    return [this, what](std::size_t done, std::size_t total) { progress(done, total, what); };
  }
  /// One line that is updated on a terminal, a line every few seconds elsewhere; nothing when quiet. If there
  /// is a bar, it follows that.
  void status(const std::string& line);
  /// Shows the work that remains once all is counted, such as "refine": like status() on a terminal; JSON and
  /// logs get it at once.
  void step(const std::string& name);
  [[nodiscard]] std::function<void(const std::string&)> stepping() {
    return [this](const std::string& name) { step(name); };
  }
  /// Ends the bar's line.
  void end_progress();

 private:
  using Clock = std::chrono::steady_clock;
  void clear_bar();
  void draw_bar(std::size_t done, std::size_t total, const char* what, double elapsed_s) const;
  void put_line(std::size_t done, std::size_t total, const char* what, double elapsed_s) const;

  std::mutex mutex_;
  bool quiet_;
  core::LogLevel threshold_;
  ProgressStyle style_;
  bool terminal_;  ///< that lines may be rewritten on
  bool bar_shown_ = false;
  bool started_ = false;
  std::string note_;  ///< behind the bar
  Clock::time_point start_;
  Clock::time_point last_;
};

/// "1:02:03", "2:03"
std::string clock_text(double seconds);

}  // namespace plumbline::cli
