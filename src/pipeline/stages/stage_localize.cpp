// SPDX-License-Identifier: BSD-3-Clause
// localize: where the camera is in a finished map, frame by frame.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "plumbline/core/csv.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/localize/localizer.hpp"
#include "plumbline/pipeline/observer.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "results/frame_rows.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

constexpr const char* kLocatedColumns =
    "stamp,how,sigma_position,sigma_rotation,robot,keyframe,points,lines,found,surface,reason";

class LocalizeStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }
  [[nodiscard]] std::vector<std::string> files() const override { return {"trajectory.txt", "frames.csv"}; }
  [[nodiscard]] bool knows_map() const override { return true; }

  core::Result<void> start(const RunContext& context) override {
    using SteadyClock = std::chrono::steady_clock;
    context_ = &context;
    map_ = context.input.known_map;
    RobotRecordings& recordings = *context.input.recordings;
    if (recordings.robots().size() > 1) return core::usage_error("localize takes one recording at a time");

    // The camera with which the map was made is read as the map found it.
    sensor::Camera camera = recordings.camera();
    if (const auto refined = localize::refined_in(*map_, camera)) {
      recordings.correct(0, {*refined});
      camera.readout_s = refined->readout_s;
      refined_ = true;
    }
    const auto began = SteadyClock::now();
    localizer_.emplace(*map_, camera, options_);
    start_s_ = std::chrono::duration<double>(SteadyClock::now() - began).count();
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    for (const localize::LocatedFrame& located :
         localizer_->process(io.frame(), *frame, io.input<features::FrameFeatures>("features")))
      note(located);
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    for (const localize::LocatedFrame& located : localizer_->finish()) note(located);
    localizer_.reset();
    const std::filesystem::path& folder = context_->output_folder;
    if (auto written = dataset::write_trajectory(folder / "trajectory.txt", path_); !written) return written;
    return write_frame_rows(folder / "frames.csv", kLocatedColumns, rows_, io.frame());
  }

  void report(Json& summary) const override {
    // The map is not changed: these sections would describe an empty one.
    for (const char* of_maps :
         {"keyframes", "keyframe_causes", "landmarks", "loops", "refine", "path", "merges", "meetings",
          "robots", "components", "cloud", "frame", "camera", "camera_pairs"})
      summary.erase(of_maps);
    FrameCounts frames(summary);
    frames.tracked = path_.size();
    frames.lost = rows_.size() - path_.size();
    frames.longest_loss = longest_gap_;
    frames.write(summary);
    const bool any = !path_.empty();
    summary["localized"] = {{"located", path_.size()},
                            {"share", rounded(share())},
                            {"first_frame", any ? Json(first_frame_) : Json(nullptr)},
                            {"places", places_},
                            {"longest_gap", longest_gap_},
                            {"keyframes", map_->map.keyframe_count()},
                            {"camera_of_map", refined_},
                            {"start_s", rounded(start_s_)}};
  }

  void doubt(const Json& /*summary*/, std::vector<Doubt>& reasons) const override {
    if (share() >= 0.5) return;
    std::string text = fmt::format("{} of {} frames were located in the map", path_.size(), rows_.size());
    if (!last_reason_.empty()) text += "; last: " + last_reason_;
    reasons.push_back({Doubt::About::kLostFrames, text});
  }

 private:
  [[nodiscard]] double share() const {
    return rows_.empty() ? 0.0 : static_cast<double>(path_.size()) / static_cast<double>(rows_.size());
  }

  /// Keeps the outcome of a frame, and shows it to the observer.
  void note(const localize::LocatedFrame& located) {
    const std::string text = fmt::format("{:.6f},{}", located.stamp, located.how);

    // A frame that is not located has a row too, with the reason, so that gaps can be explained.
    if (!located.located) {
      longest_gap_ = std::max(longest_gap_, ++gap_);
      last_reason_ = located.reason;
      rows_.push_back(
          {located.number, FrameState::kLost, text + ",,,,,,,,," + core::csv_field(located.reason)});
      show({located.number, located.stamp, "lost", std::nullopt, {}});
      return;
    }

    if (path_.empty()) first_frame_ = located.number;
    path_.push_back({located.stamp, located.map_from_camera});
    if (located.how == "place") ++places_;
    gap_ = 0;
    rows_.push_back({located.number, FrameState::kLocated,
                     fmt::format("{},{:.6f},{:.7f},{},{},{},{},{:.4f},{:.4f},", text,
                                 located.sigma_position_m, located.sigma_rotation_rad,
                                 core::csv_field(name_of(located.keyframe.robot)), located.keyframe.index,
                                 located.points, located.lines, located.found, located.surface_share)});
    show({located.number,
          located.stamp,
          "tracked",
          located.map_from_camera,
          {},
          located.sigma_position_m,
          located.sigma_rotation_rad});
  }

  /// Observers expect maps in the frame of a camera, whose y points down.
  void show(LivePose pose) const {
    RunObserver* observer = context_->hooks.observer;
    if (observer == nullptr) return;
    if (pose.world_from_camera && map_->upright) {
      Eigen::Matrix3d optical_from_body;
      optical_from_body << 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0;
      pose.world_from_camera =
          geometry::Rigid3(optical_from_body, Eigen::Vector3d::Zero()) * *pose.world_from_camera;
    }
    observer->processed(pose);
    if (pose.world_from_camera)
      observer->tracked(0, pose.stamp, *pose.world_from_camera, *pose.world_from_camera);
  }

  [[nodiscard]] std::string name_of(std::int32_t robot) const {
    for (const RobotInfo& info : map_->robots) {
      if (info.number == robot) return info.name;
    }
    return {};
  }

  localize::LocalizerOptions options_;
  const RunContext* context_ = nullptr;
  std::shared_ptr<const localize::LocalizationMap> map_;
  std::optional<localize::Localizer> localizer_;
  bool refined_ = false;
  double start_s_ = 0.0;
  geometry::Trajectory path_;
  std::vector<FrameRow> rows_;
  std::size_t first_frame_ = 0;
  std::size_t places_ = 0;
  std::size_t gap_ = 0;
  std::size_t longest_gap_ = 0;
  std::string last_reason_;
};

}  // namespace

StageType localize_stage() {
  return stage_type<LocalizeStage>("localize", "Locates the camera in a finished map, which stays as it is",
                                   Mode::kSerial, {{"frame", frame_port()}, {"features", features_port()}},
                                   {});
}

}  // namespace plumbline::pipeline
