// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <malloc.h>
#include <oneapi/tbb/parallel_pipeline.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "plumbline/core/numbers.hpp"
#include "plumbline/core/shortage.hpp"
#include "plumbline/pipeline/observer.hpp"
#include "plumbline/pipeline/run.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "results/resumed_run.hpp"
#include "run/pace.hpp"

namespace plumbline::pipeline {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// One frame in progress, with the outputs of each stage so far.
struct Tick {
  std::size_t frame = 0;
  std::vector<std::vector<Value>> outputs;  ///< [node][port]
  std::vector<float> ms;                    ///< [node]
};
using TickPtr = std::shared_ptr<Tick>;

/// Remembers the failure of the earliest frame. Frames before it are still processed, so which failure is
/// reported does not depend on the number of threads.
class FirstFailure {
 public:
  [[nodiscard]] bool any() const { return frame_.load() != kNone; }
  [[nodiscard]] bool before(std::size_t frame) const { return frame_.load() <= frame; }
  void note(std::size_t frame, core::Error error) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (frame >= frame_.load()) return;
    error_ = std::move(error);
    frame_.store(frame);
  }
  [[nodiscard]] core::Error error() const { return error_; }

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::atomic<std::size_t> frame_{kNone};
  std::mutex mutex_;
  core::Error error_;
};

/// Expected failures and exceptions alike become errors that name the stage.
template <typename Call>
core::Result<void> guarded(const std::string& stage, const Call& call) {
  try {
    return call();
  } catch (const std::exception& e) {
    const core::Error error = core::error_of(e);
    return core::failure(error.kind, fmt::format("stage {}: {}", stage, error.message));
  }
}

/// Returns the allocator's free pages to the system, if it keeps them.
void give_back_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

class Runner {
 public:
  Runner(Graph& graph, const RunContext& context, const Progress& progress, double pace_hz)
      : graph_(graph),
        context_(context),
        progress_(progress),
        pace_hz_(pace_hz),
        last_use_(graph.nodes.size()) {
    for (std::size_t n = 0; n < graph_.nodes.size(); ++n) {
      last_use_[n] = n;
      for (const auto& input : graph_.nodes[n].inputs) {
        if (input) last_use_[input->node] = n;
      }
    }
  }

  core::Result<RunReport> run() {
    tell_observer();
    for (Node& node : graph_.nodes) {
      auto started = guarded(node.name, [&] { return node.stage->start(context_); });
      if (!started) return tl::unexpected(started.error());
    }

    if (context_.input.recordings != nullptr) live_ = context_.input.recordings->live();
    total_ = live_ != nullptr ? std::numeric_limits<std::size_t>::max() : graph_.source().stage->frames();
    for (const Node& node : graph_.nodes) report_.stages.push_back({node.name, {}, 0.0});
    skip_done();
    const auto start = Clock::now();
    pace_.emplace(pace_hz_, started_, context_.input.recordings);

    // A pipeline ends when the next frame is not due yet, and another one begins with that frame: waiting for
    // a frame blocks no thread that has other work.
    while (!ended()) {
      pace_->wait_for(started_, context_.stop);
      wait_for_live();
      context_.executor->run([this] { stream(); });
    }

    report_.behind_s = pace_->behind_s();
    if (failure_.any()) return tl::unexpected(failure_.error());
    if (given_up()) return core::input_error("the run was given up; nothing is written");

    if (live_ != nullptr) total_ = std::max(started_, std::min(total_, live_->size()));
    report_.frames = started_;
    report_.frames_available = total_;
    report_.stopped = report_.frames < total_;

    for (StageTiming& stage : report_.stages) stage.frame_ms.resize(report_.frames, kUnknown);
    report_.rss_mb.resize(report_.frames, kUnknown);
    if (auto finished = finish(start); !finished) return tl::unexpected(finished.error());

    return std::move(report_);
  }

 private:
  void tell_observer() {
    if (context_.hooks.observer == nullptr || context_.input.robots == nullptr) return;
    std::vector<std::string> names;
    for (const maps::RobotInfo& robot : *context_.input.robots) names.push_back(robot.name);
    context_.hooks.observer->begins(names);
  }

