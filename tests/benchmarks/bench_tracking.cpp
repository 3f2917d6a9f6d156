// SPDX-License-Identifier: BSD-3-Clause
// Cost of every step between a decoded frame and its pose, on one thread, in a generated room filmed like a
// Kinect:
//   build/release/tests/benchmarks/bench_tracking
#include <benchmark/benchmark.h>

#include <memory>
#include <opencv2/core/utility.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "plumbline/features/line_border.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/synth/source.hpp"
#include "plumbline/tracking/overlay.hpp"
#include "plumbline/tracking/surface_sampler.hpp"
#include "plumbline/tracking/thumbnail_alignment.hpp"

namespace {

using namespace plumbline;

/// A map of the first kMapped frames, and the frame after them.
class Room {
 public:
  static const Room& get() {
    static const Room room;
    return room;
  }

  sensor::Pinhole camera;
  sensor::RgbdFrame previous, frame;
  features::FrameFeatures previous_features, frame_features;
  std::unique_ptr<mapping::Slam> slam;
  tracking::LocalMap local_map;
  tracking::TrackResult track;         ///< of `previous`
  geometry::Rigid3 camera_from_world;  ///< of `previous`: a guess for `frame`

 private:
  static constexpr std::size_t kMapped = 40;

  Room() : log_(core::null_log()) {
    cv::setNumThreads(1);
    auto source = synth::open_synth("synth:room?frames=120&seed=1", PLUMBLINE_SOURCE_DIR "/pipelines/scenes",
                                    executor_, *log_);
    if (!source) throw std::runtime_error(source.error().message);
    camera = (*source)->camera().color;
    const features::FeatureExtractor extractor({}, camera);
    slam = std::make_unique<mapping::Slam>(mapping::SlamOptions{}, camera, 0, executor_, *log_);
    for (std::size_t i = 0; i < kMapped; ++i) {
      previous = (*source)->read(i).value();
      previous_features = extractor.extract(previous);
      track = *slam->process(previous, std::make_shared<features::FrameFeatures>(previous_features)).track;
    }
    frame = (*source)->read(kMapped).value();
    frame_features = extractor.extract(frame);
    if (track.state != tracking::TrackState::kTracked) throw std::runtime_error("the room was not tracked");
    camera_from_world = track.camera_from_world;
    local_map = tracking::build_local_map(slam->map(), slam->map().keyframe_ids().back(), {});
  }

