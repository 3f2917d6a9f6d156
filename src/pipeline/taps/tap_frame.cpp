// SPDX-License-Identifier: BSD-3-Clause
// Tap of frames: PNG images as rectified. Named frame-*.png they are a recording that can be read again.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "stages/stages.hpp"
#include "taps/tap_file.hpp"

namespace plumbline::pipeline {
namespace {

core::Result<void> write_png(const std::filesystem::path& file, const cv::Mat& image) {
  constexpr int kQuick = 1;
  const auto bytes = dataset::encode_png(image, kQuick);
  if (!bytes) return core::failure(bytes.error().kind, file.string() + ": " + bytes.error().message);
  core::OutputFile out(file);
  out.write(bytes->data(), bytes->size());
  return out.commit();
}

class FrameTap : public Tap {
 public:
  FrameTap() : Tap(TapFile::Count::kFrames, {".png"}) {}
  [[nodiscard]] std::vector<std::string> files() const override {
    return {file_.with(".color"), file_.with(".depth"), camera_name()};
  }

  core::Result<void> start(const RunContext& context) override {
    if (auto made = file_.start(context); !made) return made;
    sensor::Camera camera = context.source->camera();
    camera.distortion = {};  // frames are rectified and registered
    camera.depth_slope = {};
    camera.color_from_depth.reset();
    camera.depth.reset();
    depth_scale_ = camera.depth_scale;
    core::OutputFile out(file_.folder() / "camera.yaml");
    out.write(sensor::to_yaml(camera));
    return out.commit();
  }

  core::Result<void> process(StageIo& io) override {
    if (file_.skips(io.frame())) return {};
    const auto frame = io.input<sensor::RgbdFrame>("in");
    if (auto written = write_png(file_.path(io.frame(), ".color"), frame->color); !written) return written;
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
    return write_png(file_.path(io.frame(), ".depth"), raw);
  }

 private:
  [[nodiscard]] std::string camera_name() const {
    return (std::filesystem::path(file_.name()).parent_path() / "camera.yaml").string();
  }

  double depth_scale_ = 5000.0;
};

}  // namespace

StageType frame_tap() {
  return {"frame",
          "Colour and depth (16 bit, at the camera's depth_scale) with a camera.yaml beside; as frame-*.png "
          "a recording of its own",
          Mode::kStateless,
          {{"in", frame_port()}},
          {},
          [] { return std::make_unique<FrameTap>(); },
          true};
}

}  // namespace plumbline::pipeline
