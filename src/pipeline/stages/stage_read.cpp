// SPDX-License-Identifier: BSD-3-Clause
// read: frames of the recording, decoded and rectified.
#include <fmt/format.h>

#include <atomic>
#include <utility>

#include "options/convention_option.hpp"
#include "plumbline/diagnose/signs.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "results/resumed_run.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"
#include "summary/signs.hpp"

namespace plumbline::pipeline {
namespace {

constexpr std::size_t kReportedOneByOne = 5;

Json live_section(const dataset::LiveReport& live) {
  return {{"taken", live.taken},
          {"dropped", live.dropped},
          {"stamps_backwards", live.backwards},
          {"unpaired_images", live.unpaired},
          {"lost_messages", live.lost},
          {"kept_frames", live.kept},
          {"kept_bytes", live.kept_bytes}};
}

class ReadStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    declare_convention(table, "poses_are", poses_are_, "the recorder's own odometry");
  }
  core::Result<void> start(const RunContext& context) override {
    source_ = context.input.source;
    log_ = context.log;
    executor_ = context.executor;
    asked_ = &context.asked;
    recordings_ = context.input.recordings;
    const bool live = recordings_ != nullptr && recordings_->live() != nullptr;
    if (source_ == nullptr || (source_->size() == 0 && !live))
      return core::input_error("the recording has no frames");

    // Samples of the frames are searched at the end for common mistakes, such as depth along the ray.
    if (recordings_ != nullptr) {
      for (const RobotInfo& robot : recordings_->robots()) {
        const std::size_t frames = live ? 0 : recordings_->frames_of(robot.number);
        samples_.push_back(std::make_unique<diagnose::Samples>(robot.camera.color, frames));
      }
    }

    // Frames that the interrupted run has done are not read again, but count in the totals.
    if (context.resumed != nullptr) {
      resumed_ = context.resumed->rows.size();
      read_ = resumed_;
      unreadable_ = context.resumed->frames - resumed_;
    }
    return {};
  }
  [[nodiscard]] std::size_t frames() const override { return source_->size(); }

  /// A frame that cannot be read is skipped; later frames are not affected. Memory or files that are short
  /// end the run: all frames would be skipped for them.
  core::Result<void> process(StageIo& io) override {
    auto frame = source_->read(io.frame());
    if (!frame && frame.error().kind == core::ErrorKind::kOutput) return tl::unexpected(frame.error());
    if (!frame) {
      // A damaged recording may have thousands of such frames; after the first few only their number is
      // reported.
      const std::size_t reported = unreadable_++;
      const std::string text = fmt::format("frame {} is skipped: {}", io.frame(), frame.error().message);

      if (reported < kReportedOneByOne) {
        log_->warning(text);
      } else {
        log_->debug(text);
      }

      return {};
    }

    ++read_;
    if (frame->odometry) {
      frame->odometry = geometry::read_by(poses_are_, *frame->odometry);
      ++odometry_;
    }

    if (recordings_ != nullptr)
      samples_[static_cast<std::size_t>(recordings_->robot_of(io.frame()))]->add(*frame);
    io.output<sensor::RgbdFrame>("frame", std::make_shared<sensor::RgbdFrame>(std::move(*frame)));

    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    if (io.frame() == 0) {
      return asked_->stop_requested()
                 ? core::failure(core::ErrorKind::kStopped,
                                 "stopped before the first frame was mapped; nothing is written")
                 : core::input_error(
                       fmt::format("{}: ended before its first frame; nothing is written", source_->name()));
    }

    // The number of frames without a message of their own
    if (unreadable_ > kReportedOneByOne) {
      log_->warning(
          fmt::format("{} of {} frames could not be read and were skipped", unreadable_.load(), io.frame()));
    }
    if (read_ == 0) {
      return core::input_error(fmt::format("{}: none of {} frames could be read; see the warnings above",
                                           source_->name(), io.frame()));
    }

    // The samples are complete, and nothing else at the end depends on what is found in them.
    if (!asked_->stop_requested()) search_ = executor_->submit([this] { look_for_signs(); });
    return {};
  }
  void settle() override {
    search_.wait();
    for (std::size_t r = 0; r < found_.size(); ++r) {
      const std::string name = found_.size() > 1 ? recordings_->robot(static_cast<std::int32_t>(r)).name : "";
      add_signs(name, std::move(found_[r]), *log_, signs_);
    }
  }

  void report(Json& summary) const override {
    FrameCounts frames(summary);
    frames.read = read_.load();
    frames.resumed = resumed_;
    frames.unreadable = unreadable_.load();
    frames.missing = source_->missing();
    frames.odometry = odometry_.load();
    frames.write(summary);
    if (recordings_ != nullptr && recordings_->live() != nullptr)
      summary["live"] = live_section(recordings_->live()->report());
    report_signs(signs_, summary);
    summary["unchecked"] = still_ ? Json{"camera", "scale"} : Json{"scale"};
  }
  void doubt(const Json& /*summary*/, std::vector<Doubt>& reasons) const override {
    if (const std::string doubt = source_->doubt(); !doubt.empty())
      reasons.push_back({Doubt::About::kRecording, doubt});
    doubt_signs(signs_, reasons);
  }

 private:
  void look_for_signs() {
    still_ = !samples_.empty();
    for (std::size_t r = 0; r < samples_.size(); ++r) {
      std::vector<diagnose::Sign>& signs = found_.emplace_back();
      signs = diagnose::signs_of(*samples_[r]);
      const auto number = static_cast<std::int32_t>(r);

      // Poses that came along, as they were read.
      if (auto truth = odometry_ > 0 ? recordings_->truth_of(number) : std::nullopt) {
        for (geometry::StampedPose& pose : *truth)
          pose.world_from_camera = geometry::read_by(poses_are_, pose.world_from_camera);
        signs.push_back(diagnose::pose_sign(*samples_[r], *truth));
        // Odometry only starts each frame's search.
        if (signs.back().certainty == diagnose::Certainty::kCertain)
          signs.back().certainty = diagnose::Certainty::kLikely;
      }

      still_ = still_ && diagnose::stood_still(*samples_[r]);
      samples_[r].reset();
    }
    samples_.clear();
  }

  const dataset::FrameSource* source_ = nullptr;
  core::Log* log_ = nullptr;
  const core::Executor* executor_ = nullptr;
  const core::StopToken* asked_ = nullptr;
  const RobotRecordings* recordings_ = nullptr;
  std::vector<std::unique_ptr<diagnose::Samples>> samples_;  ///< by robot
  std::vector<std::vector<diagnose::Sign>> found_;           ///< by robot
  std::vector<diagnose::Sign> signs_;
  bool still_ = false;
  geometry::PoseConvention poses_are_ = geometry::PoseConvention::kWorldFromCamera;
  std::size_t resumed_ = 0;
  std::atomic<std::size_t> read_{0};
  std::atomic<std::size_t> unreadable_{0};
  std::atomic<std::size_t> odometry_{0};
  core::Executor::Job search_;  ///< for signs; last, so that it ends before what it uses
};

}  // namespace

StageType read_stage() {
  return stage_type<ReadStage>("read",
                               "Reads the recording: decodes, undistorts and registers colour and depth",
                               Mode::kStateless, {}, {{"frame", frame_port()}});
}

}  // namespace plumbline::pipeline
