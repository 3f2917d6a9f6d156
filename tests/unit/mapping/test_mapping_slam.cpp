// SPDX-License-Identifier: BSD-3-Clause
// The whole of one robot's SLAM on short filmed recordings with known truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <thread>

#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/line_export.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::mapping {
namespace {

using tracking::TrackState;

struct Shot {
  sensor::RgbdFrame frame;
  std::shared_ptr<const features::FrameFeatures> features;
};

/// Filmed once for all tests: 36 frames of the furnished room, with the noise of a Kinect.
class Recording {
 public:
  static const Recording& get() {
    static const Recording kRecording;
    return kRecording;
  }
  std::vector<Shot> shots;
  sensor::Pinhole camera;
  geometry::Trajectory truth;
  features::FeatureExtractor extractor{{}, {}};

  [[nodiscard]] Shot shot(sensor::RgbdFrame frame) const {
    auto features = std::make_shared<features::FrameFeatures>(extractor.extract(frame));
    return {std::move(frame), std::move(features)};
  }

 private:
  Recording() {
    const core::Executor executor(2);
    const auto log = core::null_log();
    const std::string scenes = std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes";
    const auto source = synth::open_synth("synth:room?frames=36&fps=15&seed=2", scenes, executor, *log);
    if (!source) throw std::runtime_error(source.error().message);
    camera = (*source)->camera().color;
    truth = (*source)->truth().value();
    extractor = features::FeatureExtractor({}, camera);
    shots.resize((*source)->size());
    executor.parallel_for(shots.size(), [&](std::size_t i) { shots[i] = shot((*source)->read(i).value()); });
  }
};

struct SlamRun {
  std::vector<FrameReport> reports;
  geometry::Trajectory trajectory;
  geometry::Trajectory keyframes;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> lines;
  std::vector<double> landmarks;  ///< all there is to know of their places and counts
  std::size_t points = 0;
  int bundles = 0;

  [[nodiscard]] int count(TrackState state) const {
    return static_cast<int>(
        std::count_if(reports.begin(), reports.end(), [&](const auto& r) { return r.state == state; }));
  }
};

std::vector<double> landmarks_of(const maps::Map& map) {
  std::vector<double> numbers;
  for (core::PointId id : map.point_ids()) {
    const maps::MapPoint& p = map.point(id);
    numbers.insert(numbers.end(), {static_cast<double>(id.index), p.position.x(), p.position.y(),
                                   p.position.z(), static_cast<double>(p.observations.size())});
  }
  for (core::LineId id : map.line_ids()) {
    const maps::MapLine& l = map.line(id);
    numbers.insert(numbers.end(), {static_cast<double>(id.index), l.start.x(), l.start.y(), l.start.z(),
                                   l.end.x(), l.end.y(), l.end.z()});
  }
  return numbers;
}

SlamRun run(const std::vector<Shot>& shots, int threads = 1, const SlamOptions& options = {},
            std::optional<double> readout_s = {}) {
  const core::Executor executor(threads);
  const auto log = core::null_log();
  Slam slam(options, Recording::get().camera, 0, executor, *log);
  sensor::Camera camera;
  camera.color = Recording::get().camera;
  camera.readout_s = readout_s;
  slam.set_camera(camera);
  SlamRun result;
  for (const Shot& shot : shots) {
    result.reports.push_back(slam.process(shot.frame, shot.features));
    result.bundles += result.reports.back().bundle.keyframe.valid() ? 1 : 0;
  }
  slam.finish();
  result.landmarks = landmarks_of(slam.map());
  result.trajectory = maps::trajectory(slam.frame_poses(), slam.map());
  result.keyframes = maps::keyframe_trajectory(slam.map());
  result.lines = maps::line_segments(slam.map());
  result.points = slam.map().point_count();
  return result;
}

double ate(const geometry::Trajectory& trajectory, const geometry::Trajectory& truth) {
  const auto report = evaluate::evaluate_trajectory(trajectory, truth);
  return report ? report->ate_m.rmse : 1e9;
}

Shot blackened(const Shot& shot) {
  sensor::RgbdFrame frame = shot.frame;
  frame.color = cv::Mat(frame.color.size(), frame.color.type(), cv::Scalar::all(0));
  frame.gray = cv::Mat(frame.gray.size(), CV_8UC1, cv::Scalar(0));
  frame.depth = cv::Mat(frame.depth.size(), CV_32FC1, cv::Scalar(0));
  return Recording::get().shot(frame);
}

Shot without_depth(const Shot& shot) {
  sensor::RgbdFrame frame = shot.frame;
  frame.depth = cv::Mat(frame.depth.size(), CV_32FC1, cv::Scalar(0));
  return Recording::get().shot(frame);
}

bool same_bytes(const geometry::Trajectory& a, const geometry::Trajectory& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto& x = a[i].world_from_camera;
    const auto& y = b[i].world_from_camera;
    if (a[i].stamp != b[i].stamp) return false;
    if (std::memcmp(x.rotation.data(), y.rotation.data(), 9 * sizeof(double)) != 0) return false;
    if (std::memcmp(x.translation.data(), y.translation.data(), 3 * sizeof(double)) != 0) return false;
  }
  return true;
}

