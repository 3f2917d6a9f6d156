// SPDX-License-Identifier: BSD-3-Clause
// track: the SLAM of one robot, frame by frame: poses, keyframes, landmarks.
#include <fmt/format.h>

#include <limits>
#include <memory>
#include <utility>

#include "debug_video.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "resumed_run.hpp"
#include "stages.hpp"
#include "track_rows.hpp"

namespace plumbline::pipeline {
namespace {

class TrackStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }

  core::Result<void> start(const RunContext& context) override {
    constexpr std::int32_t kRobot = 0;
    camera_ = context.source->camera().color;
    debug_folder_ = context.debug_folder;
    keep_changes_ = context.keep_changes;
    alter_map_ = context.alter_map;
    slam_ = std::make_unique<mapping::Slam>(options_, camera_, kRobot, *context.executor, *context.log);
    slam_->set_shutter(context.source->camera().readout_s);
    if (context.resumed != nullptr) {
      slam_->restore(context.resumed->map.map, context.resumed->map.frames);
      moment_ = slam_->map().now();
      rows_ = context.resumed->rows;
    }
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const auto features = io.input<features::FrameFeatures>("features");
    const std::size_t poses = slam_->frame_poses().size();
    const mapping::FrameReport report = slam_->process(*frame, features);
    rows_.push_back({io.frame(), tracking::to_string(report.state), row_columns(report)});
    note_times(io.frame(), report.bundle);
    auto tracked = std::make_shared<TrackedFrame>();
    tracked->keyframe = report.keyframe;
    tracked->stamp = report.stamp;
    tracked->depth_from_camera = report.depth_from_camera;
    tracked->row = rows_.back();
    if (slam_->frame_poses().size() > poses) tracked->pose = slam_->frame_poses().back();
    if (keep_changes_ && report.keyframe.valid()) {
      tracked->changes = std::make_shared<maps::MapChanges>(slam_->map().changes_since(moment_));
      moment_ = slam_->map().now();
    }
    io.output<TrackedFrame>("track", tracked);
    if (debug_folder_.empty()) return {};
    return write_debug_picture(debug_folder_, io.frame(), *frame, *features, *slam_, report, camera_);
  }

  core::Result<void> finish(StageIo& io) override {
    slam_->finish();
    auto result = std::make_shared<MapResult>();
    auto map = std::make_shared<maps::Map>(slam_->map());
    if (alter_map_) alter_map_(*map);
    result->map = map;
    result->frame_poses = slam_->frame_poses();
    take_poses_from_map(*result);
    result->frame_columns = kRowColumns;
    result->frames = rows_;
    lines_ = result->lines.size();
    io.output<MapResult>("map", result);
    return {};
  }

  void summarise(RunSummary& summary) const override {
    count_frames(rows_, summary);
    summary.keyframes = slam_->map().keyframe_count();
    summary.points = slam_->map().point_count();
    summary.lines = lines_;
    const mapping::LoopCounts& loops = slam_->loop_counts();
    summary.loops = {static_cast<std::size_t>(loops.candidates), static_cast<std::size_t>(loops.verified),
                     static_cast<std::size_t>(loops.accepted), static_cast<std::size_t>(loops.rejected),
                     slam_->loop_trials()};
    summary.path.refused += static_cast<std::size_t>(slam_->refused());
    summary.parts.push_back({"track.bundle_wait", bundle_wait_ms_, 0.0});
    summary.parts.push_back({"track.bundle", bundle_ms_, 0.0});
  }

 private:
  void note_times(std::size_t frame, const mapping::BundleReport& bundle) {
    if (!bundle.keyframe.valid()) return;
    bundle_wait_ms_.resize(frame + 1, std::numeric_limits<float>::quiet_NaN());
    bundle_ms_.resize(frame + 1, std::numeric_limits<float>::quiet_NaN());
    bundle_wait_ms_.back() = static_cast<float>(bundle.wait_ms);
    bundle_ms_.back() = static_cast<float>(bundle.solve_ms);
  }

  mapping::SlamOptions options_;
  sensor::Pinhole camera_;
  std::filesystem::path debug_folder_;
  std::unique_ptr<mapping::Slam> slam_;
  std::vector<FrameRow> rows_;
  std::vector<float> bundle_wait_ms_;  ///< by frame; NaN: no bundle was put back
  std::vector<float> bundle_ms_;
  std::size_t lines_ = 0;
  bool keep_changes_ = false;
  std::function<void(maps::Map&)> alter_map_;
  maps::MapMoment moment_;  ///< of the map, up to which changes were told
};

}  // namespace

StageType track_stage() {
  return {"track",
          "Tracks the camera with points, lines and depth, and keeps the map of keyframes and landmarks",
          Mode::kSerial,
          {{"frame", frame_port()}, {"features", features_port()}},
          {{"track", track_port()}, {"map", map_port()}},
          [] { return std::make_unique<TrackStage>(); }};
}

}  // namespace plumbline::pipeline
