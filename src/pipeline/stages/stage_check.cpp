// SPDX-License-Identifier: BSD-3-Clause
// check: pairs of frames are aligned anew and compared with the final path.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/check/path_samples.hpp"
#include "plumbline/check/recalibrated_frame.hpp"
#include "plumbline/check/self_check.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/maps/pose_samples.hpp"
#include "plumbline/pipeline/camera_shifts.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "results/resumed_run.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

/// RMS of the keyframes' standard deviations; 0: none is known.
double told_m(const mapping::MapAccuracy& accuracy) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const mapping::KeyframeAccuracy& keyframe : accuracy.keyframes) {
    const double sigma = keyframe.sigma_position_m();
    if (!std::isfinite(sigma)) continue;
    sum += sigma * sigma;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

/// Numbers of one path's frames by their stamps.
std::map<double, std::int32_t> frames_by_stamp(const MapResult& map, std::int32_t robot) {
  std::map<double, std::int32_t> frames;
  for (std::size_t i = 0; i < map.trajectory_ids.size(); ++i) {
    if (map.trajectory_ids[i].robot == robot)
      frames.emplace(map.trajectory[i].stamp, map.trajectory_ids[i].index);
  }
  return frames;
}

/// One robot's camera as it was for the frame, and as it is now.
class CameraChanges {
 public:
  explicit CameraChanges(const RobotInfo& robot) : robot_(robot) {
    const sensor::Camera& last = now();
    const sensor::Camera* before = &robot.camera;
    for (const maps::CameraVersion& version : robot.versions) {
      changes_.emplace_back(robot.camera.color, *before, last);
      before = &version.camera;
    }
  }
  [[nodiscard]] const sensor::Camera& now() const {
    return robot_.versions.empty() ? robot_.camera : robot_.versions.back().camera;
  }
  /// None: the frame was read as the last version's.
  [[nodiscard]] const check::RecalibratedFrame* of(std::int32_t frame) const {
    for (std::size_t v = 0; v < robot_.versions.size(); ++v) {
      if (frame < robot_.versions[v].first_frame) return &changes_[v];
    }
    return nullptr;
  }

 private:
  const RobotInfo& robot_;
  std::vector<check::RecalibratedFrame> changes_;  ///< from each version's predecessor to the last
};

class CheckStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean("enabled", enabled_, "Judge the final path by aligning pairs of frames again");
  }

  [[nodiscard]] std::vector<std::string> files() const override {
    return enabled_ ? std::vector<std::string>{maps::kPoseSamplesFile} : std::vector<std::string>();
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    if (!enabled_) return {};
    store_.emplace(context.output_folder);
    kept_.resize(recordings().robots().size());
    choices_.resize(kept_.size());
    if (context.resumed != nullptr) read_again(*context.resumed);
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto track = io.input<TrackedFrame>("track");
    if (!enabled_ || !track->frame.valid() || track->still) return {};
    keep(*io.input<sensor::RgbdFrame>("frame"), track->robot);
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    if (!enabled_) return {};
    const auto map = io.input<MapResult>("map");

    const std::vector<RobotInfo>& robots = map->robots.empty() ? recordings().robots() : map->robots;
    check::CheckInput input;
    input.told_m = told_m(map->accuracy);
    if (map->map != nullptr)
      input.camera = camera_shifts(*map->map, map->frame_poses, robots, *context_->executor);

    std::vector<CameraChanges> cameras(robots.begin(), robots.end());
    std::vector<const check::RecalibratedFrame*> change(store_->size(), nullptr);
    for (std::size_t r = 0; r < robots.size(); ++r) {
      const auto readout = cameras[r].now().readout_s;
      input.ways.push_back(
          {robots[r].camera.color, readout.value_or(0.0), trajectory_of(*map, robots[r].number)});

      // Frames that have a pose, with the camera that was used for each.
      const auto frames = frames_by_stamp(*map, robots[r].number);
      for (check::KeptFrame frame : kept_[r]) {
        const auto found = frames.find(frame.stamp);
        if (found == frames.end()) continue;  // of a component that stayed apart
        change[frame.number] = cameras[r].of(found->second);
        if (change[frame.number] != nullptr) frame.depth_stamp += change[frame.number]->delay_s();
        input.frames.push_back(frame);
      }
    }

    if (input.frames.empty()) return {};

    // Frames are read with the camera that is known now.
    input.read = [&](std::size_t number) -> core::Result<check::SmallFrame> {
      auto frame = store_->read(number);
      if (frame && change[number] != nullptr) return (*change[number])(*frame);
      return frame;
    };

    auto report = check::check_path(input, *context_->executor);
    if (!report) return tl::unexpected(report.error());
    report_ = std::move(*report);

    return write_samples(*map, robots);
  }

  void report(Json& summary) const override {
    if (!report_) return;
    summary["check"] = core::parse_json(check::to_json(*report_), "check").value_or(Json());
  }
  void doubt(const Json& /*summary*/, std::vector<Doubt>& reasons) const override {
    if (!report_) return;
    for (const std::string& reason : report_->reasons)
      reasons.push_back(
          {report_->tears.empty() ? Doubt::About::kDisputedLoops : Doubt::About::kTornMap, reason});
  }

 private:
  [[nodiscard]] const RobotRecordings& recordings() const { return *context_->input.recordings; }

  void keep(const sensor::RgbdFrame& frame, std::int32_t robot) {
    const auto number = static_cast<std::size_t>(robot);
    const check::FrameChoice::Use use = choices_[number].next(frame.stamp);
    if (use == check::FrameChoice::Use::kNone) return;
    const std::size_t stored = store_->add(check::shrink(frame, recordings().robot(robot).camera.color));
    kept_[number].push_back({stored, number, frame.stamp, frame.depth_stamp, use});
  }

  /// Errors that the keyframes' poses may have.
  [[nodiscard]] core::Result<void> write_samples(const MapResult& map,
                                                 const std::vector<RobotInfo>& robots) const {
    if (report_->samples.empty()) return {};
    std::vector<maps::KeyframeSamples> samples;
    for (const maps::KeyframePose& keyframe : map.keyframes) {
      const auto robot = std::find_if(robots.begin(), robots.end(),
                                      [&](const RobotInfo& r) { return r.number == keyframe.id.robot; });
      const geometry::StampedPose pose{keyframe.stamp, keyframe.world_from_camera};
      samples.push_back(
          {keyframe.id, check::samples_of(*report_, static_cast<std::size_t>(robot - robots.begin()), pose)});
    }
    return maps::write_pose_samples(context_->output_folder / maps::kPoseSamplesFile, samples);
  }

  /// Reads the frames again that the continued run had kept: its temporary file is gone.
  void read_again(const ResumedRun& run) {
    for (const FrameRow& row : run.rows) {
      if (row.state != FrameState::kTracked) continue;
      const auto frame = recordings().read(row.frame);
      if (frame) keep(*frame, recordings().robot_of(row.frame));
    }
  }

  bool enabled_ = true;
  const RunContext* context_ = nullptr;
  std::optional<check::FrameStore> store_;
  std::vector<check::FrameChoice> choices_;          ///< by robot
  std::vector<std::vector<check::KeptFrame>> kept_;  ///< by robot
  std::optional<check::CheckReport> report_;
};

}  // namespace

StageType check_stage() {
  return stage_type<CheckStage>(
      "check", "Judges the final path: aligns pairs of frames again and tells the error to expect",
      Mode::kSerial, {{"frame", frame_port()}, {"track", track_port()}, {"map", map_port()}}, {}, true);
}

}  // namespace plumbline::pipeline
