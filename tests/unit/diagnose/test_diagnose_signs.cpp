// SPDX-License-Identifier: BSD-3-Clause
// A generated home, spoilt as people spoil recordings: each mistake is named, and nothing is where nothing is
// wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "plumbline/diagnose/signs.hpp"
#include "plumbline/geometry/pose_convention.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::diagnose {
namespace {

using geometry::PoseConvention;
using sensor::RgbdFrame;

/// Eight seconds through a home made from a number, seen by a Kinect.
struct Film {
  sensor::Pinhole camera;
  std::vector<RgbdFrame> frames;
  geometry::Trajectory poses;
};

const Film& film() {
  static const Film filmed = [] {
    const core::Executor executor(2);
    const auto source = synth::open_synth("synth:home?layout=7&frames=80&fps=10&width=320&height=240",
                                          std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes", executor,
                                          *core::null_log());
    if (!source) throw std::runtime_error(source.error().message);
    Film film;
    film.camera = (*source)->camera().color;
    film.poses = *(*source)->truth();
    for (std::size_t i = 0; i < (*source)->size(); ++i) film.frames.push_back(*(*source)->read(i));
    return film;
  }();
  return filmed;
}

using Spoil = std::function<void(std::vector<RgbdFrame>&)>;

void add_spoilt(Samples& samples, const Spoil& spoil) {
  std::vector<RgbdFrame> frames = film().frames;
  for (RgbdFrame& frame : frames) {
    frame.gray = frame.gray.clone();
    frame.depth = frame.depth.clone();
  }
  spoil(frames);
  for (const RgbdFrame& frame : frames) samples.add(frame);
}

/// Names of the signs that are certain or likely.
std::string found(const Spoil& spoil) {
  Samples samples(film().camera, film().frames.size());
  add_spoilt(samples, spoil);
  std::string names;
  for (const Sign& sign : signs_of(samples)) {
    if (sign.certainty == Certainty::kNone) continue;
    names += sign.name + " ";
    EXPECT_NE(sign.text, "");
    EXPECT_NE(sign.remedy, "");
    EXPECT_EQ(sign.certainty == Certainty::kCertain, sign.strength >= 1.0);
  }
  return names;
}

void nothing(std::vector<RgbdFrame>& /*frames*/) {}

TEST(Signs, NothingIsFoundInARightRecording) { EXPECT_EQ(found(nothing), ""); }

TEST(Signs, RayDistanceIsNamed) {
  EXPECT_EQ(found([](std::vector<RgbdFrame>& frames) {
              const sensor::Pinhole& c = film().camera;
              for (RgbdFrame& frame : frames) {
                for (int v = 0; v < frame.depth.rows; ++v) {
                  for (int u = 0; u < frame.depth.cols; ++u)
                    frame.depth.at<float>(v, u) *=
                        static_cast<float>(std::hypot((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1.0));
                }
              }
            }),
            "ray_distance ");
}

TEST(Signs, DepthOfAnotherLensIsNamedWithItsFocalLength) {
  Samples samples(film().camera, film().frames.size());
  add_spoilt(samples, [](std::vector<RgbdFrame>& frames) {
    const cv::Matx23d smaller(0.75, 0.0, 0.125 * 320 + 3.0, 0.0, 0.75, 0.125 * 240);
    for (RgbdFrame& frame : frames)
      cv::warpAffine(frame.depth.clone(), frame.depth, smaller, frame.depth.size(), cv::INTER_NEAREST);
  });
  const Sign sign = registration_sign(samples);
  EXPECT_EQ(sign.certainty, Certainty::kCertain) << sign.strength << sign.text;
  EXPECT_GT(sign.size, 15.0);
  const double told = std::stod(sign.remedy.substr(sign.remedy.find("about ") + 6));
  EXPECT_NEAR(told, 0.75 * film().camera.fx, 0.08 * film().camera.fx) << sign.remedy;
}

TEST(Signs, DotsThatStayAreNamed) {
  EXPECT_EQ(
      found([](std::vector<RgbdFrame>& frames) {
        for (RgbdFrame& frame : frames) {
          for (int k = 0; k < 700; ++k)
            cv::rectangle(frame.gray, {(k * 97) % 316, (k * 61) % 236, 2, 2}, cv::Scalar(255), cv::FILLED);
        }
      }),
      "fixed_pattern ");
}

TEST(Signs, ATimeStampIsNone) {
  EXPECT_EQ(found([](std::vector<RgbdFrame>& frames) {
              for (RgbdFrame& frame : frames)
                cv::putText(frame.gray, "2026-11-28", {4, 20}, cv::FONT_HERSHEY_PLAIN, 1.0, cv::Scalar(255));
            }),
            "");
}

TEST(Signs, DepthThatFallsBehindIsNamed) {
  const std::string names = found([](std::vector<RgbdFrame>& frames) {
    const std::vector<RgbdFrame> right = frames;
    for (std::size_t i = 0; i < frames.size(); ++i) frames[i].depth = right[i - i * 8 / frames.size()].depth;
  });
  EXPECT_NE(names.find("depth_lags"), std::string::npos) << names;
}

TEST(Signs, DepthThatIsLateIsNamedWithItsDelay) {
  Samples samples(film().camera, film().frames.size());
  add_spoilt(samples, [](std::vector<RgbdFrame>& frames) {
    for (std::size_t i = frames.size() - 1; i >= 2; --i) frames[i].depth = frames[i - 2].depth;
  });
  const std::vector<Sign> signs = lag_signs(samples);
  EXPECT_EQ(signs[0].certainty, Certainty::kNone);
  EXPECT_EQ(signs[1].certainty, Certainty::kCertain) << signs[1].strength;
  EXPECT_NEAR(signs[1].size, 0.2, 0.031);
}

TEST(Signs, DisparityIsNamed) {
  EXPECT_NE(found([](std::vector<RgbdFrame>& frames) {
              for (RgbdFrame& frame : frames) {
                for (int v = 0; v < frame.depth.rows; ++v) {
                  for (int u = 0; u < frame.depth.cols; ++u) {
                    float& z = frame.depth.at<float>(v, u);
                    if (z > 0.0F) z = 4.0F / z;
                  }
                }
              }
            }).find("disparity"),
            std::string::npos);
}

TEST(Signs, ACameraThatStandsStillIsSeenAndNotBlamed) {
  const auto still = [](std::vector<RgbdFrame>& frames) {
    for (RgbdFrame& frame : frames) {
      frame.gray = frames.front().gray.clone();
      frame.depth = frames.front().depth.clone();
      for (int k = 0; k < 900; ++k) frame.gray.at<unsigned char>((k * 13) % 240, (k * 29) % 320) ^= 2U;
    }
  };
  EXPECT_EQ(found(still), "");
  Samples samples(film().camera, film().frames.size());
  add_spoilt(samples, still);
  EXPECT_TRUE(stood_still(samples));
  Samples moving(film().camera, film().frames.size());
  add_spoilt(moving, nothing);
  EXPECT_FALSE(stood_still(moving));
}

TEST(Signs, OrderDoesNotMatterAndFewFramesSayNothing) {
  Samples forth(film().camera, film().frames.size()), back(film().camera, film().frames.size());
  std::vector<RgbdFrame> frames = film().frames;
  for (const RgbdFrame& frame : frames) forth.add(frame);
  std::reverse(frames.begin(), frames.end());
  for (const RgbdFrame& frame : frames) back.add(frame);
  const std::vector<Sign> a = signs_of(forth), b = signs_of(back);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_EQ(a[k].strength, b[k].strength) << a[k].name;

  Samples two(film().camera, 2), none(film().camera, 0);
  two.add(film().frames[0]);
  two.add(film().frames[1]);
  for (const Samples* few : {&two, &none}) {
    for (const Sign& sign : signs_of(*few)) EXPECT_EQ(sign.certainty, Certainty::kNone) << sign.name;
    EXPECT_FALSE(stood_still(*few));
    EXPECT_EQ(pose_sign(*few, film().poses).certainty, Certainty::kNone);
  }
}

/// What is said of poses that are not as told.
Sign of_poses(const std::function<geometry::StampedPose(const geometry::StampedPose&)>& change) {
  static Samples* samples = [] {
    auto* all = new Samples(film().camera, film().frames.size());
    add_spoilt(*all, nothing);
    return all;
  }();
  geometry::Trajectory poses;
  for (const geometry::StampedPose& pose : film().poses) poses.push_back(change(pose));
  return pose_sign(*samples, poses);
}

TEST(PoseSigns, ConventionsAreNamedWithTheOptionThatReadsThem) {
  EXPECT_EQ(of_poses([](const auto& pose) { return pose; }).certainty, Certainty::kNone);
  const auto gl = [](const auto& pose) {
    return geometry::StampedPose{pose.stamp,
                                 geometry::read_by(PoseConvention::kOpenGl, pose.world_from_camera)};
  };
  const auto inverted = [](const auto& pose) {
    return geometry::StampedPose{pose.stamp, pose.world_from_camera.inverse()};
  };
  const auto w_first = [](const auto& pose) {
    const Eigen::Quaterniond q = pose.world_from_camera.quaternion();
    return geometry::StampedPose{
        pose.stamp, {Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), pose.world_from_camera.translation}};
  };
  EXPECT_EQ(of_poses(gl).remedy, "--poses-are opengl");
  EXPECT_EQ(of_poses(inverted).remedy, "--poses-are inverted");
  EXPECT_EQ(of_poses(w_first).remedy, "--poses-are wxyz");

  const Sign units = of_poses([](const auto& pose) {
    return geometry::StampedPose{
        pose.stamp, {pose.world_from_camera.rotation, 1000.0 * pose.world_from_camera.translation}};
  });
  EXPECT_EQ(units.remedy, "multiply their positions by 0.001");
  const Sign late = of_poses([](const auto& pose) {
    return geometry::StampedPose{pose.stamp + 0.5, pose.world_from_camera};
  });
  EXPECT_EQ(late.name, "poses_time") << late.strength;
}

TEST(PoseSigns, ReadingUndoesWriting) {
  const geometry::Rigid3 pose(Eigen::Quaterniond(0.5, 0.1, -0.7, 0.3), {1.0, 2.0, 3.0});
  for (const auto& [name, convention] : geometry::pose_conventions()) {
    if (convention == PoseConvention::kWFirst) continue;
    const geometry::Rigid3 twice = geometry::read_by(convention, geometry::read_by(convention, pose));
    EXPECT_LT((twice.inverse() * pose).isometry().matrix().operator-(Eigen::Matrix4d::Identity()).norm(),
              1e-12)
        << name;
  }
}

}  // namespace
}  // namespace plumbline::diagnose
