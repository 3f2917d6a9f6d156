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

namespace plumbline::pipeline {
namespace {

const char* const kColumns =
    "stamp,reference,keyframe,relocalised,points,points_rms,lines,lines_rms,surface,surface_rms,min_"
    "eigenvalue,"
    "weak_directions,frames_since_keyframe,shared,overlap,parallax,rotation_rad,mapper_idle,cone_candidate,"
    "cone_shared,cone_matched,cone_all,cone_changed,cone_theta,cone_beta,cone_alpha,cone_initial,cone_"
    "adaptive,"
    "cone_ecog,cone_offset,wanted,urgent,bundle,bundle_cost,bundle_outliers";

std::string columns_of(const mapping::ConeTerms& c) {
  return fmt::format("{},{:.4f},{},{},{},{:.4f},{:.4f},{:.4f},{:.2f},{:.2f},{:.4f},{:.4f}",
                     c.candidate ? 1 : 0, c.shared, c.now.matched, c.now.all, c.now.changed,
                     c.threshold.theta, c.threshold.beta, c.threshold.alpha, c.threshold.initial,
                     c.threshold.adaptive, c.balance.ecog, c.balance.offset);
}

std::string columns_of(const mapping::BundleReport& b) {
  if (!b.keyframe.valid()) return "-1,,";
  const double ratio = b.summary.initial_cost > 0.0 ? b.summary.final_cost / b.summary.initial_cost : 1.0;
  return fmt::format("{},{:.4f},{}", b.keyframe.index, ratio,
                     b.summary.point_outliers + b.summary.line_outliers);
}

std::string columns(const mapping::FrameReport& r) {
  const mapping::KeyframeDecision& d = r.decision;
  return fmt::format(
      "{:.6f},{},{},{},{},{:.4f},{},{:.4f},{},{:.4f},{:.6g},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{},{},{}",
      r.stamp, r.reference.index, r.keyframe.index, r.relocalised ? 1 : 0, r.points.inliers, r.points.rms,
      r.lines.inliers, r.lines.rms, r.surface.inliers, r.surface.rms, r.min_eigenvalue, r.weak_directions,
      d.frames_since, d.shared, d.overlap, d.parallax, d.rotation_rad, d.mapper_idle ? 1 : 0,
      columns_of(d.cone), d.wanted ? 1 : 0, d.urgent ? 1 : 0, columns_of(r.bundle));
}

class TrackStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }

  core::Result<void> start(const RunContext& context) override {
    constexpr std::int32_t kRobot = 0;
    camera_ = context.source->camera().color;
    debug_folder_ = context.debug_folder;
    keep_changes_ = context.keep_changes;
    if (auto loaded = options_.loops.load(); !loaded) return loaded;
    slam_ = std::make_unique<mapping::Slam>(options_, camera_, kRobot, *context.executor, *context.log);
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
    rows_.push_back({io.frame(), tracking::to_string(report.state), columns(report)});
    note_times(io.frame(), report.bundle);
    auto tracked = std::make_shared<TrackedFrame>();
    tracked->keyframe = report.keyframe;
    tracked->stamp = report.stamp;
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
    result->map = std::make_shared<maps::Map>(slam_->map());
    result->frame_poses = slam_->frame_poses();
    take_poses_from_map(*result);
    result->frame_columns = kColumns;
    result->frames = rows_;
    lines_ = result->lines.size();
    if (options_.loops.enabled) {
      result->vocabulary = std::make_shared<places::Vocabulary>(slam_->places().vocabulary());
    }
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
                     static_cast<std::size_t>(loops.accepted)};
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