  core::Executor executor_{1};
  std::shared_ptr<core::Log> log_;
};

void extract_orb(benchmark::State& state) {
  const Room& room = Room::get();
  features::OrbOptions options;
  options.count = static_cast<int>(state.range(0));
  const features::OrbExtractor extractor(options);
  const cv::Rect region = features::valid_region(room.frame.gray);
  std::size_t found = 0;
  for (auto _ : state) found = extractor.extract(room.frame.gray, region).points.size();
  state.counters["points"] = static_cast<double>(found);
}
BENCHMARK(extract_orb)->Arg(1000)->Unit(benchmark::kMillisecond);

void extract_lines(benchmark::State& state) {
  const Room& room = Room::get();
  const features::LineExtractor extractor;
  std::size_t found = 0;
  for (auto _ : state) found = extractor.extract(room.frame.gray, room.frame.depth, room.camera).size();
  state.counters["lines"] = static_cast<double>(found);
}
BENCHMARK(extract_lines)->Unit(benchmark::kMillisecond);

void extract_features(benchmark::State& state) {
  const Room& room = Room::get();
  const features::FeatureExtractor extractor({}, room.camera);
  for (auto _ : state) benchmark::DoNotOptimize(extractor.extract(room.frame));
}
BENCHMARK(extract_features)->Unit(benchmark::kMillisecond);

void sample_surface(benchmark::State& state) {
  const Room& room = Room::get();
  std::size_t found = 0;
  for (auto _ : state) found = tracking::sample_surface(room.frame.depth, room.camera, {}).size();
  state.counters["samples"] = static_cast<double>(found);
}
BENCHMARK(sample_surface)->Unit(benchmark::kMillisecond);

void build_local_map(benchmark::State& state) {
  const Room& room = Room::get();
  const core::KeyframeId last = room.slam->map().keyframe_ids().back();
  for (auto _ : state) benchmark::DoNotOptimize(tracking::build_local_map(room.slam->map(), last, {}));
  state.counters["keyframes"] = static_cast<double>(room.local_map.keyframes.size());
}
BENCHMARK(build_local_map)->Unit(benchmark::kMillisecond);

void associate_surface(benchmark::State& state) {
  const Room& room = Room::get();
  tracking::SurfaceAssociationOptions options;
  options.max_samples = static_cast<int>(state.range(0));
  std::size_t found = 0;
  for (auto _ : state) {
    found = tracking::associate_surface(room.local_map.surface,
                                        {room.frame.depth, room.camera, room.camera_from_world, {}}, options)
                .size();
  }
  state.counters["terms"] = static_cast<double>(found);
}
BENCHMARK(associate_surface)->Arg(500)->Arg(2400)->Unit(benchmark::kMicrosecond);

void match_points(benchmark::State& state) {
  const Room& room = Room::get();
  std::size_t found = 0;
  for (auto _ : state) {
    std::vector<core::PointId> visible;
    found = tracking::match_points(room.slam->map(), room.local_map.points,
                                   {room.frame_features, room.camera, room.camera_from_world},
                                   static_cast<double>(state.range(0)), {}, &visible)
                .size();
  }
  state.counters["landmarks"] = static_cast<double>(room.local_map.points.size());
  state.counters["matches"] = static_cast<double>(found);
}
BENCHMARK(match_points)->ArgName("radius_px")->Arg(6)->Arg(12)->Unit(benchmark::kMicrosecond);

void match_lines(benchmark::State& state) {
  const Room& room = Room::get();
  std::size_t found = 0;
  for (auto _ : state) {
    std::vector<core::LineId> visible;
    found = tracking::match_lines(room.slam->map(), room.local_map.lines,
                                  {room.frame_features, room.camera, room.camera_from_world},
                                  static_cast<double>(state.range(0)), {}, &visible)
                .size();
  }
  state.counters["landmarks"] = static_cast<double>(room.local_map.lines.size());
  state.counters["matches"] = static_cast<double>(found);
}
BENCHMARK(match_lines)->ArgName("radius_px")->Arg(6)->Arg(12)->Unit(benchmark::kMicrosecond);

/// The problem that the tracker solves in its last rounds: all families, from the previous pose.
optimize::PoseProblem pose_problem(const Room& room) {
  const maps::Map& map = room.slam->map();
  optimize::PoseProblem problem;
  problem.camera = room.camera;
  for (const tracking::PointMatch& m : tracking::match_points(
           map, room.local_map.points, {room.frame_features, room.camera, room.camera_from_world}, 12.0, {},
           nullptr)) {
    const features::PointFeature& f = room.frame_features.points[static_cast<std::size_t>(m.feature)];
    problem.points.push_back(
        {map.point(m.point).position, f.pixel.cast<double>(), 1.0, static_cast<double>(f.depth), 0.01});
  }
  for (const tracking::LineMatch& m :
       tracking::match_lines(map, room.local_map.lines,
                             {room.frame_features, room.camera, room.camera_from_world}, 12.0, {}, nullptr)) {
    const features::LineSegment& s = room.frame_features.lines[static_cast<std::size_t>(m.feature)].segment;
    const maps::MapLine& line = map.line(m.line);
    problem.lines.push_back(
        {geometry::line_through(line.start, line.end), s.start.cast<double>(), s.end.cast<double>(), 1.2});
  }
  problem.planes = tracking::associate_surface(
      room.local_map.surface, {room.frame.depth, room.camera, room.camera_from_world, {}}, {});
  return problem;
}

void solve_pose(benchmark::State& state) {
  const Room& room = Room::get();
  const optimize::PoseProblem problem = pose_problem(room);
  optimize::PoseSummary summary;
  for (auto _ : state) summary = optimize::solve_pose(problem, room.camera_from_world, {});
  state.counters["points"] = static_cast<double>(problem.points.size());
  state.counters["lines"] = static_cast<double>(problem.lines.size());
  state.counters["planes"] = static_cast<double>(problem.planes.size());
  state.counters["iterations"] = static_cast<double>(summary.iterations);
}
BENCHMARK(solve_pose)->Unit(benchmark::kMicrosecond);

void align_thumbnails(benchmark::State& state) {
  const Room& room = Room::get();
  for (auto _ : state) {
    benchmark::DoNotOptimize(tracking::align_thumbnails(room.previous_features.thumbnail,
                                                        room.previous_features.thumbnail_depth,
                                                        room.frame_features.thumbnail, room.camera, {}));
  }
}
BENCHMARK(align_thumbnails)->Unit(benchmark::kMicrosecond);

/// Everything between the features of a frame and its pose. Each call starts from the frame before.
void track_frame(benchmark::State& state) {
  const Room& room = Room::get();
  const maps::Map& map = room.slam->map();
  const auto previous = std::make_shared<const features::FrameFeatures>(room.previous_features);
  const auto features = std::make_shared<const features::FrameFeatures>(room.frame_features);
  tracking::TrackResult result;
  for (auto _ : state) {
    state.PauseTiming();
    tracking::Tracker tracker({}, room.camera);
    tracking::Surroundings around;
    tracker.track(maps::Map{}, around, room.previous, previous);  // remembers the picture
    around.local_map = room.local_map;
    tracker.set_camera_from_world(room.camera_from_world);
    state.ResumeTiming();
    result = tracker.track(map, around, room.frame, features);
  }
  if (result.state != tracking::TrackState::kTracked) state.SkipWithError("lost");
  state.counters["points"] = result.estimate.points.inliers;
  state.counters["lines"] = result.estimate.lines.inliers;
  state.counters["planes"] = result.estimate.planes.inliers;
}
BENCHMARK(track_frame)->Unit(benchmark::kMillisecond);

void draw_overlay(benchmark::State& state) {
  const Room& room = Room::get();
  for (auto _ : state) {
    benchmark::DoNotOptimize(tracking::draw_overlay(room.previous, room.previous_features, room.track,
                                                    room.slam->map(), room.camera));
  }
}
BENCHMARK(draw_overlay)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
