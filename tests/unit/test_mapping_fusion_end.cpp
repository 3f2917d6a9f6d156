// SPDX-License-Identifier: BSD-3-Clause
// What robots tell a fusion end, and when it knows that two maps overlap.
#include <gtest/gtest.h>

#include <algorithm>

#include "plumbline/mapping/fusion_end.hpp"
#include "poster_view.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using tests::kTestCamera;

const Rigid3 kWorldOfOthers(geometry::exp_so3({0.2, -0.4, 0.3}), {2.0, -1.0, 0.5});

maps::Map wall_map(unsigned poster, int views, double from_m, const Rigid3& world_from_truth) {
  maps::Map map;
  const cv::Mat wall = tests::poster(1400, poster);
  for (int i = 0; i < views; ++i) {
    const Rigid3 pose(geometry::exp_so3({0.0, 0.02 * i, 0.01 * i}), {from_m + 0.09 * i, 0.02 * i, 0.01 * i});
    tests::add_view(map, wall, pose, pose * world_from_truth.inverse(), 1.0 + i);
  }
  return map;
}

/// A keyframe with `points` points and `lines` lines that nothing can be saved on.
maps::KeyframeMessage full_message(int points, int lines) {
  std::uint64_t state = 7;
  const auto random = [&] {
    return (state = state * 6364136223846793005ULL + 1442695040888963407ULL) >> 33U;
  };
  const auto share = [&] { return static_cast<float>(random() % 10000) / 10000.0F; };
  auto features = std::make_shared<features::FrameFeatures>();
  for (int i = 0; i < points; ++i) {
    features::PointFeature p;
    p.pixel = {639.0F * share(), 479.0F * share()};
    p.depth = 0.5F + 4.0F * share();
    p.angle = 359.0F * share();
    p.octave = static_cast<int>(random() % 8);
    features->points.push_back(p);
    features->descriptors.push_back({random() << 32U | random(), random() << 32U | random(),
                                     random() << 32U | random(), random() << 32U | random()});
  }
  for (int i = 0; i < lines; ++i) {
    features::LineFeature l;
    l.segment.start = {639.0F * share(), 479.0F * share()};
    l.segment.end = {639.0F * share(), 479.0F * share()};
    l.descriptor = {random() << 32U | random(), random() << 32U, random() << 32U | random(), random() << 32U};
    features::Line3 line3;
    line3.start = kTestCamera.unproject(double{l.segment.start.x()}, double{l.segment.start.y()},
                                        1.0 + double{share()});
    line3.end =
        kTestCamera.unproject(double{l.segment.end.x()}, double{l.segment.end.y()}, 1.0 + double{share()});
    l.line3 = line3;
    features->lines.push_back(l);
  }
  features->thumbnail_depth.create(60, 80, CV_32FC1);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x)
      features->thumbnail_depth.at<float>(y, x) = 2.0F + 0.02F * static_cast<float>(y) + 0.01F * share();
  }
  auto keyframe = std::make_shared<maps::Keyframe>();
  keyframe->id = {0, 0};
  keyframe->features = features;
  for (int i = 0; i < 300; ++i) {
    keyframe->surface.push_back(
        {{2.0F * share() - 1.0F, share(), 3.0F * share()}, {0.0F, 0.6F, -0.8F}, 0.01F});
  }
  maps::Map map;
  map.add_keyframe(keyframe, Rigid3{});
  maps::KeyframeMessage message = maps::make_message(map, {0, 0}, kTestCamera);
  for (std::size_t i = 0; i < message.points.size(); i += 2)
    message.points[i] = static_cast<int>(random() % 20000);
  for (std::size_t i = 0; i < message.lines.size(); i += 3)
    message.lines[i] = static_cast<int>(random() % 2000);
  return message;
}

TEST(KeyframeMessage, ComesBackNearlyAsItWas) {
  const maps::KeyframeMessage sent = full_message(50, 20);
  const auto bytes = maps::encode_message(sent);
  EXPECT_EQ(bytes, maps::encode_message(sent));
  const auto back = maps::decode_message(bytes);
  ASSERT_TRUE(back.has_value()) << back.error().message;
  const features::FrameFeatures& a = *sent.keyframe->features;
  const features::FrameFeatures& b = *back->keyframe->features;
  ASSERT_EQ(b.points.size(), 50U);
  for (std::size_t i = 0; i < 50; ++i) {  // they come in another order
    const auto found = std::find(b.descriptors.begin(), b.descriptors.end(), a.descriptors[i]);
    ASSERT_NE(found, b.descriptors.end());
    const auto j = static_cast<std::size_t>(found - b.descriptors.begin());
    EXPECT_LT((a.points[i].pixel - b.points[j].pixel).norm(), 0.2F);
    EXPECT_NEAR(a.points[i].depth, b.points[j].depth, 0.0006F);
    EXPECT_EQ(a.points[i].octave, b.points[j].octave);
    EXPECT_EQ(sent.points[i], back->points[j]);
  }
  ASSERT_EQ(b.lines.size(), 20U);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(a.lines[i].descriptor, b.lines[i].descriptor);
    EXPECT_LT((a.lines[i].segment.start - b.lines[i].segment.start).norm(), 0.2F);
    EXPECT_LT((a.lines[i].segment.end - b.lines[i].segment.end).norm(), 0.2F);
    EXPECT_LT((a.lines[i].line3->start - b.lines[i].line3->start).norm(), 0.005);
    EXPECT_LT((a.lines[i].line3->end - b.lines[i].line3->end).norm(), 0.005);
  }
  EXPECT_EQ(sent.lines, back->lines);
  ASSERT_EQ(b.thumbnail_depth.cols, 80);
  EXPECT_NEAR(a.thumbnail_depth.at<float>(30, 40), b.thumbnail_depth.at<float>(30, 40), 0.011F);
  ASSERT_EQ(back->keyframe->surface.size(), 100U);
  EXPECT_LT((sent.keyframe->surface[12].point - back->keyframe->surface[4].point).norm(), 0.001F);
  ASSERT_EQ(back->moved.size(), 0U);
}

