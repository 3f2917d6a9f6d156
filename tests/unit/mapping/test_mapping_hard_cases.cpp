// SPDX-License-Identifier: BSD-3-Clause
// One walk through the furnished room with everything that ends other systems' runs: whiteout, darkness,
// blur, missing frames, no depth, pure rotation, a covered camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::mapping {
namespace {

using tracking::TrackState;

constexpr const char* kWalk =
    "synth:room?frames=190&fps=15&seed=3&events=whiteout@1+2,lampoff@3.6+0.6,blur@4.8+0.6*15,drop@6+0.67,"
    "nodepth@7.2+1,spin@8.8+2*0.25,cover@11+0.6";

/// The walk, filmed and tracked; twelve seconds of it are enough work for one test.
class HardWalk {
 public:
  struct Step {
    double time = 0.0;  ///< seconds from the first frame
    FrameReport report;
  };
  std::vector<Step> steps;
  geometry::Trajectory trajectory;
  geometry::Trajectory truth;

  /// Frames in [from, to) seconds, and how many of them have a pose.
  struct Share {
    int frames = 0;
    int tracked = 0;
    [[nodiscard]] double value() const { return static_cast<double>(tracked) / std::max(1, frames); }
  };
  [[nodiscard]] Share share(double from, double to) const {
    Share result;
    for (const Step& s : steps) {
      if (s.time < from || s.time >= to) continue;
      ++result.frames;
      if (s.report.state == TrackState::kTracked) ++result.tracked;
    }
    return result;
  }
  /// Seconds from `time` to the first frame at or after it that has a pose.
  [[nodiscard]] double until_tracked(double time) const {
    for (const Step& s : steps) {
      if (s.time >= time && s.report.state == TrackState::kTracked) return s.time - time;
    }
    return 1e9;
  }

  HardWalk() {
    const core::Executor executor(2);
    const auto log = core::null_log();
    const auto source =
        synth::open_synth(kWalk, std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes", executor, *log);
    if (!source) throw std::runtime_error(source.error().message);
    truth = (*source)->truth().value();
    const sensor::Pinhole camera = (*source)->camera().color;
    const features::FeatureExtractor extractor({}, camera);
    Slam slam({}, camera, 0, executor, *log);
    struct Shot {
      sensor::RgbdFrame frame;
      std::shared_ptr<const features::FrameFeatures> features;
    };
    constexpr std::size_t kChunk = 16;
    for (std::size_t begin = 0; begin < (*source)->size(); begin += kChunk) {
      std::vector<Shot> shots(std::min(kChunk, (*source)->size() - begin));
      executor.parallel_for(shots.size(), [&](std::size_t i) {
        shots[i].frame = (*source)->read(begin + i).value();
        shots[i].features = std::make_shared<features::FrameFeatures>(extractor.extract(shots[i].frame));
      });
      for (const Shot& shot : shots) {
        const double start = steps.empty() ? shot.frame.stamp : steps.front().report.stamp;
        steps.push_back({shot.frame.stamp - start, slam.process(shot.frame, shot.features)});
      }
    }
    slam.finish();
    trajectory = maps::trajectory(slam.frame_poses(), slam.map());
  }
};

void expect_whiteout_tracked_by_surfaces(const HardWalk& walk) {
  EXPECT_GE(walk.share(1.0, 3.0).frames, 29);
  EXPECT_GE(walk.share(1.0, 3.0).value(), 0.95);
  int seen = 0;
  for (const HardWalk::Step& s : walk.steps) {
    if (s.time > 1.0 && s.time < 2.9) seen += s.report.points.inliers + s.report.lines.inliers;
  }
  EXPECT_LT(seen, 20) << "a whiteout that shows the room is none";
}

void expect_darkness_survived(const HardWalk& walk) { EXPECT_GE(walk.share(3.6, 4.2).value(), 0.9); }

void expect_blur_survived(const HardWalk& walk) { EXPECT_GE(walk.share(4.8, 5.4).value(), 0.9); }

void expect_missing_frames_survived(const HardWalk& walk) {
  EXPECT_EQ(walk.share(6.02, 6.65).frames, 0) << "frames were to be missing";
  EXPECT_LE(walk.until_tracked(6.65), 0.2);
}

void expect_blindness_tracked_by_features(const HardWalk& walk) {
  EXPECT_GE(walk.share(7.2, 8.2).value(), 0.95);
  for (const HardWalk::Step& s : walk.steps) {
    if (s.time > 7.25 && s.time < 8.15) {
      EXPECT_EQ(s.report.surface.inliers, 0) << s.time;
    }
  }
}

void expect_pure_rotation_tracked(const HardWalk& walk) { EXPECT_GE(walk.share(8.8, 10.8).value(), 0.95); }

void expect_found_again_after_the_cover(const HardWalk& walk) {
  EXPECT_EQ(walk.share(11.05, 11.55).tracked, 0) << "nothing to be seen is nothing to be trusted";
  EXPECT_LE(walk.until_tracked(11.6), 1.0);
  EXPECT_GE(walk.share(12.0, 99.0).value(), 0.95);
}

void expect_the_trajectory_right(const HardWalk& walk) {
  const HardWalk::Share all = walk.share(0.0, 99.0);
  const HardWalk::Share covered = walk.share(11.0, 11.6);
  EXPECT_GE(all.tracked, static_cast<int>(0.97 * (all.frames - covered.frames)));
  const auto report = evaluate::evaluate_trajectory(walk.trajectory, walk.truth);
  ASSERT_TRUE(report);
  EXPECT_LT(report->ate_m.rmse, 0.012);
}

TEST(HardCases, NoneEndsARun) {
  const HardWalk walk;
  expect_whiteout_tracked_by_surfaces(walk);
  expect_darkness_survived(walk);
  expect_blur_survived(walk);
  expect_missing_frames_survived(walk);
  expect_blindness_tracked_by_features(walk);
  expect_pure_rotation_tracked(walk);
  expect_found_again_after_the_cover(walk);
  expect_the_trajectory_right(walk);
}

}  // namespace
}  // namespace plumbline::mapping
