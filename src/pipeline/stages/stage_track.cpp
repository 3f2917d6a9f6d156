// SPDX-License-Identifier: BSD-3-Clause
// track: the SLAM of each robot, frame by frame: poses, keyframes, landmarks.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/observer.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "results/debug_video.hpp"
#include "results/frame_rows.hpp"
#include "results/resumed_run.hpp"
#include "robots/observed_way.hpp"
#include "robots/robot_bodies.hpp"
#include "robots/robot_cameras.hpp"
#include "robots/robot_components.hpp"
#include "robots/still_camera.hpp"
#include "robots/tracking_sections.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

/// Part of one robot's map that is not in the store yet.
struct Unstored {
  maps::MapRevision since;  ///< changes from here on
  bool new_camera = false;  ///< since its last keyframe
};

/// camera_from_world of a frame.
geometry::Rigid3 pose_in(const maps::Map& map, const maps::FramePose& frame) {
  return frame.camera_from_reference * map.camera_from_world(frame.reference);
}

class TrackStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.boolean("gyro", gyro_, "Use the gyroscope of a recording that has one, once its axes are known");
    table.boolean("wheels", wheels_,
                  "Use wheel odometry of a recording that has it, once its scale is known");
    table.choice<bool>(
        "camera.refine", refine_, {{"auto", true}, {"off", false}},
        "Estimate the camera from the map, after 40 keyframes, 10 s, or 200 frames that take 6.5 s or more, "
        "and at the end, and rebuild the map for it");
    table.integer("camera.pictures", pictures_, {1, 1'000'000}, "",
                  "Keyframes of each robot, from the first on, whose pictures are read again for a better "
                  "camera; a live run keeps no more of them");
  }
  [[nodiscard]] bool draws_frames() const override { return true; }
  [[nodiscard]] bool resumes() const override { return true; }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    bodies_.emplace(recordings(), gyro_, wheels_, *context.log);

    // A robot's map is begun in the same way when it is made again for a better camera.
    const auto begin = [this](const RobotInfo& robot) {
      auto slam = std::make_unique<mapping::Slam>(options_, robot.camera.color, robot.number,
                                                  *context_->executor, *context_->log);
      slam->set_camera(robot.camera);

      if (context_->hooks.feedback != nullptr) slam->use(context_->hooks.feedback);
      slam->use(bodies_->sensor(robot.number));
      return slam;
    };

    for (const RobotInfo& robot : recordings().robots()) slams_.push_back(begin(robot));
    cameras_.emplace(*context.input.recordings, refine_, pictures_, begin, context);
    unstored_.resize(slams_.size());
    observed_.resize(slams_.size());
    still_.resize(slams_.size());

    // The store holds the cameras as they were found before: only later news of them is stored from here on.
    if (context.resumed != nullptr) restore(*context.resumed);
    stored_robots_ = cameras_->robots();
    stored_news_ = cameras_->news();

    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const auto features = io.input<features::FrameFeatures>("features");
    const RobotInfo& robot = recordings().robot(recordings().robot_of(io.frame()));
    const auto number = static_cast<std::size_t>(robot.number);
    if (cameras_->before(io.frame(), number, slams_)) unstored_[number] = {{}, true};

    // The pose, and what the frame adds to the map.
    mapping::Slam& slam = *slams_[number];
    const std::size_t poses = slam.frame_poses().size();
    const mapping::Components& components = slam.connections().components();
    const int taken_back = components.taken_back();

    bodies_->before(robot.number, frame->stamp);
    const mapping::FrameReport report = slam.process(*frame, features);
    bodies_->after(robot.number, slam.frame_poses());
    if (components.taken_back() > taken_back)
      unstored_[number].since = {};  // edges that are stored have changed
    note(io.frame(), robot, report, shows_nothing(*frame, features->points.size()));

    auto tracked = std::make_shared<TrackedFrame>();
    tracked->robot = robot.number;
    tracked->keyframe = report.keyframe;
    tracked->stamp = report.stamp;
    tracked->depth_from_camera = report.depth_from_camera;
    tracked->row = rows_.back();
    if (slam.frame_poses().size() > poses) {
      tracked->pose = slam.frame_poses().back();
      const bool again = cameras_->may_read_again(io.frame(), number, report.keyframe);
      if (auto* live = context_->input.recordings->live(); again && live != nullptr) live->keep(io.frame());
    }

    if (tracked->pose && tracked->pose->tracked) {
      tracked->frame = {robot.number, static_cast<std::int32_t>(poses)};
      tracked->still = still_[number].stands_still(pose_in(slam.map(), *tracked->pose), frame->depth);
    } else {
      still_[number].lose();
    }

    if (report.keyframe.valid()) add_map(slam, number, *tracked);
    if (context_->hooks.observer != nullptr)
      observed_[number].report(io.frame(), slam, report, *tracked, *context_->hooks.observer);
    io.output<TrackedFrame>("track", tracked);

    cameras_->after(io.frame(), slams_);
    const std::filesystem::path& debug = context_->hooks.debug_folder;
    if (debug.empty()) return {};
    return write_debug_picture(debug, io.frame(), *frame, *features, slam.map(), report, robot.camera.color);
  }

  core::Result<void> finish(StageIo& io) override {
    auto result = std::make_shared<RobotMaps>();
    // Robots take turns, and in a resumed run some were behind others.
    std::sort(rows_.begin(), rows_.end(),
              [](const FrameRow& a, const FrameRow& b) { return a.frame < b.frame; });
    result->frame_columns = (several() ? "robot," : "") + row_column_names();
    const bool merged = context_->resumed != nullptr && context_->resumed->merged;

    if (!merged) {
      for (const auto& slam : slams_) slam->finish();
      if (!context_->stop.stop_requested()) cameras_->estimate_finished(slams_);
      bodies_->bridge(slams_, rows_);
    }
    result->frames = rows_;
    auto written = write_cameras(context_->output_folder, cameras_->robots(), cameras_->now());
    if (!written) return written;

    if (merged) {
      result->maps = components_of(*context_->resumed->merged).maps;
    } else if (auto added = add_maps(*result); !added) {
      return added;
    }
    io.output<RobotMaps>("maps", result);
    return {};
  }

  void report(Json& summary) const override {
    // A dropped component's frames have no pose.
    FrameCounts frames(summary);
    frames.count(rows_);
    frames.period_s = rounded(period_s());
    frames.tracked -= dropped_frames_;
    frames.lost += dropped_frames_;
    frames.write(summary);
    bodies_->report(summary);

    Json& components = summary["components"];
    components["dropped"] = dropped_;
    components["dropped_frames"] = dropped_frames_;

    for (const RobotInfo& robot : recordings().robots()) {
      const mapping::Slam& slam = *slams_[static_cast<std::size_t>(robot.number)];
      report_loops(slam, summary["loops"]);
      report_joins(robot.name, slam, component_frames_, components["list"]);
      add(summary["path"]["refused_adjustments"], static_cast<std::size_t>(slam.connections().refused()));
      if (several())
        summary["robots"].push_back({{"name", robot.name}, {"keyframes", slam.map().keyframe_count()}});
    }

    summary["keyframe_causes"] = {{"cone", count(mapping::KeyframeCause::kCone)},
                                  {"urgent", count(mapping::KeyframeCause::kUrgent)},
                                  {"plain", count(mapping::KeyframeCause::kPlain)}};
    summary["camera"] = cameras_->section();
    summary["camera_pairs"] = camera_pairs(cameras_->robots());
    if (context_->hooks.feedback != nullptr)
      summary["feedback"] = feedback_section(slams_, *context_->hooks.feedback);
  }
  void doubt(const Json& summary, std::vector<Doubt>& reasons) const override {
    doubt_lost_frames(summary, reasons);
    doubt_disputed_loops(summary, reasons);
    cameras_->doubt(reasons);
  }
  [[nodiscard]] std::vector<StageTiming> parts() const override {
    return {{"track.bundle_wait", bundle_wait_ms_, 0.0}, {"track.bundle", bundle_ms_, 0.0}};
  }

 private:
  [[nodiscard]] const RobotRecordings& recordings() const { return *context_->input.recordings; }
  [[nodiscard]] bool several() const { return slams_.size() > 1; }
  [[nodiscard]] std::size_t count(mapping::KeyframeCause cause) const {
    const auto found = causes_.find(cause);
    return found != causes_.end() ? found->second : 0;
  }

  void note(std::size_t frame, const RobotInfo& robot, const mapping::FrameReport& report, bool blind) {
    rows_.push_back(row_of(frame, report, blind, several() ? robot.name : ""));
    mark_blind(rows_.size() - 1);
    if (report.keyframe.valid()) ++causes_[report.decision.cause];
    if (report.component.valid()) ++component_frames_[report.component];

    if (!report.bundle.keyframe.valid()) return;
    bundle_wait_ms_.resize(frame + 1, std::numeric_limits<float>::quiet_NaN());
    bundle_ms_.resize(frame + 1, std::numeric_limits<float>::quiet_NaN());
    bundle_wait_ms_.back() = static_cast<float>(report.bundle.wait_ms);
    bundle_ms_.back() = static_cast<float>(report.bundle.solve_ms);
  }

  /// Three lost frames in a row that show nothing are blind.
  void mark_blind(std::size_t row) {
    constexpr std::size_t kFewest = 3;
    std::vector<std::size_t>& run = blind_[recordings().robot_of(rows_[row].frame)];
    if (rows_[row].state != FrameState::kTracked && rows_[row].shows_nothing)
      run.push_back(row);
    else
      run.clear();
    if (run.size() < kFewest) return;
    for (const std::size_t of_run : run) rows_[of_run].blind = true;
  }

  /// Time between two frames; 0: not known.
  [[nodiscard]] double period_s() const {
    if (rows_.size() <= slams_.size()) return 0.0;
    const double span = recordings().time_of(rows_.back().frame) - recordings().time_of(rows_.front().frame);
    return std::max(0.0, span) / (static_cast<double>(rows_.size()) / static_cast<double>(slams_.size()));
  }

  /// Adds the map for its readers while it grows: other robots, and the store.
  void add_map(const mapping::Slam& slam, std::size_t number, TrackedFrame& tracked) {
    if (several()) tracked.map = std::make_shared<maps::Map>(slam.map());
    if (!context_->store.keeps_map) return;
    Unstored& unstored = unstored_[number];
    tracked.changes = std::make_shared<maps::MapChanges>(slam.map().changes_since(unstored.since));
    unstored.since = slam.map().now();

    // A new camera is stored with the map that was made anew for it, news of any camera at once.
    const bool news = stored_news_ < cameras_->news();
    stored_news_ = cameras_->news();
    const bool new_camera = std::exchange(unstored.new_camera, false);

    if (!new_camera && !news) return;
    for (std::size_t r = 0; r < stored_robots_.size(); ++r)
      stored_robots_[r].estimate = cameras_->robots()[r].estimate;

    if (new_camera) {
      stored_robots_[number].versions = cameras_->robots()[number].versions;
      tracked.frames_anew = std::make_shared<std::vector<maps::FramePose>>(slam.frame_poses());
    }
    tracked.robots = std::make_shared<std::vector<RobotInfo>>(stored_robots_);
  }

  /// The finished maps, each component by itself.
  core::Result<void> add_maps(RobotMaps& result) {
    for (const RobotInfo& robot : cameras_->robots()) {
      const mapping::Slam& slam = *slams_[static_cast<std::size_t>(robot.number)];
      if (several() && slam.map().keyframe_count() == 0) {
        return core::input_error(
            fmt::format("{}: no frame could begin a map; leave this recording out", robot.name));
      }

      auto map = std::make_shared<maps::Map>(slam.map());
      if (context_->hooks.alter_map) context_->hooks.alter_map(*map);
      RobotComponents components = components_of({robot.name, {robot}, std::move(map), slam.frame_poses()});
      dropped_ += components.dropped;
      dropped_frames_ += components.dropped_frames;
      for (RobotMap& component : components.maps) result.maps.push_back(std::move(component));
    }
    return {};
  }

  /// Continues where another run stopped, with the cameras that it had found.
  void restore(const ResumedRun& run) {
    rows_ = run.rows;
    for (std::size_t i = 0; i < rows_.size(); ++i) mark_blind(i);
    if (run.merged) cameras_->resume(run.merged->robots, slams_);
    if (!run.maps.empty()) cameras_->resume(run.maps.begin()->second.header.robots, slams_);

    for (const auto& [robot, map] : run.maps) {
      const auto number = static_cast<std::size_t>(robot);
      slams_.at(number)->restore(map.map, map.frames);
      if (!map.frames.empty()) bodies_->before(robot, map.frames.back().stamp);
      bodies_->after(robot, map.frames);
      unstored_[number].since = slams_[number]->map().now();
    }
  }

  const RunContext* context_ = nullptr;
  mapping::SlamOptions options_;
  bool refine_ = true;
  bool gyro_ = true;
  bool wheels_ = true;
  int pictures_ = 1000;
  std::optional<RobotBodies> bodies_;  ///< before the trackers that ask it
  Slams slams_;
  std::optional<RobotCameras> cameras_;
  std::vector<ObservedWay> observed_;     ///< by robot
  std::vector<StillCamera> still_;        ///< by robot
  std::vector<Unstored> unstored_;        ///< by robot
  std::vector<RobotInfo> stored_robots_;  ///< it learns of a robot's camera with its next keyframe
  int stored_news_ = 0;
  std::vector<FrameRow> rows_;
  std::map<std::int32_t, std::vector<std::size_t>> blind_;    ///< by robot, rows that end a run without sight
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
