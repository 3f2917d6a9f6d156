// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Runs as the calls of plumbline.hpp ask for them, and runs in the background, for bindings.
#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "plumbline/session/options.hpp"

namespace plumbline::adjust {
struct AdjustRequest;
}

namespace plumbline::session {

/// While at least one object lives, OpenCV starts no threads of its own; the last one restores their number.
class OpenCvThreads {
 public:
  OpenCvThreads();
  ~OpenCvThreads();
  OpenCvThreads(const OpenCvThreads&) = delete;
  OpenCvThreads& operator=(const OpenCvThreads&) = delete;
};

/// Errors (kUsage): unknown words.
core::Result<dataset::OpenOptions> open_options(const RecordingOptions& options,
                                                const std::filesystem::path& pipelines);

/// Errors as of map() and fuse(); an exception is one (kInternal).
core::Result<pipeline::RunSummary> run_map(const std::string& input, const std::filesystem::path& output,
                                           const MapOptions& options);
core::Result<pipeline::RunSummary> run_fuse(const std::vector<std::filesystem::path>& maps,
                                            const std::filesystem::path& output, const FuseOptions& options);
/// `plumbline adjust`; what is fused again is as FuseOptions say.
core::Result<pipeline::RunSummary> run_adjust(const std::filesystem::path& map,
                                              const std::filesystem::path& output,
                                              const adjust::AdjustRequest& request,
                                              const FuseOptions& options);

/// One run in a thread of its own.
class Background {
 public:
  using Work = std::function<core::Result<pipeline::RunSummary>()>;
  /// `stop`: the work's.
  Background(core::StopToken stop, Work work);
  ~Background();  ///< stops the run and waits for its end

  [[nodiscard]] bool done() const { return done_; }
  void request_stop() const { stop_.request_stop(); }
  /// Waits at most so long; true if the run has ended.
  bool wait(double seconds);
  /// The result of the work, which has ended; before that an error (kInternal).
  core::Result<pipeline::RunSummary> result();

 private:
  core::StopToken stop_;
  std::mutex mutex_;
  std::condition_variable ended_;
  std::atomic<bool> done_{false};
  std::optional<core::Result<pipeline::RunSummary>> result_;
  std::thread thread_;  ///< last: all else is there when it begins
};

}  // namespace plumbline::session
