// SPDX-License-Identifier: BSD-3-Clause
// track: the SLAM of each robot, frame by frame: poses, keyframes, landmarks.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "stages/camera_decision.hpp"
#include "stages/debug_video.hpp"
#include "stages/resumed_run.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

// What a map has seen when it is asked for its camera: keyframes or seconds.
constexpr std::size_t kCameraKeyframes = 40;
constexpr double kCamera_s = 10.0;
// Live the answer is waited for so many frames later, and used so many after that: by then no frame that it
// is for has been read, whatever the number of threads.
constexpr std::size_t kAnswerFrames = 96;
constexpr std::size_t kUseFrames = kMostUnderWay;

/// What the cameras are, while it is being looked for.
struct LiveAnswer {
  CameraDecision decision;
  std::size_t due = 0;      ///< the frame at which it is waited for
  core::Executor::Job job;  ///< last: its destructor waits for it
};

class TrackStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.choice("camera.refine", refine_, {"auto", "live", "off"},
                 "Whether a run looks for a better camera in its own map, after 40 keyframes, 10 s or at its "
                 "end: auto begins again with it, live goes on with it 160 frames later");
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    for (const RobotInfo& robot : recordings().robots()) {
      slams_.push_back(std::make_unique<mapping::Slam>(options_, robot.camera.color, robot.number,
                                                       *context.executor, *context.log));
      if (context.feedback != nullptr) slams_.back()->use(context.feedback);
    }
    revisions_.resize(slams_.size());
    set_shutters(0);
    if (refine_ == "off" && context.cameras != nullptr) {
      if (auto settled = context.cameras->settle(context); !settled) return settled;
    }
    if (context.resumed == nullptr) return {};
    rows_ = context.resumed->rows;
    for (const auto& [robot, map] : context.resumed->maps) {
      const auto number = static_cast<std::size_t>(robot);
      slams_.at(number)->restore(map.map, map.frames);
      revisions_[number] = slams_[number]->map().now();
    }
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const auto features = io.input<features::FrameFeatures>("features");
    const RobotInfo& robot = recordings().robot(recordings().robot_of(io.frame()));
    const auto number = static_cast<std::size_t>(robot.number);
    if (refine_ == "live") set_shutters(io.frame());
    mapping::Slam& slam = *slams_[number];
    const std::size_t poses = slam.frame_poses().size();
    const mapping::FrameReport report = slam.process(*frame, features);
    rows_.push_back({io.frame(), tracking::to_string(report.state),
                     several() ? robot.name + "," + row_columns(report) : row_columns(report)});
    if (report.keyframe.valid()) ++causes_[report.decision.cause];
    note_times(io.frame(), report.bundle);
    auto tracked = std::make_shared<TrackedFrame>();
    tracked->robot = robot.number;
    tracked->keyframe = report.keyframe;
    tracked->stamp = report.stamp;
    tracked->depth_from_camera = report.depth_from_camera;
    tracked->row = rows_.back();
    if (slam.frame_poses().size() > poses) tracked->pose = slam.frame_poses().back();
    if (tracked->pose && tracked->pose->tracked) {
      tracked->frame = {robot.number, static_cast<std::int32_t>(poses)};
    }
    if (report.keyframe.valid()) {
      if (several()) tracked->map = std::make_shared<maps::Map>(slam.map());
      if (context_->keeps_map) {
        tracked->changes = std::make_shared<maps::MapChanges>(slam.map().changes_since(revisions_[number]));
        revisions_[number] = slam.map().now();
      }
    }
    io.output<TrackedFrame>("track", tracked);
    if (auto decided = decide(io.frame()); !decided) return decided;
    if (context_->debug_folder.empty()) return {};
    return write_debug_picture(context_->debug_folder, io.frame(), *frame, *features, slam, report,
                               robot.camera.color);
  }

  core::Result<void> finish(StageIo& io) override {
    auto result = std::make_shared<RobotMaps>();
    // Robots take turns; of those that went on from where they were, some were behind others.
    std::sort(rows_.begin(), rows_.end(),
              [](const FrameRow& a, const FrameRow& b) { return a.frame < b.frame; });
    result->frame_columns = several() ? std::string("robot,") + kRowColumns : kRowColumns;
    result->frames = rows_;
    if (context_->resumed != nullptr && context_->resumed->merged) {
      result->maps.push_back(*context_->resumed->merged);
      io.output<RobotMaps>("maps", result);
      return {};
    }
    for (const auto& slam : slams_) slam->finish();
    if (undecided() && !context_->stop.stop_requested()) {
      if (auto decided = decide_now(); !decided) return decided;
    }
    for (const RobotInfo& robot : recordings().robots()) {
      mapping::Slam& slam = *slams_[static_cast<std::size_t>(robot.number)];
      if (several() && slam.map().keyframe_count() == 0) {
        return core::input_error(
            fmt::format("{}: no frame could begin a map; leave this recording out", robot.name));
      }
      auto map = std::make_shared<maps::Map>(slam.map());
      if (context_->alter_map) context_->alter_map(*map);
      result->maps.push_back({robot.name, {robot}, std::move(map), slam.frame_poses()});
    }
    io.output<RobotMaps>("maps", result);
    return {};
  }

  void summarise(RunSummary& summary) const override {
    count_frames(rows_, summary);
    for (const RobotInfo& robot : recordings().robots()) {
      const mapping::Slam& slam = *slams_[static_cast<std::size_t>(robot.number)];
      const mapping::LoopCounts& loops = slam.loop_counts();
      summary.loops.candidates += static_cast<std::size_t>(loops.candidates);
      summary.loops.verified += static_cast<std::size_t>(loops.verified);
      summary.loops.accepted += static_cast<std::size_t>(loops.accepted);
      summary.loops.rejected += static_cast<std::size_t>(loops.rejected);
      const auto& trials = slam.loop_trials();
      summary.loops.trials.insert(summary.loops.trials.end(), trials.begin(), trials.end());
      summary.feedback.relocalised += static_cast<std::size_t>(loops.located);
      summary.feedback.loops += static_cast<std::size_t>(loops.by_others);
      summary.path.refused += static_cast<std::size_t>(slam.refused());
      if (several()) summary.robots.push_back({robot.name, slam.map().keyframe_count()});
    }
    summary.feedback.on = context_->feedback != nullptr;
    if (const auto others = summary.feedback.on ? context_->feedback->get() : nullptr)
      summary.feedback.keyframes = others->map.keyframe_count();
    summary.causes = {count(mapping::KeyframeCause::kCone), count(mapping::KeyframeCause::kUrgent),
                      count(mapping::KeyframeCause::kPlain)};
    summary.parts.push_back({"track.bundle_wait", bundle_wait_ms_, 0.0});
    summary.parts.push_back({"track.bundle", bundle_ms_, 0.0});
  }

 private:
  [[nodiscard]] const RobotRecordings& recordings() const { return *context_->recordings; }
  [[nodiscard]] bool several() const { return slams_.size() > 1; }
  [[nodiscard]] std::size_t count(mapping::KeyframeCause cause) const {
    const auto found = causes_.find(cause);
    return found != causes_.end() ? found->second : 0;
  }
  /// Of the cameras: all have seen enough, or it is time.
  [[nodiscard]] bool knows_enough(std::size_t frame) const {
    return recordings().time_of(frame) - recordings().time_of(0) >= kCamera_s ||
           std::all_of(slams_.begin(), slams_.end(),
                       [](const auto& slam) { return slam->map().keyframe_count() >= kCameraKeyframes; });
  }
  /// The question to each robot's map as it is now; what is answered goes to `decision`.
  [[nodiscard]] std::function<void(const core::Executor&)> question(CameraDecision& decision) const {
    struct Robot {
      RobotInfo info;
      maps::Map map;
      std::vector<maps::FramePose> poses;
    };
    auto robots = std::make_shared<std::vector<Robot>>();
    for (const RobotInfo& robot : recordings().robots()) {
      const mapping::Slam& slam = *slams_[static_cast<std::size_t>(robot.number)];
      robots->push_back({robot, slam.map(), slam.frame_poses()});
    }
    const double told_s = options_.tracker.readout_s;
    return [robots, told_s, &decision, log = context_->log](const core::Executor& executor) {
      for (const Robot& robot : *robots) {
        const double undone_s = told_s > 0.0 ? told_s : robot.info.camera.readout_s.value_or(0.0);
        decision.ask(robot.info, {&robot.map, &robot.poses, undone_s}, executor, *log);
      }
    };
  }
  [[nodiscard]] bool undecided() const { return context_->cameras != nullptr && !context_->cameras->made; }
  core::Result<void> decide(std::size_t frame) {
    if (!undecided() || !knows_enough(frame)) return {};
    return refine_ == "live" ? decide_live(frame) : decide_now();
  }
  /// Asked beside the tracker; frames go on as they are until the answer is due, and some more.
  core::Result<void> decide_live(std::size_t frame) {
    if (live_ == nullptr) {
      if (frame + kAnswerFrames + kUseFrames >= recordings().size()) return {};
      live_ = std::make_unique<LiveAnswer>();
      live_->due = frame + kAnswerFrames;
      live_->job = context_->executor->submit([ask = question(live_->decision)] { ask(core::Executor(1)); });
    }
    if (frame < live_->due) return {};
    live_->job.wait();
    CameraDecision& cameras = *context_->cameras;
    cameras.used = live_->decision.used;
    cameras.said = live_->decision.said;
    cameras.news = live_->decision.news;
    return cameras.settle(*context_, frame + kUseFrames);
  }
  core::Result<void> decide_now() {
    question (*context_->cameras)(*context_->executor);
    return context_->cameras->settle(*context_,
                                     refine_ == "live" ? std::optional<std::size_t>(0) : std::nullopt);
  }
  /// As the cameras' files say, and from some frame on what was found; an option goes before.
  void set_shutters(std::size_t frame) {
    if (options_.tracker.readout_s > 0.0) return;
    const CameraDecision* found = context_->cameras;
    const bool better = found != nullptr && found->made && found->from > 0 && frame >= found->from;
    for (std::size_t r = 0; r < slams_.size(); ++r)
      slams_[r]->set_shutter((better ? found->used[r] : recordings().robots()[r].camera).readout_s);
  }
  void note_times(std::size_t frame, const mapping::BundleReport& bundle) {
    if (!bundle.keyframe.valid()) return;
    bundle_wait_ms_.resize(frame + 1, std::numeric_limits<float>::quiet_NaN());
    bundle_ms_.resize(frame + 1, std::numeric_limits<float>::quiet_NaN());
    bundle_wait_ms_.back() = static_cast<float>(bundle.wait_ms);
    bundle_ms_.back() = static_cast<float>(bundle.solve_ms);
  }

  const RunContext* context_ = nullptr;
  mapping::SlamOptions options_;
  std::string refine_ = "auto";
  std::vector<std::unique_ptr<mapping::Slam>> slams_;  ///< by robot
  std::vector<maps::MapRevision> revisions_;  ///< by robot, of its map, up to which changes were reported
  std::unique_ptr<LiveAnswer> live_;          ///< null: nobody has asked
  std::vector<FrameRow> rows_;
  std::map<mapping::KeyframeCause, std::size_t> causes_;  ///< of the keyframes
  std::vector<float> bundle_wait_ms_;                     ///< by frame; NaN: no bundle was put back
  std::vector<float> bundle_ms_;
};

}  // namespace

StageType track_stage() {
  return stage_type<TrackStage>(
      "track",
      "Tracks each robot's camera with points, lines and depth, and keeps its map of keyframes and landmarks",
      Mode::kSerial, {{"frame", frame_port()}, {"features", features_port()}},
      {{"track", track_port()}, {"maps", maps_port()}});
}

}  // namespace plumbline::pipeline
