// SPDX-License-Identifier: BSD-3-Clause
// track: the SLAM of one robot, frame by frame: poses, keyframes, landmarks.
#include <fmt/format.h>

#include <memory>
#include <utility>

#include "debug_video.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

const char* const kColumns =
    "stamp,reference,keyframe,relocalised,points,points_rms,lines,lines_rms,surface,surface_rms,min_"
    "eigenvalue,"
    "weak_directions,frames_since_keyframe,shared,overlap,parallax,rotation_rad,wanted,urgent";

std::string columns(const mapping::FrameReport& r) {
  const mapping::KeyframeDecision& d = r.decision;
  return fmt::format(
      "{:.6f},{},{},{},{},{:.4f},{},{:.4f},{},{:.4f},{:.6g},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{},{}", r.stamp,
      r.reference.index, r.keyframe.index, r.relocalised ? 1 : 0, r.points.inliers, r.points.rms,
      r.lines.inliers, r.lines.rms, r.surface.inliers, r.surface.rms, r.min_eigenvalue, r.weak_directions,
      d.frames_since, d.shared, d.overlap, d.parallax, d.rotation_rad, d.wanted ? 1 : 0, d.urgent ? 1 : 0);
}

class TrackStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }

  core::Result<void> start(const RunContext& context) override {
    constexpr std::int32_t kRobot = 0;
    camera_ = context.source->camera().color;
    debug_folder_ = context.debug_folder;
    slam_ = std::make_unique<mapping::Slam>(options_, camera_, kRobot, *context.executor, *context.log);
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const auto features = io.input<features::FrameFeatures>("features");
    const mapping::FrameReport report = slam_->process(*frame, features);
    rows_.push_back({io.frame(), tracking::to_string(report.state), columns(report)});
    auto tracked = std::make_shared<TrackedFrame>();
    tracked->keyframe = report.keyframe;
    tracked->stamp = report.stamp;
    io.output<TrackedFrame>("track", tracked);
    if (debug_folder_.empty()) return {};
    return write_debug_picture(debug_folder_, io.frame(), *frame, *features, *slam_, report, camera_);
  }

  core::Result<void> finish(StageIo& io) override {
    slam_->finish();
    auto result = std::make_shared<MapResult>();
    result->map = std::make_shared<maps::Map>(slam_->map());
    result->frame_poses = slam_->frame_poses();
    take_poses_from_map(*result);
    result->frame_columns = kColumns;
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
  }

 private:
  mapping::SlamOptions options_;
  sensor::Pinhole camera_;
  std::filesystem::path debug_folder_;
  std::unique_ptr<mapping::Slam> slam_;
  std::vector<FrameRow> rows_;
  std::size_t lines_ = 0;
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
