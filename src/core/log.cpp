// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/log.hpp"

#include <spdlog/logger.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include "plumbline/core/text.hpp"

namespace plumbline::core {
namespace {

class StderrLog : public Log {
 public:
  explicit StderrLog(LogLevel threshold)
      : logger_("plumbline", std::make_shared<spdlog::sinks::stderr_color_sink_mt>()) {
    logger_.set_level(level(threshold));
    logger_.set_pattern("plumbline: %^%l%$: %v");
  }
  void write(LogLevel l, const std::string& message) override { logger_.log(level(l), printable(message)); }

 private:
  static spdlog::level::level_enum level(LogLevel l) {
    constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::debug, spdlog::level::info,
                                                     spdlog::level::warn, spdlog::level::err};
    return kLevels[static_cast<std::size_t>(l)];
  }
  spdlog::logger logger_;
};

class NullLog : public Log {
 public:
  void write(LogLevel /*level*/, const std::string& /*message*/) override {}
};

}  // namespace

std::shared_ptr<Log> stderr_log(LogLevel threshold) { return std::make_shared<StderrLog>(threshold); }
std::shared_ptr<Log> null_log() { return std::make_shared<NullLog>(); }

}  // namespace plumbline::core
