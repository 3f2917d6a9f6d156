// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/dataset/play.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "bags/bag_parts.hpp"
#include "bags/bag_recording.hpp"
#include "convert/copy_target.hpp"

namespace plumbline::dataset {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::chrono::milliseconds kLookForListeners(20);     // for listeners, and whether to stop
constexpr std::chrono::milliseconds kAfterFirstListener(500);  // its other subscriptions may come
constexpr std::chrono::milliseconds kLastWords(2000);
constexpr std::size_t kReportedOneByOne = 5;  // frames that are left out

/// A bag whose messages are sent as they are written. The first frame is only read: subscribers have to know
/// the topics before it is sent.
class SinkWriter final : public BagWriter {
 public:
  SinkWriter(MessageSink& sink, const MessageEncoder& encoder) : sink_(sink), encoder_(encoder) {}

  void write(const std::string& topic, const ImageMessage& message) override {
    send(topic, "sensor_msgs/Image", [&] { return encoder_.image(message); });
  }
  void write(const std::string& topic, const CompressedImageMessage& message) override {
    send(topic, "sensor_msgs/CompressedImage", [&] { return encoder_.compressed_image(message); });
  }
  void write(const std::string& topic, const CameraInfoMessage& message) override {
    send(topic, "sensor_msgs/CameraInfo", [&] { return encoder_.camera_info(message); });
  }
  void write(const std::string& topic, const std::vector<TransformMessage>& transforms,
             std::int64_t stamp_ns) override {
    if (!announce(topic, "tf2_msgs/TFMessage", Retention::kLatest)) return;
    keep(sink_.send(topic, encoder_.transforms(transforms, stamp_ns)));
  }
  void write_bytes(const std::string& topic, const std::string& type, std::int64_t /*log_ns*/,
                   const Bytes& cdr) override {
    send(topic, type, [&] { return cdr; });
  }
  void write_camera_yaml(const std::string& /*text*/) override {}
  core::Result<void> finish() override { return problem_; }

  void only_announce(bool only) { only_announce_ = only; }
  [[nodiscard]] const core::Result<void>& problem() const { return problem_; }
  [[nodiscard]] bool heard() const {
    return std::any_of(images_.begin(), images_.end(),
                       [this](const std::string& topic) { return sink_.listeners(topic) > 0; });
  }

 private:
  template <typename Encode>
  void send(const std::string& topic, const std::string& type, const Encode& encode) {
    if (!announce(topic, type, Retention::kPassing) || only_announce_) return;
    keep(sink_.send(topic, encode()));
  }
  bool announce(const std::string& topic, const std::string& type, Retention retention) {
    // Subscribers of images start the replay
    const bool image = type.find("Image") != std::string::npos;
    if (image && std::find(images_.begin(), images_.end(), topic) == images_.end()) images_.push_back(topic);
    auto announced = sink_.announce(topic, type, retention);
    const bool good = announced.has_value();
    keep(std::move(announced));
    return good;
  }
  void keep(core::Result<void> result) {
    if (problem_ && !result) problem_ = std::move(result);
  }

  MessageSink& sink_;
  const MessageEncoder& encoder_;
  std::vector<std::string> images_;  ///< topics
  bool only_announce_ = false;
  core::Result<void> problem_;
};

class Player {
 public:
  Player(const FrameSource& source, MessageSink& sink, const MessageEncoder& encoder,
         const PlayOptions& options, core::Log& log)
      : source_(source), sink_(sink), options_(options), log_(log) {
    auto writer = std::make_unique<SinkWriter>(sink, encoder);
    writer_ = writer.get();
    target_ = make_message_target(std::move(writer), source.camera(), true, nullptr, log);

    // Repetitions follow after the usual step
    std::vector<PairInfo> infos;
    for (std::size_t i = 0; i < source.size(); ++i) infos.push_back(source.info(i));
    step_s_ = 1.0 / usual_fps(infos);
  }

