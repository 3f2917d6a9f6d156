// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/session/mapper.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <utility>
#include <vector>

#include "guarded.hpp"
#include "plumbline/dataset/live_frames.hpp"
#include "plumbline/pipeline/observer.hpp"
#include "plumbline/sensor/camera_file.hpp"
#include "plumbline/session/background.hpp"
#include "run_request.hpp"

namespace plumbline {
namespace {

constexpr double kAgain_s = 0.05;  // between two questions whether the run still goes on

}  // namespace

struct Mapper::Impl {
  /// Collects the tracker's poses for waiting callers.
  class Poses : public pipeline::RunObserver {
   public:
    void processed(const pipeline::LivePose& pose) override {
      const std::lock_guard lock(mutex_);
      poses_.push_back(pose);
      changed_.notify_all();
    }

    std::optional<pipeline::LivePose> get(std::size_t number, double seconds) {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return number < poses_.size(); });
      return number < poses_.size() ? std::optional(poses_[number]) : std::nullopt;
    }

   private:
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<pipeline::LivePose> poses_;
  };

  Impl(const sensor::Camera& camera, session::Place where, const MapperOptions& given)
      : options(given),
        place(std::move(where)),
        live(std::make_shared<dataset::LiveFrames>(camera, dataset::LiveFramesOptions{given.name})),
        run(given.stop, [this] { return work(); }) {}
  ~Impl() { live->abandon(); }

  /// Runs the mapping of the frames that are pushed; called on the background thread.
  core::Result<pipeline::RunSummary> work() {
    pipeline::MapRequest request;
    if (auto filled = session::fill(request, options, place.output); !filled)
      return tl::unexpected(filled.error());
    request.input = options.name;
    request.live = live;
    request.observer = poses;
    return session::run_map(request, options);
  }

  MapperOptions options;
  session::Place place;
  std::shared_ptr<dataset::LiveFrames> live;
  std::shared_ptr<Poses> poses = std::make_shared<Poses>();
  std::size_t pushed = 0;
  std::atomic<std::size_t> dropped{0};
  session::Background run;  ///< last: ends before the rest does
};

Mapper::Mapper(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Mapper::Mapper(Mapper&& other) noexcept = default;
Mapper& Mapper::operator=(Mapper&& other) noexcept = default;
Mapper::~Mapper() = default;

core::Result<Mapper> Mapper::start(const sensor::Camera& camera, const std::filesystem::path& output,
                                   const MapperOptions& options) {
  // Wrong arguments are reported before the thread begins
  return session::guarded([&]() -> core::Result<Mapper> {
    if (const std::string problem = sensor::camera_problem(camera); !problem.empty())
      return core::usage_error("camera: " + problem);
    if (options.queue < 1) return core::usage_error("queue: 0 is out of range (allowed: at least 1)");
    auto place = session::place_of(output);
    if (!place) return tl::unexpected(place.error());
    return Mapper(std::make_unique<Impl>(camera, std::move(*place), options));
  });
}

core::Result<std::optional<std::size_t>> Mapper::push(const Frame& frame) {
  return session::guarded([&]() -> core::Result<std::optional<std::size_t>> {
    // A full queue drops the frame or makes the caller wait
    bool room = false;
    while (!room && !impl_->run.done()) {
      room = wait_for_room(impl_->options.drop_late ? 0.0 : kAgain_s);
      if (room || !impl_->options.drop_late) continue;
      ++impl_->dropped;
      return std::nullopt;
    }

    // A run that has ended tells its own error first
    if (impl_->run.done()) {
      if (const auto ended = impl_->run.result(); !ended) return tl::unexpected(ended.error());
      return core::input_error("the run has ended and accepts no more frames");
    }
    return impl_->live->push({frame.stamp, frame.depth_stamp, frame.color, frame.depth, frame.odometry})
        .map([&] { return std::optional(impl_->pushed++); });
  });
}

bool Mapper::wait_for_room(double seconds) const {
  return impl_->live->wait_for_room(impl_->options.queue, seconds);
}

std::optional<Tracked> Mapper::pose(std::size_t number, double seconds) const {
  return impl_->poses->get(number, seconds);
}

std::size_t Mapper::waiting() const { return impl_->live->waiting(); }
std::size_t Mapper::dropped() const { return impl_->dropped; }
void Mapper::close() { impl_->live->close(); }
bool Mapper::wait(double seconds) const { return impl_->run.wait(seconds); }

core::Result<Result> Mapper::finish() {
  return session::guarded([&] {
    // The run finishes the frames that were pushed
    close();
    while (!wait(1.0)) continue;
    return impl_->run.result().and_then(
        [&](const pipeline::RunSummary&) { return Result::open(impl_->place.output, impl_->place.kept); });
  });
}

void Mapper::cancel() {
  impl_->live->abandon();
  impl_->run.request_stop();
}

}  // namespace plumbline
