// SPDX-License-Identifier: BSD-3-Clause
// Follows the camera through a recording: points and lines of each frame, then SLAM.
//
//   track_camera INPUT PIPELINES TRAJECTORY.txt
//
// The same as the stages `features` and `track` of pipelines/rgbd.yaml, as plain calls.
#include <cstdio>
#include <memory>

#include "plumbline/core/error.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/input.hpp"

using namespace plumbline;

namespace {

/// Prints the message; returns the exit code that the program uses for this kind of error.
int fail(const core::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return static_cast<int>(error.kind);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: track_camera INPUT PIPELINES TRAJECTORY.txt\n");
    return 2;
  }

  const std::filesystem::path pipelines = argv[2];
  const core::Executor executor;
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  dataset::OpenOptions options;
  options.cameras_folder = pipelines / "cameras";
  const auto source = pipeline::open_input(argv[1], options, pipelines / "scenes", executor, *log);
  if (!source) return fail(source.error());

  const sensor::Pinhole& camera = (*source)->camera().color;
  const features::FeatureExtractor extractor({}, camera);  // every Options struct has usable defaults
  constexpr int kRobot = 0;
  mapping::Slam slam({}, camera, kRobot, executor, *log);

  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const auto frame = (*source)->read(i);
    if (!frame) continue;
    const auto report =
        slam.process(*frame, std::make_shared<features::FrameFeatures>(extractor.extract(*frame)));
    std::printf("%10.3f s  %-12s %3d points %3d lines%s\n", report.stamp, tracking::to_string(report.state),
                report.points.inliers, report.lines.inliers, report.keyframe.valid() ? "  keyframe" : "");
  }

  slam.finish();

  const geometry::Trajectory trajectory = slam.trajectory();  // world_from_camera of the tracked frames
  if (auto written = dataset::write_trajectory(argv[3], trajectory); !written) return fail(written.error());
  std::printf("%zu points and %zu lines in %zu keyframes\n", slam.map().point_count(),
              slam.map().line_count(), slam.map().keyframe_count());
  std::printf("tracked %zu of %zu frames, wrote %s\n", trajectory.size(), (*source)->size(), argv[3]);
}
