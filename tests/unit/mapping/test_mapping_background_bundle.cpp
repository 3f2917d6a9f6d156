// SPDX-License-Identifier: BSD-3-Clause
// Bundles beside the tracker: what comes out goes by frame numbers, never by the clock.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include "plumbline/mapping/adjustment/background_bundle.hpp"
#include "random_world.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

const sensor::Pinhole kBundleCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

/// A camera that passes a cloud of points; keyframes come one by one, each a little askew.
class GrowingMap {
 public:
  GrowingMap() {
    for (int i = 0; i < 80; ++i) {
      points_.emplace_back(random_.uniform(-0.8, 1.2), random_.uniform(-0.6, 0.6), random_.uniform(1.5, 3.0));
    }
    for (const Eigen::Vector3d& p : points_) {
      maps::MapPoint point;
      point.position = p + random_.vector(0.01);
      map.add_point(0, point);
    }
  }
  KeyframeId add_keyframe() {
    const KeyframeId id = map.next_keyframe_id(0);
    const Rigid3 truth(Eigen::Matrix3d::Identity(), Eigen::Vector3d(-0.05 * id.index, 0.0, 0.0));
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = id;
    auto features = std::make_shared<features::FrameFeatures>();
    for (const Eigen::Vector3d& p : points_) {
      const Eigen::Vector3d c = truth * p;
      features::PointFeature f;
      f.pixel = kBundleCamera.project(c).cast<float>();
      f.depth = static_cast<float>(c.z());
      features->points.push_back(f);
    }
    features->descriptors.resize(features->points.size());
    keyframe->features = features;
    map.add_keyframe(keyframe, id.index == 0 ? truth : random_.step(0.01, 0.005) * truth);
    for (std::size_t i = 0; i < points_.size(); ++i)
      map.observe(core::PointId{0, static_cast<std::int32_t>(i)}, id, static_cast<int>(i));
    if (id.index > 0) map.set_parent(id, {0, id.index - 1});
    return id;
  }
  maps::Map map;

 private:
  tests::Random random_{5};
  std::vector<Eigen::Vector3d> points_;
};

std::vector<double> numbers_of(const maps::Map& map) {
  std::vector<double> numbers;
  for (KeyframeId id : map.keyframe_ids()) {
    const Rigid3& pose = map.camera_from_world(id);
    numbers.insert(numbers.end(), pose.rotation.data(), pose.rotation.data() + 9);
    numbers.insert(numbers.end(), pose.translation.data(), pose.translation.data() + 3);
  }
  for (core::PointId id : map.point_ids()) {
    const maps::MapPoint& point = map.point(id);
    numbers.insert(numbers.end(), point.position.data(), point.position.data() + 3);
    numbers.push_back(static_cast<double>(point.observations.size()));
  }
  return numbers;
}

struct Outcome {
  std::vector<double> numbers;
  std::vector<KeyframeId> committed;  ///< by frame
};

/// A keyframe every other frame; 30 frames.
Outcome run(int threads, int lag) {
  const core::Executor executor(threads);
  GrowingMap world;
  const auto log = core::null_log();
  BackgroundBundle bundle({}, {}, lag, kBundleCamera, executor, *log);
  world.add_keyframe();
  Outcome outcome;
  const auto commit = [&](int frame) {
    BundleReport report;
    bundle.commit(world.map, frame, report);
    EXPECT_TRUE(report.summary.usable) << report.summary.message;
    return report.keyframe;
  };
  for (int frame = 1; frame <= 30; ++frame) {
    KeyframeId committed;
    if (bundle.due(frame)) committed = commit(frame);
    if (frame % 2 == 0) {
      bundle.request(world.map, world.add_keyframe(), frame);
      if (bundle.due(frame)) committed = commit(frame);
    }
    outcome.committed.push_back(committed);
  }
  while (!bundle.idle()) commit(31);
  outcome.numbers = numbers_of(world.map);
  return outcome;
}

TEST(BackgroundBundle, PutBackAtItsFrameAndTheNewestThatWaitedIsNext) {
  const Outcome outcome = run(1, 5);
  std::vector<int> frames;
  std::vector<int> keyframes;
  for (std::size_t i = 0; i < outcome.committed.size(); ++i) {
    if (!outcome.committed[i].valid()) continue;
    frames.push_back(static_cast<int>(i) + 1);
    keyframes.push_back(outcome.committed[i].index);
  }
  // Keyframe k is made at frame 2 k. The first bundle is taken at 2, the others at once when one is put back.
  EXPECT_EQ(frames, (std::vector<int>{7, 12, 17, 22, 27}));
  EXPECT_EQ(keyframes, (std::vector<int>{1, 3, 5, 8, 10}));
}

TEST(BackgroundBundle, WithoutALagItIsDoneOnTheSpot) {
  const Outcome outcome = run(2, 0);
  for (int frame = 1; frame <= 30; ++frame) {
    EXPECT_EQ(outcome.committed[static_cast<std::size_t>(frame - 1)].index, frame % 2 == 0 ? frame / 2 : -1);
  }
}

TEST(BackgroundBundle, SameBytesForAnyNumberOfThreadsAndUnderLoad) {
  const Outcome one = run(1, 4);
  std::atomic<bool> stop{false};
  std::vector<std::thread> load;  // another process' work, as far as the scheduler is concerned
  for (int round = 0; round < 3; ++round) {
    if (round == 1) {
      for (int i = 0; i < 4; ++i) {
        load.emplace_back([&] {
          volatile double x = 1.0;
          while (!stop) x = x * 1.0000001;
        });
      }
    }
    const Outcome other = run(round == 0 ? 2 : 3, 4);
    EXPECT_EQ(other.committed, one.committed);
    ASSERT_EQ(other.numbers.size(), one.numbers.size());
    EXPECT_EQ(std::memcmp(other.numbers.data(), one.numbers.data(), one.numbers.size() * sizeof(double)), 0);
  }
  stop = true;
  for (std::thread& thread : load) thread.join();
}

TEST(BackgroundBundle, ALagChangesTheMapLittle) {
  const Outcome at_once = run(1, 0);
  const Outcome later = run(1, 5);
  ASSERT_EQ(at_once.numbers.size(), later.numbers.size());
  for (std::size_t i = 0; i < 12 * 16; ++i) {  // poses; which observations were put aside may differ
    EXPECT_NEAR(at_once.numbers[i], later.numbers[i], 5e-3);
  }
}

TEST(BackgroundBundle, AnEndWithoutCommitWaitsForTheWork) {
  const core::Executor executor(2);
  GrowingMap world;
  world.add_keyframe();
  const auto log = core::null_log();
  BackgroundBundle bundle({}, {}, 3, kBundleCamera, executor, *log);
  bundle.request(world.map, world.add_keyframe(), 1);
  EXPECT_FALSE(bundle.due(3));
  EXPECT_TRUE(bundle.due(4));
}

}  // namespace
}  // namespace plumbline::mapping