TEST(Slam, TracksEveryFrameWithinFiveMillimetres) {
  const Recording& recording = Recording::get();
  const SlamRun result = run(recording.shots);
  ASSERT_EQ(result.reports.size(), 36U);
  EXPECT_EQ(result.count(TrackState::kTracked), 36);
  ASSERT_EQ(result.trajectory.size(), 36U);
  EXPECT_LT(ate(result.trajectory, recording.truth), 0.005);
  double way = 0.0;
  for (std::size_t i = 1; i < recording.truth.size(); ++i) {
    way += (recording.truth[i].world_from_camera.translation -
            recording.truth[i - 1].world_from_camera.translation)
               .norm();
  }
  EXPECT_GT(way, 0.4) << "a camera that stands still proves nothing";
  EXPECT_GE(result.keyframes.size(), 3U);
  EXPECT_LT(result.keyframes.size(), 25U);
  EXPECT_GT(result.points, 500U);
  EXPECT_GT(result.lines.size(), 5U);
  for (std::size_t i = 0; i < 36; ++i) {
    EXPECT_EQ(result.reports[i].frame_index, recording.shots[i].frame.index);
    EXPECT_EQ(result.trajectory[i].stamp, recording.shots[i].frame.stamp);
  }
}

TEST(Slam, SameBytesTwiceAndForAnyNumberOfThreads) {
  const Recording& recording = Recording::get();
  SlamOptions options;
  options.bundle_lag = 6;  // several bundles in so few frames
  const SlamRun a = run(recording.shots, 1, options);
  const SlamRun b = run(recording.shots, 2, options);
  EXPECT_TRUE(same_bytes(a.trajectory, b.trajectory));
  EXPECT_TRUE(same_bytes(a.keyframes, b.keyframes));
  EXPECT_EQ(a.points, b.points);
  ASSERT_EQ(a.lines.size(), b.lines.size());
  for (std::size_t i = 0; i < a.lines.size(); ++i) {
    EXPECT_EQ(a.lines[i].first, b.lines[i].first);
    EXPECT_EQ(a.lines[i].second, b.lines[i].second);
  }
  EXPECT_EQ(a.landmarks, b.landmarks);
  EXPECT_GE(a.bundles, 2) << "else nothing was done beside the tracker";
}

TEST(Slam, SameBytesWhileOthersKeepTheMachineBusy) {
  const Recording& recording = Recording::get();
  SlamOptions options;
  options.bundle_lag = 6;
  const SlamRun quiet = run(recording.shots, 2, options);
  std::atomic<bool> stop{false};
  std::vector<std::thread> others;
  for (int i = 0; i < 4; ++i) {
    others.emplace_back([&] {
      volatile double x = 1.0;
      while (!stop) x = x * 1.0000001;
    });
  }
  const SlamRun busy = run(recording.shots, 2, options);
  stop = true;
  for (std::thread& other : others) other.join();
  EXPECT_TRUE(same_bytes(quiet.trajectory, busy.trajectory));
  EXPECT_EQ(quiet.landmarks, busy.landmarks);
}

TEST(Slam, ALaterPutBackIsAsGoodAsOneOnTheSpot) {
  const Recording& recording = Recording::get();
  SlamOptions options;
  for (const int lag : {0, 3, 12}) {
    options.bundle_lag = lag;
    const SlamRun result = run(recording.shots, 1, options);
    EXPECT_EQ(result.count(TrackState::kTracked), 36) << lag;
    EXPECT_LT(ate(result.trajectory, recording.truth), 0.005) << lag;
  }
}

TEST(Slam, EveryFrameKnowsItsStepAndEveryKeyframeItsWay) {
  const core::Executor executor(1);
  const auto log = core::null_log();
  Slam slam({}, Recording::get().camera, 0, executor, *log);
  for (const Shot& shot : Recording::get().shots) slam.process(shot.frame, shot.features);
  slam.finish();
  const std::vector<maps::FramePose>& frames = slam.frame_poses();
  ASSERT_EQ(frames.size(), 36U);
  EXPECT_FALSE(frames.front().camera_from_previous);
  for (std::size_t i = 1; i < frames.size(); ++i) ASSERT_TRUE(frames[i].camera_from_previous) << i;
  const std::vector<core::KeyframeId> ids = slam.map().keyframe_ids();
  ASSERT_GE(ids.size(), 2U);
  EXPECT_FALSE(slam.map().keyframe(ids[0]).reference.valid());
  for (std::size_t i = 1; i < ids.size(); ++i)
    EXPECT_TRUE(slam.map().keyframe(ids[i]).reference.valid()) << i;
  EXPECT_EQ(slam.connections().refused(), 0);
  const maps::PathCheck check = maps::check_path(frames, slam.map());
  EXPECT_TRUE(check.tears.empty());
  EXPECT_GT(check.largest_m, 0.0) << "bundles do move keyframes";
}

