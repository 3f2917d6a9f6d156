// SPDX-License-Identifier: BSD-3-Clause
// Tap of features: a table a frame.
#include <fmt/format.h>

#include "plumbline/core/output_file.hpp"
#include "stages/stages.hpp"
#include "taps/tap_file.hpp"

namespace plumbline::pipeline {
namespace {

class FeaturesTap : public Tap {
 public:
  FeaturesTap() : Tap(Count::kFrames, {".csv"}) {}
  core::Result<void> process(StageIo& io) override {
    if (skips(io.frame())) return {};
    const auto features = io.input<features::FrameFeatures>("in");
    core::OutputFile out(path(io.frame()));
    out.write(
        "kind,x_px,y_px,end_x_px,end_y_px,depth_m,octave,angle_deg,response,start_x_m,start_y_m,start_z_m,"
        "end_x_m,end_y_m,end_z_m\n");

    // A depth of zero is no measurement: its cell stays empty, so that it is not taken for a distance.
    for (const features::PointFeature& p : features->points) {
      const std::string depth = p.depth > 0.0F ? fmt::format("{:.4f}", p.depth) : "";
      out.write(fmt::format("point,{:.2f},{:.2f},,,{},{},{:.2f},{:.6g},,,,,,\n", p.pixel.x(), p.pixel.y(),
                            depth, p.octave, p.angle, p.response));
    }

    for (const features::LineFeature& line : features->lines) {
      const features::LineSegment& s = line.segment;
      out.write(fmt::format("line,{:.2f},{:.2f},{:.2f},{:.2f},,,,{:.6g},", s.start.x(), s.start.y(),
                            s.end.x(), s.end.y(), s.response));

      // A line without usable depth is known in the image only.
      if (line.line3) {
        const Eigen::Vector3d& a = line.line3->start;
        const Eigen::Vector3d& b = line.line3->end;
        out.write(fmt::format("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n", a.x(), a.y(), a.z(), b.x(),
                              b.y(), b.z()));
      } else {
        out.write(",,,,,\n");
      }
    }

    return out.commit();
  }
};

}  // namespace

StageType features_tap() {
  return tap_type<FeaturesTap>(features_port(),
                               "Points and lines of a frame, one per line: pixels, depth, and the 3D ends "
                               "(camera frame) of lines with depth",
                               Mode::kStateless);
}

}  // namespace plumbline::pipeline
