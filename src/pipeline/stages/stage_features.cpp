// SPDX-License-Identifier: BSD-3-Clause
// features: points and lines of every frame.
#include <memory>
#include <vector>

#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

class FeaturesStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }
  core::Result<void> start(const RunContext& context) override {
    recordings_ = context.input.recordings;
    for (const RobotInfo& robot : recordings_->robots()) {
      extractors_.push_back(std::make_unique<features::FeatureExtractor>(options_, robot.camera.color));
    }
    context.services->features = [this](const sensor::RgbdFrame& frame, std::int32_t robot) {
      const features::FeatureExtractor& extractor = *extractors_[static_cast<std::size_t>(robot)];
      return std::make_shared<const features::FrameFeatures>(extractor.extract(frame));
    };
    return {};
  }
  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const std::int32_t robot = recordings_->robot_of(io.frame());
    const features::FeatureExtractor& extractor = *extractors_[static_cast<std::size_t>(robot)];
    io.output<features::FrameFeatures>("features",
                                       std::make_shared<features::FrameFeatures>(extractor.extract(*frame)));
    return {};
  }

 private:
  features::FeatureOptions options_;
  const RobotRecordings* recordings_ = nullptr;
  std::vector<std::unique_ptr<features::FeatureExtractor>> extractors_;  ///< by robot
};

}  // namespace

StageType features_stage() {
  return stage_type<FeaturesStage>(
      "features", "Finds ORB points and LSD lines with their descriptors and depth", Mode::kStateless,
      {{"frame", frame_port()}}, {{"features", features_port()}});
}

}  // namespace plumbline::pipeline