TEST(Slam, BlackBlindAndRepeatedFramesAreSurvived) {
  const Recording& recording = Recording::get();
  std::vector<Shot> shots = recording.shots;
  shots.resize(28);
  shots[8] = blackened(shots[8]);
  shots[14] = without_depth(shots[14]);
  const Shot repeated = shots[20];
  shots.insert(shots.begin() + 21, repeated);  // the same picture with the same stamp
  const SlamRun result = run(shots);
  EXPECT_EQ(result.reports[8].state, TrackState::kLost) << "nothing to be seen is nothing to be trusted";
  EXPECT_EQ(result.reports[8].loss, tracking::Loss::kFewAgree);
  EXPECT_EQ(result.reports[9].state, TrackState::kTracked);
  EXPECT_EQ(result.reports[9].loss, tracking::Loss::kNone);
  EXPECT_EQ(result.reports[14].state, TrackState::kTracked) << "points and lines suffice for a frame";
  EXPECT_EQ(result.reports[21].state, TrackState::kTracked);
  EXPECT_EQ(result.count(TrackState::kTracked), 28);
  EXPECT_EQ(result.trajectory.size(), 28U) << "only tracked frames have a pose";
  EXPECT_LT(ate(result.trajectory, recording.truth), 0.005);
}

TEST(Slam, ABlackStartWaitsForTheFirstPicture) {
  const Recording& recording = Recording::get();
  std::vector<Shot> shots(recording.shots.begin(), recording.shots.begin() + 16);
  for (std::size_t i = 0; i < 4; ++i) shots[i] = blackened(shots[i]);
  const SlamRun result = run(shots);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NE(result.reports[i].state, TrackState::kTracked) << i;
  for (std::size_t i = 4; i < 16; ++i) EXPECT_EQ(result.reports[i].state, TrackState::kTracked) << i;
  EXPECT_EQ(result.trajectory.size(), 12U);
  EXPECT_LT(ate(result.trajectory, recording.truth), 0.005);
}

/// Filmed up to frame 30, covered, then carried back to where frames 2-7 were filmed.
struct CarriedBack {
  std::vector<Shot> shots;
  geometry::Trajectory truth;
  CarriedBack() {
    const Recording& recording = Recording::get();
    shots.assign(recording.shots.begin(), recording.shots.begin() + 30);
    truth.assign(recording.truth.begin(), recording.truth.begin() + 30);
    step_ = shots[1].frame.stamp - shots[0].frame.stamp;
    const Shot black = blackened(shots[0]);
    for (int i = 0; i < 12; ++i) append(black, recording.truth[29].world_from_camera);
    for (std::size_t i = 2; i < 8; ++i) append(recording.shots[i], recording.truth[i].world_from_camera);
  }

 private:
  void append(Shot shot, const geometry::Rigid3& pose) {
    shot.frame.stamp = shots.back().frame.stamp + step_;
    shot.frame.depth_stamp = shot.frame.stamp;
    truth.push_back({shot.frame.stamp, pose});
    shots.push_back(std::move(shot));
  }
  double step_ = 0.0;
};

TEST(Slam, LostWhileCoveredAndFoundAgainAtAKnownPlace) {
  const CarriedBack world;
  for (const bool loops : {false, true}) {  // with them the places are asked, and must confirm what is found
    SlamOptions options;
    options.loops.enabled = loops;
    const SlamRun result = run(world.shots, 1, options);
    for (std::size_t i = 0; i < 30; ++i) EXPECT_EQ(result.reports[i].state, TrackState::kTracked) << i;
    const std::size_t believed = loops ? 46 : 42;  // on probation until then
    for (std::size_t i = 30; i < believed; ++i) EXPECT_EQ(result.reports[i].state, TrackState::kLost) << i;
    for (std::size_t i = 42; i < believed; ++i)
      EXPECT_EQ(result.reports[i].loss, tracking::Loss::kUnconfirmed) << i;
    for (std::size_t i = believed; i < 48; ++i) EXPECT_EQ(result.reports[i].state, TrackState::kTracked) << i;
    EXPECT_TRUE(result.reports[believed].relocalised)
        << "carried back while covered: only the picture can tell";
    EXPECT_EQ(result.trajectory.size(), loops ? 32U : 36U);
    EXPECT_LT(ate(result.trajectory, world.truth), 0.005);
  }
}