  /// All stages as one oneTBB pipeline in graph order.
  void stream() {
    using Filter = tbb::filter<TickPtr, TickPtr>;
    auto source = tbb::make_filter<void, TickPtr>(
        tbb::filter_mode::serial_in_order, [this](tbb::flow_control& control) { return next(control); });
    std::optional<Filter> stages;
    for (std::size_t n = 0; n < graph_.nodes.size(); ++n) {
      const auto mode = graph_.nodes[n].type->mode == Mode::kStateless ? tbb::filter_mode::parallel
                                                                       : tbb::filter_mode::serial_in_order;
      const Filter stage = tbb::make_filter<TickPtr, TickPtr>(mode, [this, n](TickPtr tick) {
        work(n, *tick);
        return tick;
      });
      stages = stages ? Filter(*stages & stage) : stage;
    }
    auto sink = tbb::make_filter<TickPtr, void>(tbb::filter_mode::serial_in_order,
                                                [this](const TickPtr& tick) { done(*tick); });
    const auto wanted = static_cast<std::size_t>(2 * context_.executor->threads() + 2);
    tbb::parallel_pipeline(std::min(wanted, kMostUnderWay), source & *stages & sink);
  }

  [[nodiscard]] bool ended() const {
    return started_ >= total_ || context_.stop.stop_requested() || failure_.any() || given_up();
  }

  [[nodiscard]] bool given_up() const { return live_ != nullptr && live_->given_up(); }

  /// Sets the final number of frames when a live source has ended.
  void look_at_live() {
    if (live_ == nullptr || ended() || !live_->decided(started_)) return;
    if (const std::size_t frames = live_->size(); frames <= started_) total_ = frames;
  }
  void wait_for_live() {
    constexpr std::chrono::milliseconds kLookUp(20);
    while (live_ != nullptr && !ended() && !live_->decided(started_)) live_->wait_for(started_, kLookUp);
    look_at_live();
  }

  /// Skips frames that were done by the run which this one continues.
  void skip_done() {
    while (started_ < total_ && context_.resumed != nullptr && context_.resumed->done[started_]) ++started_;
  }

  TickPtr next(tbb::flow_control& control) {
    look_at_live();
    if (ended() || (live_ != nullptr && !live_->decided(started_)) || !pace_->is_due(started_)) {
      control.stop();
      return nullptr;
    }
    auto tick = std::make_shared<Tick>();
    tick->frame = started_++;
    if (live_ != nullptr) live_->hand_out(tick->frame);
    skip_done();
    tick->outputs.resize(graph_.nodes.size());
    tick->ms.assign(graph_.nodes.size(), std::numeric_limits<float>::quiet_NaN());
    return tick;
  }

  void work(std::size_t n, Tick& tick) {
    if (failure_.before(tick.frame)) return;
    Node& node = graph_.nodes[n];
    const StageType& type = *node.type;
    StageIo io(tick.frame, type.inputs, type.outputs);
    tick.outputs[n].resize(type.outputs.size());

    // A stage runs only on complete inputs: an earlier one that skips a frame makes the later ones skip it.
    // Stages without inputs per frame work at the end.
    bool takes_frames = type.is_source();
    for (std::size_t i = 0; i < type.inputs.size(); ++i) {
      if (type.inputs[i].type.rate != Rate::kFrame || !node.inputs[i]) continue;
      takes_frames = true;
      io.input_values()[i] = tick.outputs[node.inputs[i]->node][node.inputs[i]->port];
      if (type.inputs[i].required && !io.input_values()[i]) return release(n, tick);
    }
    if (!takes_frames) return;

    const auto start = Clock::now();
    auto worked = guarded(node.name, [&] { return node.stage->process(io); });
    tick.ms[n] = static_cast<float>(ms_since(start));
    if (!worked) return failure_.note(tick.frame, worked.error());
    tick.outputs[n] = std::move(io.output_values());
    release(n, tick);
  }

  /// Frees values that no stage will read any more.
  void release(std::size_t n, Tick& tick) const {
    for (std::size_t m = 0; m <= n; ++m) {
      if (last_use_[m] == n) tick.outputs[m].clear();
    }
  }

  void done(const Tick& tick) {
    if (failure_.before(tick.frame)) return;
    for (std::size_t n = 0; n < tick.ms.size(); ++n) {
      report_.stages[n].frame_ms.resize(tick.frame + 1, kUnknown);
      report_.stages[n].frame_ms.back() = tick.ms[n];
    }
    report_.rss_mb.resize(tick.frame + 1, kUnknown);
    report_.rss_mb.back() = static_cast<float>(rss_mb());
    pace_->done(tick.frame);
    if (live_ != nullptr) live_->release(tick.frame);
    if (progress_) progress_(tick.frame + 1, live_ != nullptr ? 0 : total_);
  }

