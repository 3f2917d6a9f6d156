// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The logger that is passed in. Messages are whole sentences for users; format with fmt::format.
#include <memory>
#include <string>

namespace plumbline::core {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

class Log {
 public:
  virtual ~Log() = default;
  virtual void write(LogLevel level, const std::string& message) = 0;

  void debug(const std::string& m) { write(LogLevel::kDebug, m); }
  void info(const std::string& m) { write(LogLevel::kInfo, m); }
  void warning(const std::string& m) { write(LogLevel::kWarning, m); }
  void error(const std::string& m) { write(LogLevel::kError, m); }
};

/// Writes to stderr, messages below `threshold` dropped. Thread-safe.
std::shared_ptr<Log> stderr_log(LogLevel threshold);

/// Drops everything.
std::shared_ptr<Log> null_log();

}  // namespace plumbline::core