TEST(Slam, FoundFarAwayIsNotBelievedWithoutVerification) {
  const CarriedBack world;
  const Eigen::Vector3d carried =
      world.truth[45].world_from_camera.translation - world.truth[29].world_from_camera.translation;
  SlamOptions options;
  options.loops.enabled = true;
  options.loops.verify.min_inliers = 10000;  // nothing passes
  const SlamRun result = run(world.shots, 1, options);
  ASSERT_GT(carried.norm(), 0.6) << "near by, nothing has to pass";
  EXPECT_FALSE(result.reports[45].relocalised);

  std::size_t begins = 42;  // the first frame that shows something again
  while (begins < 46 && !result.reports[begins].keyframe.valid()) ++begins;
  ASSERT_LT(begins, 46U) << "half a second after it was lost it begins a second component";
  EXPECT_EQ(result.reports[begins].component, result.reports[begins].keyframe);
  EXPECT_NE(result.reports[begins].component, result.reports[29].component);
}

TEST(Slam, NothingButBlackFramesGiveNoTrajectory) {
  std::vector<Shot> shots(5, blackened(Recording::get().shots[0]));
  for (std::size_t i = 0; i < shots.size(); ++i) shots[i].frame.stamp += 0.1 * static_cast<double>(i);
  const SlamRun result = run(shots);
  EXPECT_EQ(result.count(TrackState::kTracked), 0);
  EXPECT_TRUE(result.trajectory.empty());
  EXPECT_TRUE(result.keyframes.empty());
}

TEST(Slam, EachFamilyAloneTracksTheFurnishedRoom) {
  const Recording& recording = Recording::get();
  const std::vector<Shot> shots(recording.shots.begin(), recording.shots.begin() + 20);
  for (const bool depth : {false, true}) {
    SlamOptions options;
    options.tracker.points = !depth;
    options.tracker.lines = !depth;
    options.tracker.depth = depth;
    const SlamRun result = run(shots, 1, options);
    EXPECT_EQ(result.count(TrackState::kTracked), 20) << (depth ? "depth" : "points and lines");
    EXPECT_LT(ate(result.trajectory, recording.truth), depth ? 0.01 : 0.005)
        << (depth ? "depth" : "points and lines");
  }
}

TEST(Slam, GoesOnWhereAnotherOneStopped) {
  const Recording& recording = Recording::get();
  const SlamRun whole = run(recording.shots);
  const core::Executor executor(1);
  const auto log = core::null_log();
  Slam first({}, recording.camera, 0, executor, *log);
  std::size_t next = 0;
  int keyframes = 0;
  while (next < recording.shots.size() && keyframes < 2) {
    const Shot& shot = recording.shots[next++];
    keyframes += first.process(shot.frame, shot.features).keyframe.valid() ? 1 : 0;
  }
  ASSERT_LT(next, recording.shots.size() - 8) << "nothing is left to go on with";
  Slam second({}, recording.camera, 0, executor, *log);
  second.restore(first.map(), first.frame_poses());
  EXPECT_EQ(second.map().keyframe_count(), first.map().keyframe_count());
  for (std::size_t i = next; i < recording.shots.size(); ++i) {
    const FrameReport report = second.process(recording.shots[i].frame, recording.shots[i].features);
    ASSERT_EQ(report.state, TrackState::kTracked) << i;
    EXPECT_FALSE(report.relocalised) << i;
    if (report.keyframe.valid()) ++keyframes;
  }
  second.finish();
  const geometry::Trajectory trajectory = maps::trajectory(second.frame_poses(), second.map());
  ASSERT_EQ(trajectory.size(), whole.trajectory.size());
  EXPECT_LT(ate(trajectory, recording.truth), 0.005);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_EQ(trajectory[i].stamp, whole.trajectory[i].stamp);
    EXPECT_LT(
        (trajectory[i].world_from_camera.translation - whole.trajectory[i].world_from_camera.translation)
            .norm(),
        0.003)
        << i;
  }
  EXPECT_GT(keyframes, 2) << "no keyframe was made after";
}

TEST(Slam, AMapWithoutKeyframesIsNothingToGoOnFrom) {
  const Recording& recording = Recording::get();
  const core::Executor executor(1);
  const auto log = core::null_log();
  Slam slam({}, recording.camera, 0, executor, *log);
  slam.restore({}, {});
  const Shot& shot = recording.shots.front();
  EXPECT_EQ(slam.process(shot.frame, shot.features).keyframe.index, 0);
}

}  // namespace
}  // namespace plumbline::mapping