  core::Result<void> finish(Clock::time_point start) {
    std::vector<std::vector<Value>> results(graph_.nodes.size());
    report_.map_s = ms_since(start) / 1000.0;

    for (std::size_t first = 0, count = 0; first < graph_.nodes.size(); first += count) {
      count = 1;
      while (first + count < graph_.nodes.size() && may_export_beside(first, first + count)) ++count;
      report_finishing(first, count);

      const auto began = Clock::now();
      std::vector<core::Result<void>> finished(count);
      std::vector<core::Executor::Job> beside;
      for (std::size_t k = 0; k + 1 < count; ++k)
        beside.push_back(
            context_.executor->submit([&, k] { finished[k] = finish_stage(first + k, results); }));
      finished[count - 1] = finish_stage(first + count - 1, results);

      for (core::Executor::Job& job : beside) job.wait();
      const double seconds = ms_since(began) / 1000.0;
      (graph_.nodes[first].type->exports ? report_.export_s : report_.map_s) += seconds;

      for (const auto& one : finished) {
        if (!one) return one;
      }

      // Results that no stage will read again are returned to the system at once: the next stage may need the
      // memory.
      for (std::size_t m = 0; m < first + count; ++m) {
        if (last_use_[m] < first + count) results[m].clear();
      }

      give_back_memory();
      for (std::size_t n = first; n < first + count; ++n) {
        context_.log->debug(fmt::format("{}: its end took {:.0f} ms; {:.0f} MB are held, {:.0f} MB at most",
                                        graph_.nodes[n].name, report_.stages[n].finish_ms, rss_mb(),
                                        peak_rss_mb()));
      }
    }

    for (Node& node : graph_.nodes) {
      auto settled = guarded(node.name, [&]() -> core::Result<void> {
        node.stage->settle();
        return {};
      });
      if (!settled) return settled;
    }
    return {};
  }

  /// Taps only write, and are not reported.
  void report_finishing(std::size_t first, std::size_t count) const {
    if (!context_.hooks.finishing) return;
    std::string names;
    for (std::size_t n = first; n < first + count; ++n) {
      if (!graph_.nodes[n].tap) names += (names.empty() ? "" : ", ") + graph_.nodes[n].name;
    }
    if (!names.empty()) context_.hooks.finishing(names);
  }

  /// True if node `n` and those from `first` on only write results, and none of them reads another one's.
  [[nodiscard]] bool may_export_beside(std::size_t first, std::size_t n) const {
    if (!graph_.nodes[first].type->exports || !graph_.nodes[n].type->exports) return false;
    const auto& inputs = graph_.nodes[n].inputs;
    return std::none_of(inputs.begin(), inputs.end(),
                        [&](const auto& input) { return input && input->node >= first; });
  }

  core::Result<void> finish_stage(std::size_t n, std::vector<std::vector<Value>>& results) {
    Node& node = graph_.nodes[n];
    StageIo io(report_.frames, node.type->inputs, node.type->outputs);
    for (std::size_t i = 0; i < node.inputs.size(); ++i) {
      if (node.type->inputs[i].type.rate != Rate::kEnd || !node.inputs[i]) continue;
      io.input_values()[i] = results[node.inputs[i]->node][node.inputs[i]->port];
    }

    const auto start = Clock::now();

    // A required input without a value is an error of the program; thrown inside the guard, it names the
    // stage.
    auto finished = guarded(node.name, [&]() -> core::Result<void> {
      for (std::size_t i = 0; i < node.inputs.size(); ++i) {
        const Port& port = node.type->inputs[i];
        if (port.type.rate == Rate::kEnd && port.required && !io.input_values()[i]) {
          throw std::logic_error("nothing was received for its input " + port.name);
        }
      }
      return node.stage->finish(io);
    });

    report_.stages[n].finish_ms = ms_since(start);
    results[n] = std::move(io.output_values());
    return finished;
  }

  Graph& graph_;
  const RunContext& context_;
  const Progress& progress_;
  double pace_hz_;
  std::vector<std::size_t> last_use_;  ///< [node]: the last node that reads from it
  FirstFailure failure_;
  dataset::LiveFrameSource* live_ = nullptr;  ///< null: frames are those of recordings
  std::size_t total_ = 0;                     ///< frames; of a live source more than any until it has ended
  std::size_t started_ = 0;                   ///< frames, or done by an earlier run
  std::optional<Pace> pace_;
  RunReport report_;
};

}  // namespace

double StageTiming::quantile_ms(double q) const {
  return static_cast<double>(core::quantile(frame_ms, q, 0.0F));
}

core::Result<RunReport> run_graph(Graph& graph, const RunContext& context, const Progress& progress,
                                  double pace_hz) {
  try {
    return Runner(graph, context, progress, pace_hz).run();
  } catch (const std::exception& e) {  // between stages, where memory may end as well
    return tl::unexpected(core::error_of(e));
  }
}

}  // namespace plumbline::pipeline
