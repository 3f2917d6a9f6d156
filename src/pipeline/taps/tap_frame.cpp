// SPDX-License-Identifier: BSD-3-Clause
// Tap of frames: PNG images as rectified. Named frame-*.png they are a recording that can be read again.

#include <cmath>
#include <opencv2/core/mat.hpp>

#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "stages/stages.hpp"
#include "taps/tap_file.hpp"

namespace plumbline::pipeline {
namespace {

class FrameTap : public Tap {
 public:
  FrameTap() : Tap(Count::kFrames, {".png"}) {}
  [[nodiscard]] std::vector<std::string> files() const override {
    return {with(".color"), with(".depth"), camera_name()};
  }

  core::Result<void> start(const RunContext& context) override {
    if (auto made = Tap::start(context); !made) return made;
    sensor::Camera camera = context.input.source->camera();
    camera.model = sensor::LensModel::kRadialTangential;  // frames are rectified and registered
    camera.distortion = {};
    camera.depth_lens = {};
    camera.depth_slope = {};
    camera.color_from_depth.reset();
    camera.depth.reset();
    depth_scale_ = camera.depth_scale;
    return core::write_file(path().parent_path() / "camera.yaml", sensor::to_yaml(camera));
  }

  core::Result<void> process(StageIo& io) override {
    if (skips(io.frame())) return {};
    const auto frame = io.input<sensor::RgbdFrame>("in");
    if (auto written = dataset::write_png(path(io.frame(), ".color"), frame->color); !written) return written;
    constexpr double kLargest = 65534.0;  // 65535 means no measurement
    cv::Mat raw(frame->depth.size(), CV_16UC1);
    for (int row = 0; row < raw.rows; ++row) {
      for (int column = 0; column < raw.cols; ++column) {
        const double units =
            std::round(static_cast<double>(frame->depth.at<float>(row, column)) * depth_scale_);
        raw.at<std::uint16_t>(row, column) =
            units > 0.0 && units <= kLargest ? static_cast<std::uint16_t>(units) : std::uint16_t{0};
      }
    }
    return dataset::write_png(path(io.frame(), ".depth"), raw);
  }

 private:
  [[nodiscard]] std::string camera_name() const {
    return (std::filesystem::path(with("")).parent_path() / "camera.yaml").string();
  }

  double depth_scale_ = 5000.0;
};

}  // namespace

StageType frame_tap() {
  return tap_type<FrameTap>(frame_port(),
                            "Colour and depth (16 bit, at the camera's depth_scale) with a camera.yaml; "
                            "named frame-*.png they are a recording",
                            Mode::kStateless);
}

}  // namespace plumbline::pipeline
