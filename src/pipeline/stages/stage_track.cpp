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
#include "stages/camera_refinement.hpp"
#include "stages/debug_video.hpp"
#include "stages/resumed_run.hpp"
#include "stages/robot_components.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

// What a map has seen when it is asked for its camera: keyframes or seconds.
constexpr std::size_t kCameraKeyframes = 40;
constexpr double kCamera_s = 10.0;
// The answer is waited for so many frames after the question, and used so many after that: by then no frame
// that it is for has been read, whatever the number of threads. Nobody asks when only a few frames would be
// left.
constexpr std::size_t kAnswerFrames = 32;
constexpr std::size_t kUseFrames = kMostUnderWay;
constexpr std::size_t kLeastFramesLeft = 60;
constexpr int kMostQuestions =
    2;  // of a finished map: what a wrong camera has bent shows when it is made anew

/// What the cameras are, while it is being looked for.
struct CameraQuestion {
  std::vector<CameraRefinement> cameras;  ///< by robot
  std::vector<bool> better;               ///< by robot: the answer
  std::size_t due = 0;                    ///< the frame at which it is waited for
  core::Executor::Job job;                ///< last: its destructor waits for it
};

class TrackStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.choice<bool>("camera.refine", refine_, {{"auto", true}, {"off", false}},
                       "Estimate the camera from the map, after 40 keyframes or 10 s and at the end, and "
                       "rebuild the map for it");
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    robots_ = recordings().robots();
    for (const RobotInfo& robot : robots_) {
      slams_.push_back(std::make_unique<mapping::Slam>(options_, robot.camera.color, robot.number,
                                                       *context.executor, *context.log));
      slams_.back()->set_camera(robot.camera);
      if (context.feedback != nullptr) slams_.back()->use(context.feedback);
      cameras_.emplace_back(robot);
    }
    stored_robots_ = robots_;
    revisions_.resize(slams_.size());
    camera_is_new_.resize(slams_.size());
    asked_ = recordings().format() == "synth";  // filmed while it is mapped: no lens, no error
    refine_ = refine_ && !asked_;
    if (context.resumed != nullptr) restore(*context.resumed);
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const auto features = io.input<features::FrameFeatures>("features");
    const RobotInfo& robot = recordings().robot(recordings().robot_of(io.frame()));
    const auto number = static_cast<std::size_t>(robot.number);
    refine_camera(io.frame(), number);
    mapping::Slam& slam = *slams_[number];
    const std::size_t poses = slam.frame_poses().size();
    const int taken_back = slam.taken_back();
    const mapping::FrameReport report = slam.process(*frame, features);
    if (slam.taken_back() > taken_back) revisions_[number] = {};  // edges changed that the store has already
    rows_.push_back({io.frame(), tracking::to_string(report.state),
                     several() ? robot.name + "," + row_columns(report) : row_columns(report)});
    if (report.keyframe.valid()) ++causes_[report.decision.cause];
    if (report.component.valid()) ++component_frames_[report.component];
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
        if (camera_is_new_[number]) {
          stored_robots_[number] = robots_[number];
          tracked->robots = std::make_shared<std::vector<RobotInfo>>(stored_robots_);
          camera_is_new_[number] = false;
        }
      }
    }
    io.output<TrackedFrame>("track", tracked);
    begin_question(io.frame());
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
      if (auto written = write_cameras(context_->output_folder, robots_, cameras()); !written) return written;
      result->maps = components_of(*context_->resumed->merged).maps;
      io.output<RobotMaps>("maps", result);
      return {};
    }
    for (const auto& slam : slams_) slam->finish();
    if (refine_ && !context_->stop.stop_requested()) refine_finished_maps();
    if (auto written = write_cameras(context_->output_folder, robots_, cameras()); !written) return written;
    for (const RobotInfo& robot : robots_) {
      mapping::Slam& slam = *slams_[static_cast<std::size_t>(robot.number)];
      if (several() && slam.map().keyframe_count() == 0) {
        return core::input_error(
            fmt::format("{}: no frame could begin a map; leave this recording out", robot.name));
      }
      auto map = std::make_shared<maps::Map>(slam.map());
      if (context_->alter_map) context_->alter_map(*map);
      RobotComponents components = components_of({robot.name, {robot}, std::move(map), slam.frame_poses()});
      dropped_ += components.dropped;
      dropped_frames_ += components.dropped_frames;
      for (RobotMap& component : components.maps) result->maps.push_back(std::move(component));
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
      summary.loops.taken_back += static_cast<std::size_t>(slam.taken_back());
      const auto& disputes = slam.disputes();
      summary.loops.disputes.insert(summary.loops.disputes.end(), disputes.begin(), disputes.end());
      const auto& trials = slam.loop_trials();
      summary.loops.trials.insert(summary.loops.trials.end(), trials.begin(), trials.end());
      summary.feedback.relocalised += static_cast<std::size_t>(loops.located);
      summary.feedback.loops += static_cast<std::size_t>(loops.by_others);
      summary.path.refused += static_cast<std::size_t>(slam.refused());
      if (several()) summary.robots.push_back({robot.name, slam.map().keyframe_count()});
      add_joins(robot, slam, summary);
    }
    summary.dropped = {dropped_, dropped_frames_};
    summary.frames.tracked -= dropped_frames_;
    summary.frames.lost += dropped_frames_;
    summary.feedback.on = context_->feedback != nullptr;
    if (const auto others = summary.feedback.on ? context_->feedback->get() : nullptr)
      summary.feedback.keyframes = others->map.keyframe_count();
    summary.causes = {count(mapping::KeyframeCause::kCone), count(mapping::KeyframeCause::kUrgent),
                      count(mapping::KeyframeCause::kPlain)};
    for (std::size_t r = 0; r < cameras_.size(); ++r) {
      if (refine_ || robots_[r].camera.guess) summary.cameras.push_back(cameras_[r].report());
      if (!refine_ && robots_[r].camera.guess)
        summary.cameras.back().doubt = "no camera file was given: the camera is a guess";
    }
    summary.parts.push_back({"track.bundle_wait", bundle_wait_ms_, 0.0});
    summary.parts.push_back({"track.bundle", bundle_ms_, 0.0});
  }

 private:
  /// Components that were joined while the robot mapped.
  void add_joins(const RobotInfo& robot, const mapping::Slam& slam, RunSummary& summary) const {
    const double first_s = slam.frame_poses().empty() ? 0.0 : slam.frame_poses().front().stamp;
    for (const mapping::ComponentJoin& join : slam.joins()) {
      RunSummary::Component component;
      component.name = fmt::format("{}, from keyframe {} on", robot.name, join.overlap.b.index);
      const auto counted = component_frames_.find(join.overlap.b);
      component.frames = counted == component_frames_.end() ? 0 : counted->second;
      component.keyframes = join.keyframes;
      component.joined = true;
      component.joined_s = join.stamp - first_s;
      component.agreeing = join.overlap.evidence.consistency.agreeing;
      summary.components.push_back(std::move(component));
    }
  }
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
  [[nodiscard]] std::vector<sensor::Camera> cameras() const {
    std::vector<sensor::Camera> cameras;
    for (const CameraRefinement& camera : cameras_) cameras.push_back(camera.camera());
    return cameras;
  }

  /// Asks the maps as they are now, beside the tracker, once.
  void begin_question(std::size_t frame) {
    if (!refine_ || asked_ || !knows_enough(frame)) return;
    asked_ = true;
    if (frame + kAnswerFrames + kUseFrames + kLeastFramesLeft > recordings().size()) return;
    question_ = std::make_unique<CameraQuestion>();
    question_->cameras = cameras_;
    question_->better.resize(cameras_.size());
    question_->due = frame + kAnswerFrames;
    std::vector<std::pair<maps::Map, std::vector<maps::FramePose>>> maps;
    for (const auto& slam : slams_) maps.emplace_back(slam->map(), slam->frame_poses());
    question_->job =
        context_->executor->submit([question = question_.get(), maps = std::move(maps), log = context_->log] {
          const core::Executor here(1);
          for (std::size_t r = 0; r < maps.size(); ++r)
            question->better[r] = question->cameras[r].ask(maps[r].first, maps[r].second, here, *log);
        });
  }

  /// Waits for the answer when it is due, and goes on with it from the first frame on that is read with it.
  void refine_camera(std::size_t frame, std::size_t robot) {
    if (question_ != nullptr && frame >= question_->due) {
      question_->job.wait();
      use_from_ = frame + kUseFrames;
      cameras_ = question_->cameras;
      waiting_ = question_->better;
      question_.reset();
      if (std::count(waiting_.begin(), waiting_.end(), true) > 0)
        context_->recordings->correct(use_from_, cameras());
      for (std::size_t r = 0; r < cameras_.size(); ++r) {
        if (waiting_[r]) cameras_[r].used_from(use_from_);
      }
    }
    if (waiting_.empty() || !waiting_[robot] || frame < use_from_) return;
    waiting_[robot] = false;
    use_camera(robot);
  }

  /// What was mapped before is made anew for the robot's camera as it is known now.
  void use_camera(std::size_t robot) {
    mapping::Slam& slam = *slams_[robot];
    const auto number = static_cast<std::int32_t>(robot);
    robots_[robot].versions.push_back({cameras_[robot].camera(), slam.map().next_keyframe_id(number).index,
                                       static_cast<std::int32_t>(slam.frame_poses().size())});
    const auto pictures = recordings().taken_by(number, cameras_[robot].camera());
    slam.recalibrate(cameras_[robot].camera(), [&](std::int64_t index) -> std::optional<sensor::RgbdFrame> {
      if (pictures == nullptr) return std::nullopt;
      auto frame = pictures->read(static_cast<std::size_t>(index));
      if (!frame) return std::nullopt;
      return std::move(*frame);
    });
    revisions_[robot] = {};  // all of it is another one for the store
    camera_is_new_[robot] = true;
  }

  /// Asks the finished maps, until they have nothing new to say.
  void refine_finished_maps() {
    for (std::size_t r = 0; r < slams_.size(); ++r) {
      mapping::Slam& slam = *slams_[r];
      if (!waiting_.empty() && waiting_[r]) use_camera(r);  // its last frame came before the answer was used
      for (int i = 0; i < kMostQuestions; ++i) {
        if (!cameras_[r].ask(slam.map(), slam.frame_poses(), *context_->executor, *context_->log)) break;
        use_camera(r);
      }
    }
  }

  /// Goes on where another run stopped, with what it knew of the cameras.
  void restore(const ResumedRun& run) {
    rows_ = run.rows;
    if (run.merged) {
      for (const RobotInfo& stored : run.merged->robots) restore_camera(stored);
    }
    for (const auto& [robot, map] : run.maps) {
      const auto number = static_cast<std::size_t>(robot);
      for (const RobotInfo& stored : map.header.robots) {
        if (stored.number == robot) restore_camera(stored);
      }
      slams_.at(number)->restore(map.map, map.frames);
      revisions_[number] = slams_[number]->map().now();
    }
    stored_robots_ = robots_;
    if (asked_ && refine_) context_->recordings->correct(0, cameras());
  }
  void restore_camera(const RobotInfo& stored) {
    if (stored.versions.empty()) return;
    const auto number = static_cast<std::size_t>(stored.number);
    asked_ = true;
    robots_.at(number).versions = stored.versions;
    cameras_[number].restore(stored.versions.back().camera);
    slams_[number]->set_camera(cameras_[number].camera());
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
  bool refine_ = true;
  std::vector<std::unique_ptr<mapping::Slam>> slams_;  ///< by robot
  std::vector<RobotInfo> robots_;                      ///< with what their cameras turned out to be
  std::vector<RobotInfo>
      stored_robots_;  ///< as the store has them: it learns of a robot's with its next keyframe
  std::vector<CameraRefinement> cameras_;     ///< by robot
  bool asked_ = false;                        ///< while mapping
  std::unique_ptr<CameraQuestion> question_;  ///< under way; null: none is
  std::size_t use_from_ = 0;                  ///< frame from which the answer is used
  std::vector<bool> waiting_;  ///< by robot: its first frame from there on has not come; empty: no answer yet
  std::vector<bool> camera_is_new_;           ///< by robot: since its last keyframe
  std::vector<maps::MapRevision> revisions_;  ///< by robot, of its map, up to which changes were reported
  std::vector<FrameRow> rows_;
  std::map<mapping::KeyframeCause, std::size_t> causes_;      ///< of the keyframes
  std::map<core::KeyframeId, std::size_t> component_frames_;  ///< by root, as the frames were tracked
  std::size_t dropped_ = 0;                                   ///< components, as too small
  std::size_t dropped_frames_ = 0;
  std::vector<float> bundle_wait_ms_;  ///< by frame; NaN: no bundle was put back
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