  core::Result<PlaySummary> play() {
    if (auto announced = announce(); !announced) return tl::unexpected(announced.error());
    wait_for_listener();
    start_ = Clock::now();
    const double first = source_.info(0).stamp;
    const double last = source_.info(source_.size() - 1).stamp;

    // Stamps of each round continue the last
    for (std::size_t round = 0; !options_.stop.stop_requested() && (round == 0 || options_.loop); ++round) {
      offset_s_ = static_cast<double>(round) * (last - first + step_s_);
      if (auto played = play_once(first); !played) return tl::unexpected(played.error());
      if (summary_.published == 0)
        return core::input_error(
            fmt::format("{}: no frame can be read; the first: {}", source_.name(), first_error_));
    }
    sink_.flush(kLastWords);
    return summary_;
  }

 private:
  /// Topics are those of the first frame that can be read.
  core::Result<void> announce() {
    writer_->only_announce(true);
    for (std::size_t i = 0; i < source_.size(); ++i) {
      const auto pair = source_.stored(i);
      if (pair && target_->add(0, 0, *pair)) break;
    }
    writer_->only_announce(false);
    return writer_->problem();
  }

  void wait_for_listener() {
    // A late subscriber would miss the first frames
    const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(options_.wait_s));
    if (!writer_->heard()) log_.info("waiting for a subscriber");
    while (!writer_->heard() && Clock::now() < until && !options_.stop.stop_requested())
      std::this_thread::sleep_for(kLookForListeners);
    if (writer_->heard()) {
      std::this_thread::sleep_for(kAfterFirstListener);
    } else if (options_.wait_s > 0.0) {
      log_.info("no subscriber; playing nevertheless");
    }
  }

  core::Result<void> play_once(double first) {
    for (std::size_t i = 0; i < source_.size() && !options_.stop.stop_requested(); ++i) {
      const PairInfo info = source_.info(i);
      // Decoded before it is due.
      const auto pair = source_.stored(i);
      wait_until_due(info.stamp - first);

      core::Result<void> added;
      if (pair) {
        added =
            target_->add(nanoseconds(info.stamp + offset_s_),
                         nanoseconds(info.depth_stamp - source_.camera().depth_delay_s + offset_s_), *pair);
      }
      if (!writer_->problem()) return writer_->problem();

      const core::Error* problem = !pair ? &pair.error() : !added ? &added.error() : nullptr;
      if (problem != nullptr && summary_.unreadable++ == 0) first_error_ = problem->message;
      if (problem != nullptr && summary_.unreadable <= kReportedOneByOne)
        log_.warning(fmt::format("frame {} is left out: {}", i, problem->message));
      if (problem == nullptr) ++summary_.published;
      ++frames_;
      if (options_.progress) options_.progress(frames_, options_.loop ? 0 : source_.size());
    }

    return {};
  }

  void wait_until_due(double since_first_s) {
    // A fixed pace replaces the recorded stamps
    const double due_s =
        options_.pace_hz > 0.0 ? static_cast<double>(frames_) / options_.pace_hz : since_first_s + offset_s_;
    const auto due = start_ + std::chrono::duration_cast<Clock::duration>(Seconds(due_s));

    // Short sleeps, so that a stop takes effect
    while (Clock::now() < due && !options_.stop.stop_requested())
      std::this_thread::sleep_until(std::min(due, Clock::now() + kLookForListeners));
    summary_.late_s = std::max(summary_.late_s, Seconds(Clock::now() - due).count());
  }

  const FrameSource& source_;
  MessageSink& sink_;
  const PlayOptions& options_;
  core::Log& log_;
  std::unique_ptr<CopyTarget> target_;
  SinkWriter* writer_ = nullptr;  ///< the target's
  double step_s_ = 0.0;
  double offset_s_ = 0.0;  ///< time offset of this repetition
  Clock::time_point start_;
  std::size_t frames_ = 0;
  PlaySummary summary_;
  std::string first_error_;
};

}  // namespace

core::Result<PlaySummary> play_recording(const FrameSource& source, MessageSink& sink,
                                         const PlayOptions& options, core::Log& log) {
  const auto& part = core::part<BagReaders>();
  if (!part) return tl::unexpected(part.error());
  return Player(source, sink, (*part)->encoder(), options, log).play();
}

}  // namespace plumbline::dataset
