// SPDX-License-Identifier: BSD-3-Clause
#include "terminal/console.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "plumbline/core/json.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::cli {
namespace {

constexpr double kBarEvery_s = 0.1;
constexpr double kLineEvery_s = 5.0;
constexpr double kObjectEvery_s = 1.0;
constexpr std::size_t kBarWidth = 30;

void put(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stderr); }

const char* label(core::LogLevel level) {
  return level == core::LogLevel::kWarning ? "warning: " : level == core::LogLevel::kError ? "error: " : "";
}

double rate_of(std::size_t done, double elapsed_s) {
  return elapsed_s > 0.0 ? static_cast<double>(done) / elapsed_s : 0.0;
}

/// ", 31.2 a second" of frames; nothing for other things, and where the time is too short to tell.
std::string rate_text(std::size_t done, const char* what, double elapsed_s) {
  constexpr double kLeast_s = 1.0;
  if (std::strcmp(what, "frames") != 0 || elapsed_s < kLeast_s) return "";
  return fmt::format(", {:.1f} a second", rate_of(done, elapsed_s));
}

/// Text for progress whose total is not known.
std::string counted(std::size_t done, const char* what, double elapsed_s) {
  return fmt::format("{} {}{}", done, what, rate_text(done, what, elapsed_s));
}

}  // namespace

std::string clock_text(double seconds) {
  const auto total = static_cast<long>(std::min(std::max(seconds, 0.0), 1e8));
  const long hours = total / 3600;
  if (hours > 0) return fmt::format("{}:{:02}:{:02}", hours, total / 60 % 60, total % 60);
  return fmt::format("{}:{:02}", total / 60, total % 60);
}

Console::Console(bool quiet, bool verbose, ProgressStyle style)
    : quiet_(quiet || style == ProgressStyle::kNone),
      threshold_(quiet     ? core::LogLevel::kWarning
                 : verbose ? core::LogLevel::kDebug
                           : core::LogLevel::kInfo),
      style_(style),
      terminal_(style == ProgressStyle::kAuto && isatty(STDERR_FILENO) != 0) {}

Console::~Console() { end_progress(); }

void Console::write(core::LogLevel level, const std::string& message) {
  if (level < threshold_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  clear_bar();
  put(fmt::format("plumbline: {}{}\n", label(level), core::printable(message)));
}

/// Several problems are counted.
void Console::problems(const core::Error& error) {
  const std::lock_guard<std::mutex> lock(mutex_);
  clear_bar();

  std::size_t problems = 1;
  for (std::size_t i = 1; i < error.message.size(); ++i)
    problems += error.message[i - 1] == '\n' && error.message[i] != ' ' ? 1 : 0;
  put(fmt::format("plumbline: error: {}{}\n", problems > 1 ? fmt::format("{} problems\n", problems) : "",
                  core::printable(error.message, core::Lines::kKept)));
}

void Console::progress(std::size_t done, std::size_t total, const char* what) {
  // Started with the first call
  if (quiet_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = Clock::now();
  if (!started_) {
    started_ = true;
    start_ = last_ = now;
  }

  // Terminals change often, logs rarely
  const double since_last_s = std::chrono::duration<double>(now - last_).count();
  const double every_s = terminal_                        ? kBarEvery_s
                         : style_ == ProgressStyle::kJson ? kObjectEvery_s
                                                          : kLineEvery_s;
  if ((done < total || total == 0) && since_last_s < every_s) return;
  last_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();

  // A bar, a count or a line
  if (terminal_) {
    clear_bar();
    draw_bar(done, total, what, elapsed_s);
    bar_shown_ = true;
  } else if (total == 0 && style_ != ProgressStyle::kJson) {
    put(fmt::format("plumbline: {}{}\n", counted(done, what, elapsed_s), note_));
  } else {
    put_line(done, total, what, elapsed_s);
  }
}

/// A line for logs, or an object for programs.
void Console::put_line(std::size_t done, std::size_t total, const char* what, double elapsed_s) const {
  const double rate = rate_of(done, elapsed_s);
  const double left_s = rate > 0.0 && total > 0 ? static_cast<double>(total - done) / rate : 0.0;
  if (style_ == ProgressStyle::kJson) {
    nlohmann::ordered_json object = {{"event", "progress"}, {"what", what},       {"done", done},
                                     {"total", total},      {"per_second", rate}, {"seconds_left", left_s},
                                     {"seconds", elapsed_s}};
    if (total == 0) object["total"] = object["seconds_left"] = nullptr;  // not known for live sources
    put(core::json_text(object, -1) + "\n");
    return;
  }
  put(fmt::format("plumbline: {} of {} {}{}, {} left{}\n", done, total, what,
                  rate_text(done, what, elapsed_s), clock_text(left_s), note_));
}

/// The name of a step after the last frame.
void Console::step(const std::string& name) {
  if (quiet_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (style_ == ProgressStyle::kJson) {
    const nlohmann::ordered_json object = {{"event", "step"}, {"what", name}};
    put(core::json_text(object, -1) + "\n");
  } else if (terminal_) {
    clear_bar();
    put(fmt::format("finishing: {}", name));
    std::fflush(stderr);
    bar_shown_ = true;
  } else {
    put(fmt::format("plumbline: finishing: {}\n", name));
  }
}

/// A line that replaces the last one on a terminal.
void Console::status(const std::string& line) {
  if (quiet_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (style_ == ProgressStyle::kJson) return;
  if (started_) {
    note_ = "  " + core::printable(line);
    return;
  }
  const auto now = Clock::now();
  const double since_last_s = std::chrono::duration<double>(now - last_).count();
  if (since_last_s < (terminal_ ? kBarEvery_s : kLineEvery_s)) return;
  last_ = now;
  clear_bar();
  put(terminal_ ? core::printable(line) : fmt::format("plumbline: {}\n", core::printable(line)));
  bar_shown_ = terminal_;
}

/// A bar with speed and time left.
void Console::draw_bar(std::size_t done, std::size_t total, const char* what, double elapsed_s) const {
  if (total == 0) {
    put(fmt::format("{}  {}{}", counted(done, what, elapsed_s), clock_text(elapsed_s), note_));
    std::fflush(stderr);
    return;
  }
  const double share = total > 0 ? static_cast<double>(done) / static_cast<double>(total) : 1.0;
  const auto filled = static_cast<std::size_t>(std::lround(share * static_cast<double>(kBarWidth)));
  const double rate = rate_of(done, elapsed_s);
  const double left_s = rate > 0.0 ? static_cast<double>(total - done) / rate : 0.0;
  put(fmt::format("[{}{}] {}/{} {}{}  ETA {}{}", std::string(filled, '='),
                  std::string(kBarWidth - filled, ' '), done, total, what, rate_text(done, what, elapsed_s),
                  clock_text(left_s), note_));
  std::fflush(stderr);
}

void Console::clear_bar() {
  if (!bar_shown_) return;
  put("\r\033[K");
  bar_shown_ = false;
}

void Console::end_progress() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (bar_shown_) put("\n");
  bar_shown_ = false;
  started_ = false;
  note_.clear();
}

}  // namespace plumbline::cli