TEST(KeyframeMessage, LinesWithoutDepthAndNothingAtAll) {
  maps::KeyframeMessage sent = full_message(0, 9);
  auto features = std::make_shared<features::FrameFeatures>(*sent.keyframe->features);
  for (std::size_t i = 1; i < features->lines.size(); i += 2) features->lines[i].line3.reset();
  auto keyframe = std::make_shared<maps::Keyframe>(*sent.keyframe);
  keyframe->features = features;
  sent.keyframe = keyframe;
  const auto back = maps::decode_message(maps::encode_message(sent));
  ASSERT_TRUE(back.has_value()) << back.error().message;
  EXPECT_TRUE(back->keyframe->features->points.empty());
  const auto& lines = back->keyframe->features->lines;
  ASSERT_EQ(lines.size(), 9U);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(lines[i].line3.has_value(), i % 2 == 0);
  EXPECT_EQ(back->lines, sent.lines);
  const auto empty = maps::decode_message(maps::encode_message(full_message(0, 0)));
  ASSERT_TRUE(empty.has_value()) << empty.error().message;
  EXPECT_TRUE(empty->points.empty() && empty->lines.empty());
}

TEST(KeyframeMessage, ThousandPointsFitInFiftyKilobytes) {
  const std::size_t bytes = maps::encode_message(full_message(1000, 160)).size();
  EXPECT_LE(bytes, 50000U);
  EXPECT_GE(bytes, 32000U);  // the descriptors alone, which are noise here
}

TEST(KeyframeMessage, DamagedBytesAreRefused) {
  auto bytes = maps::encode_message(full_message(20, 5));
  EXPECT_FALSE(maps::decode_message({}).has_value());
  for (std::size_t at = 0; at < bytes.size(); at += 97) {
    auto damaged = bytes;
    damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ 0x5aU);
    const auto back = maps::decode_message(damaged);
    if (!back) {
      EXPECT_NE(back.error().message.find("message"), std::string::npos);
    }
  }
  bytes.resize(bytes.size() / 2);
  EXPECT_FALSE(maps::decode_message(bytes).has_value());
}

TEST(FusionEnd, TellsOnceThatTwoRobotsHaveMet) {
  const maps::Map a = wall_map(5, 8, -0.35, Rigid3{});
  const maps::Map b = renumbered(wall_map(5, 8, -0.3, kWorldOfOthers), {{0, 1}});
  const core::Executor executor(1);
  FusionEnd end({}, 2, executor);
  std::vector<MergeEvidence> merges;
  for (int i = 0; i < 8; ++i) {
    for (const maps::Map* map : {&a, &b}) {
      const KeyframeId id{map->keyframe_ids().front().robot, i};
      const auto told = end.receive(maps::encode_message(maps::make_message(*map, id, kTestCamera)));
      ASSERT_TRUE(told.has_value()) << told.error().message;
      merges.insert(merges.end(), told->begin(), told->end());
    }
  }
  ASSERT_EQ(merges.size(), 1U);
  EXPECT_LT(tests::distance(merges[0].a_from_b, kWorldOfOthers.inverse()), 0.04);
  EXPECT_EQ(end.traffic(0).messages, 8U);
  EXPECT_GT(end.traffic(1).bytes, end.traffic(1).most);
  EXPECT_EQ(end.map(1).keyframe_count(), 8U);
  const auto twice = end.receive(maps::encode_message(maps::make_message(a, {0, 0}, kTestCamera)));
  EXPECT_FALSE(twice.has_value());
  const maps::Map stranger = renumbered(a, {{0, 5}});
  EXPECT_FALSE(
      end.receive(maps::encode_message(maps::make_message(stranger, {5, 0}, kTestCamera))).has_value());
}

TEST(FusionEnd, RobotsInDifferentPlacesStayApart) {
  const maps::Map a = wall_map(5, 6, -0.3, Rigid3{});
  const maps::Map b = renumbered(wall_map(99, 6, -0.3, kWorldOfOthers), {{0, 1}});
  const core::Executor executor(1);
  FusionEnd end({}, 2, executor);
  for (int i = 0; i < 6; ++i) {
    for (const maps::Map* map : {&a, &b}) {
      const KeyframeId id{map->keyframe_ids().front().robot, i};
      const auto told = end.receive(maps::encode_message(maps::make_message(*map, id, kTestCamera)));
      ASSERT_TRUE(told.has_value());
      EXPECT_TRUE(told->empty());
    }
  }
}

}  // namespace
}  // namespace plumbline::mapping
