// SPDX-License-Identifier: BSD-3-Clause
// cloud: the filtered cloud of every keyframe.
#include <memory>
#include <utility>
#include <vector>

#include "chain_option.hpp"
#include "plumbline/cloud/compact_cloud.hpp"
#include "plumbline/cloud/keyframe_cloud.hpp"
#include "plumbline/dataset/frame_source.hpp"
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
    if (!track->keyframe.valid() && !between) return {};
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const sensor::Pinhole camera = recordings_ != nullptr
                                       ? recordings_->robots()[static_cast<std::size_t>(robot)].camera.color
                                       : camera_;
    cloud::CloudPtr cloud = cloud::organised_cloud(*frame, camera, options_);
    cloud::FilterContext context;
    context.viewpoint = Eigen::Vector3f::Zero();
    context.run = std::to_string(track->keyframe.index);
    auto filtered = filters_.chain().apply(cloud, context);
    if (!filtered) return tl::unexpected<core::Error>(filtered.error());
    auto result = std::make_shared<KeyframeCloud>();
    result->id = track->keyframe;
    result->stamp = track->stamp;
    result->robot = robot;
    result->compact = std::make_shared<std::vector<std::uint8_t>>(cloud::encode_cloud(**filtered));
    result->cloud = std::move(*filtered);
    io.output<KeyframeCloud>("cloud", result);
    return {};
  }

 private:
  cloud::KeyframeCloudOptions options_;
  int between_ = 10;
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
