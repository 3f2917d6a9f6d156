// SPDX-License-Identifier: BSD-3-Clause
// features: points and lines of every frame.
#include <memory>
#include <optional>

#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/features/frame_features.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

class FeaturesStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }
  core::Result<void> start(const RunContext& context) override {
    extractor_.emplace(options_, context.source->camera().color);
    return {};
  }
  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    io.output<features::FrameFeatures>(
        "features", std::make_shared<features::FrameFeatures>(extractor_->extract(*frame)));
    return {};
  }

 private:
  features::FeatureOptions options_;
  std::optional<features::FeatureExtractor> extractor_;
};

}  // namespace

StageType features_stage() {
  return {"features",
          "Finds ORB points and LSD lines with their descriptors and depth",
          Mode::kStateless,
          {{"frame", frame_port()}},
          {{"features", features_port()}},
          [] { return std::make_unique<FeaturesStage>(); }};
}

}  // namespace plumbline::pipeline
