// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Runs of the library in the background: the interpreter stays free, and the waiting thread collects their
// messages.
#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "bindings.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/pipeline/map_recording.hpp"

namespace plumbline::python {

using LogLine = std::tuple<std::string, std::string>;  ///< level as Python's logging names it, message

/// Keeps messages until they are collected. Thread-safe.
class QueueLog : public core::Log {
 public:
  void write(core::LogLevel level, const std::string& message) override;
  std::vector<LogLine> take();

 private:
  std::mutex mutex_;
  std::vector<LogLine> lines_;
};

/// While at least one object lives, OpenCV starts no threads of its own; the last one restores their number.
class OpenCvThreads {
 public:
  OpenCvThreads();
  ~OpenCvThreads();
  OpenCvThreads(const OpenCvThreads&) = delete;
  OpenCvThreads& operator=(const OpenCvThreads&) = delete;
};

/// One run in a thread of its own.
class Background {
 public:
  using Work = std::function<core::Result<pipeline::RunSummary>(core::Log&, const core::StopToken&,
                                                                const pipeline::Progress&)>;
  explicit Background(Work work);
  ~Background();  ///< stops the run and waits for its end

  [[nodiscard]] bool done() const { return done_; }
  void request_stop() const { stop_.request_stop(); }
  [[nodiscard]] const core::StopToken& stop() const { return stop_; }
  std::vector<LogLine> messages() { return log_.take(); }
  /// Number of frames done, and of all.
  [[nodiscard]] std::tuple<std::size_t, std::size_t> progress() const { return {frames_, total_}; }
  /// Waits at most so long, with the interpreter free. True if the run has ended.
  bool wait(double seconds);
  /// Of a run that has ended: why the result must not be trusted; "": it may be. Throws
  /// Failure.
  std::string reason();

 private:
  QueueLog log_;
  core::StopToken stop_;
  std::atomic<std::size_t> frames_{0};
  std::atomic<std::size_t> total_{0};
  std::mutex mutex_;
  std::condition_variable ended_;
  std::atomic<bool> done_{false};
  std::optional<core::Result<pipeline::RunSummary>> result_;
  std::thread thread_;  ///< last: all else is there when it begins
};

/// Options that `open` and `map` share.
dataset::OpenOptions open_options(const std::filesystem::path& pipelines, const std::string& camera,
                                  const std::string& format, double from_s, std::optional<double> to_s,
                                  int every, const std::string& poses,
                                  const std::map<std::string, std::string>& topics);

}  // namespace plumbline::python
