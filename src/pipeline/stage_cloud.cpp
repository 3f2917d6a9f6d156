// SPDX-License-Identifier: BSD-3-Clause
// cloud: the filtered cloud of every keyframe.
#include <memory>
#include <utility>
#include <vector>

#include "chain_option.hpp"
#include "plumbline/cloud/compact_cloud.hpp"
#include "plumbline/cloud/free_space.hpp"
#include "plumbline/cloud/keyframe_cloud.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/mapping/local_map_alignment.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

class CloudStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.integer(
        "between", between_, {0, 100000}, "",
        "Every so many frames, and at the end, one that is no keyframe gives a cloud as well; 0: none");
    table.integer("looks", looks_, {0, 100000}, "",
                  "Every so many frames one that gives no cloud is kept as what it sees through; 0: none");
    filters_.declare(table, "Filter chain for the cloud of each keyframe; empty: none");
  }
  void check(const CheckContext& context, const core::ConfigMark& /*mark*/, const std::string& path,
             core::ConfigProblems& problems) override {
    filters_.check(context, path, problems);
  }
  [[nodiscard]] std::vector<std::string> files() const override { return filters_.files(); }
  core::Result<void> start(const RunContext& context) override {
    camera_ = context.source->camera().color;
    frames_ = context.source->size();
    recordings_ = context.recordings;
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto track = io.input<TrackedFrame>("track");
    const std::int32_t robot = recordings_ != nullptr ? recordings_->robot_of(io.frame()) : 0;
    const std::size_t number = recordings_ != nullptr ? recordings_->frame_of(io.frame()) : io.frame();
    const std::size_t frames = recordings_ != nullptr ? recordings_->frames_of(robot) : frames_;
    // The last frame shows what no other does when the camera was on its way somewhere.
    const bool between =
        between_ > 0 && (number % static_cast<std::size_t>(between_) == 0 || number + 1 == frames);
    const bool gives_cloud = track->keyframe.valid() || between;
    const bool looks = looks_ > 0 && number % static_cast<std::size_t>(looks_) == 0;
    if (!gives_cloud && !looks) return {};
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const sensor::Pinhole camera = recordings_ != nullptr
                                       ? recordings_->robots()[static_cast<std::size_t>(robot)].camera.color
                                       : camera_;
    core::Result<cloud::CloudPtr> made =
        gives_cloud ? filtered(*frame, camera, track->keyframe)
                    : cloud::depth_look(*frame, camera, options_.min_depth_m, options_.max_depth_m);
    if (!made) return tl::unexpected<core::Error>(made.error());
    cloud::set_sensor_pose(**made, track->depth_from_camera.inverse());
    auto result = std::make_shared<KeyframeCloud>();
    result->id = track->keyframe;
    result->stamp = track->stamp;
    result->robot = robot;
    result->compact = std::make_shared<std::vector<std::uint8_t>>(cloud::encode_cloud(**made));
    if (result->id.valid()) {
      result->surface = std::make_shared<maps::StoredSurface>(
          maps::StoredSurface{kSurfaceVoxel_m, mapping::coarse_surface(**made, kSurfaceVoxel_m)});
    }
    result->cloud = std::move(*made);
    io.output<KeyframeCloud>("cloud", result);
    return {};
  }

 private:
  core::Result<cloud::CloudPtr> filtered(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera,
                                         core::KeyframeId keyframe) const {
    cloud::FilterContext context;
    context.viewpoint = Eigen::Vector3f::Zero();
    context.run = std::to_string(keyframe.index);
    return filters_.chain().apply(cloud::organised_cloud(frame, camera, options_), context);
  }

  cloud::KeyframeCloudOptions options_;
  int between_ = 10;
  int looks_ = 3;
  std::size_t frames_ = 0;
  ChainOption filters_{"filters/keyframe.yaml"};
  sensor::Pinhole camera_;
  const RobotRecordings* recordings_ = nullptr;  ///< null: one robot
};

}  // namespace

StageType cloud_stage() {
  return {"cloud",
          "Turns a keyframe's depth into a filtered cloud with colour and normals",
          Mode::kStateless,
          {{"frame", frame_port()}, {"track", track_port()}},
          {{"cloud", keyframe_cloud_port()}},
          [] { return std::make_unique<CloudStage>(); }};
}

}  // namespace plumbline::pipeline
