// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A map that grows and changes as maps do in a run, the same for the same seed, and the comparison of two
// maps bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/sensor/camera.hpp"
#include "random_world.hpp"

namespace plumbline::tests {

struct StoreWorld {
  sensor::Camera camera;
  maps::Map map;
  std::vector<maps::FramePose> frames;
  int features = 60;    ///< points of a keyframe
  int lines = 12;       ///< lines of a keyframe
  bool deletes = true;  ///< keyframes and landmarks leave now and then
  int first_robot = 0;
  int other_robot = 3;  ///< every fifth keyframe is this one's

  explicit StoreWorld(std::uint32_t seed) : random_(seed) {
    camera.name = "hand-made";
    camera.color = {640, 480, 525.0, 525.1, 319.5, 239.25};
  }

  /// One more keyframe: it sees landmarks of earlier ones and makes new ones, then what a run does to a map.
  core::KeyframeId step() {
    const int robot = ++steps_ % 5 == 0 ? other_robot : first_robot;
    const core::KeyframeId id = map.next_keyframe_id(robot);
    map.add_keyframe(make_keyframe(id), random_.pose(3.0, 5.0));
    for (const core::PointId p : map.point_ids()) {
      if (random_.integer(0, 3) == 0)
        map.observe(p, id, random_.integer(0, features - 1), random_.integer(0, 1) == 0);
    }
    for (const core::LineId l : map.line_ids()) {
      if (random_.integer(0, 3) == 0) map.observe(l, id, random_.integer(0, lines - 1));
    }
    for (int f = 0; f < features; f += 3) add_point(id, f);
    for (int f = 0; f < lines; f += 2) add_line(id, f);
    map.attach(id);
    for (int i = 0; i < 3; ++i) {
      maps::FramePose frame;
      frame.stamp = 0.033 * static_cast<double>(frames.size());
      frame.reference = id;
      frame.camera_from_reference = random_.pose(0.1, 0.1);
      frame.tracked = i != 1;
      if (i == 0) frame.camera_from_previous = random_.pose(0.1, 0.1);
      frame.step_sigma_m = i == 0 ? 0.003 : 0.0;
      frames.push_back(frame);
    }
    refine(id);
    if (deletes) thin_out();
    return id;
  }

  /// As a store gives them back.
  [[nodiscard]] std::vector<maps::FramePose> frames_by_robot() const {
    std::vector<maps::FramePose> sorted = frames;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto& a, const auto& b) { return a.reference.robot < b.reference.robot; });
    return sorted;
  }
  /// Of a frame, by its place among `frames`.
  [[nodiscard]] maps::FrameId frame_id(std::size_t place) const {
    const std::int32_t robot = frames[place].reference.robot;
    const auto before =
        std::count_if(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(place),
                      [&](const maps::FramePose& frame) { return frame.reference.robot == robot; });
    return {robot, static_cast<std::int32_t>(before)};
  }

 private:
  std::shared_ptr<const maps::Keyframe> make_keyframe(core::KeyframeId id) {
    auto f = std::make_shared<features::FrameFeatures>();
    for (int i = 0; i < features; ++i) {
      features::PointFeature p;
      p.pixel = {number(0, 639), number(0, 479)};
      p.depth = i % 4 == 0 ? 0.0F : number(0.5, 5.0);
      p.angle = number(0, 360);
      p.response = static_cast<float>(random_.integer(7, 90));
      p.octave = random_.integer(0, 7);
      f->points.push_back(p);
      f->descriptors.push_back(bits());
      f->patches.push_back(patch(p));
    }
    f->grid = features::PointGrid(f->points, camera.color.width, camera.color.height);
    for (int i = 0; i < lines; ++i) f->lines.push_back(make_line(i % 3 != 0));
    f->thumbnail = image();
    f->thumbnail_depth = image();
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = id;
    keyframe->frame_index = 3 * steps_;
    keyframe->stamp = 1305031102.175304 + 0.1 * steps_;
    keyframe->turn_rate = random_.uniform(0, 1);
    if (keyframe->id.index > 0) keyframe->reference = {keyframe->id.robot, keyframe->id.index - 1};
    keyframe->camera_from_reference = random_.pose(0.3, 0.3);
    keyframe->reference_sigma_m = random_.uniform(0.001, 0.01);
    keyframe->features = f;
    for (int i = 0; i < 20; ++i) {
      keyframe->surface.push_back(
          {random_.vector(3).cast<float>(), random_.direction().cast<float>(), number(0, 1)});
    }
    return keyframe;
  }

  features::CornerPatch patch(features::PointFeature& p) {
    features::CornerPatch made;
    for (std::uint8_t& gray : made.gray) gray = static_cast<std::uint8_t>(random_.integer(0, 255));
    made.middle = p.pixel;
    if (random_.integer(0, 1) == 0) made.offset = {number(-1, 1), number(-1, 1)};
    p.pixel += made.offset;
    return made;
  }

  features::LineFeature make_line(bool in_space) {
    features::LineFeature l;
    l.segment = {{number(0, 639), number(0, 479)}, {number(0, 639), number(0, 479)}, number(1, 50)};
    l.descriptor = bits();
    if (!in_space) return l;
    l.line3.emplace();
    l.line3->start = random_.vector(3);
    l.line3->end = random_.vector(3);
    l.line3->start_noise = {number(0, 1), number(0, 1)};
    l.line3->end_noise = {number(0, 1), number(0, 1)};
    l.line3->inlier_share = number(0, 1);
    l.line3->coverage = number(0, 1);
    return l;
  }

  void add_point(core::KeyframeId id, int feature) {
    maps::MapPoint p;
    p.position = random_.vector(5);
    p.descriptor = bits();
    p.angle = number(0, 360);
    p.angle_keyframe = id;
    p.normal = random_.integer(0, 1) == 0 ? Eigen::Vector3d::Zero().eval() : random_.direction();
    p.reference_distance = random_.uniform(1, 4);
    p.reference_octave = random_.integer(0, 7);
    p.visible = random_.integer(1, 9);
    p.found = 1;
    map.observe(map.add_point(id.robot, p), id, feature, true);
  }
  void add_line(core::KeyframeId id, int feature) {
    maps::MapLine l;
    l.start = random_.vector(5);
    l.end = random_.vector(5);
    l.descriptor = bits();
    l.visible = random_.integer(1, 9);
    map.observe(map.add_line(id.robot, l), id, feature);
  }

  /// Some poses and landmarks move, a surface edge is found, sometimes a loop is closed.
  void refine(core::KeyframeId id) {
    for (const core::KeyframeId k : map.keyframe_ids()) {
      if (random_.integer(0, 2) == 0) map.set_pose(k, random_.pose(3.0, 5.0));
    }
    const std::vector<core::KeyframeId> all = map.keyframe_ids();
    for (int i = 0; i < 2 && all.size() > 1; ++i) {
      const core::KeyframeId other =
          all[static_cast<std::size_t>(random_.integer(0, static_cast<int>(all.size()) - 1))];
      if (other == id) continue;
      maps::SurfaceEdge edge{i == 0 ? id : other, i == 0 ? other : id, random_.pose(1.0, 1.0), {}};
      edge.information = random_.uniform(1, 1000) * geometry::Matrix6d::Identity();
      edge.information(0, 5) = random_.uniform(-1, 1);
      map.add_edge(edge);
    }
    if (steps_ % 3 == 0 && all.size() > 1) {  // a loop is closed
      std::vector<maps::LoopEdge> loops = map.loops();
      loops.push_back({all.front(), all.back(), random_.pose(1.0, 1.0), {}});
      loops.back().information = random_.uniform(1, 1000) * geometry::Matrix6d::Identity();
      map.set_loops(std::move(loops));
    }
    for (const core::PointId p : map.point_ids()) {
      if (random_.integer(0, 4) != 0) continue;
      map.point(p).position += random_.vector(0.01);
      map.refresh_point(p);
    }
  }

  void thin_out() {
    const std::vector<core::PointId> points = map.point_ids();
    map.remove(points.back());  // the next id must not be given twice
    map.merge(points[0], points[1]);
    map.remove(map.line_ids()[map.line_count() / 2]);
  }

  float number(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }
  features::Descriptor256 bits() { return {random_.bits(), random_.bits(), random_.bits(), random_.bits()}; }
  cv::Mat image() {
    cv::Mat result(6, features::kThumbnailWidth / 10, CV_32FC1);
    for (int y = 0; y < result.rows; ++y) {
      for (int x = 0; x < result.cols; ++x) result.at<float>(y, x) = number(0, 255);
    }
    return result;
  }

  Random random_;
  int steps_ = 0;
};

inline bool same(const geometry::Rigid3& a, const geometry::Rigid3& b) {
  return a.rotation == b.rotation && a.translation == b.translation;
}
inline bool same(const std::vector<maps::Observation>& a, const std::vector<maps::Observation>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.keyframe == y.keyframe && x.feature == y.feature && x.aligned == y.aligned;
  });
}
inline bool same(const maps::MapPoint& a, const maps::MapPoint& b) {
  return a.id == b.id && a.position == b.position && a.descriptor == b.descriptor && a.angle == b.angle &&
         a.angle_keyframe == b.angle_keyframe && a.view_direction == b.view_direction &&
         a.normal == b.normal && a.reference_distance == b.reference_distance &&
         a.reference_octave == b.reference_octave && a.visible == b.visible && a.found == b.found &&
         same(a.observations, b.observations);
}
inline bool same(const maps::MapLine& a, const maps::MapLine& b) {
  return a.id == b.id && a.start == b.start && a.end == b.end && a.descriptor == b.descriptor &&
         a.visible == b.visible && a.found == b.found && same(a.observations, b.observations);
}
inline bool same(const maps::KeyframeEdge& a, const maps::KeyframeEdge& b) {
  return a.a == b.a && a.b == b.b && same(a.b_from_a, b.b_from_a) && a.information == b.information;
}
inline bool same(const features::PointFeature& a, const features::PointFeature& b) {
  return a.pixel == b.pixel && a.depth == b.depth && a.angle == b.angle && a.response == b.response &&
         a.octave == b.octave;
}
inline bool same(const features::CornerPatch& a, const features::CornerPatch& b) {
  return a.gray == b.gray && a.offset == b.offset;
}
inline bool same(const features::LineFeature& a, const features::LineFeature& b) {
  if (a.segment.start != b.segment.start || a.segment.end != b.segment.end ||
      a.segment.response != b.segment.response || a.descriptor != b.descriptor ||
      a.line3.has_value() != b.line3.has_value()) {
    return false;
  }
  return !a.line3.has_value() ||
         (a.line3->start == b.line3->start && a.line3->end == b.line3->end &&
          a.line3->start_noise.depth == b.line3->start_noise.depth &&
          a.line3->start_noise.across == b.line3->start_noise.across &&
          a.line3->end_noise.depth == b.line3->end_noise.depth &&
          a.line3->end_noise.across == b.line3->end_noise.across &&
          a.line3->inlier_share == b.line3->inlier_share && a.line3->coverage == b.line3->coverage);
}
inline bool same(const maps::SurfaceSample& a, const maps::SurfaceSample& b) {
  return a.point == b.point && a.normal == b.normal && a.sigma == b.sigma;
}
inline bool same(const maps::FramePose& a, const maps::FramePose& b) {
  return a.stamp == b.stamp && a.reference == b.reference &&
         same(a.camera_from_reference, b.camera_from_reference) && a.tracked == b.tracked &&
         a.camera_from_previous.has_value() == b.camera_from_previous.has_value() &&
         (!a.camera_from_previous || same(*a.camera_from_previous, *b.camera_from_previous)) &&
         a.step_sigma_m == b.step_sigma_m;
}
template <typename T>
bool same_all(const std::vector<T>& a, const std::vector<T>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const T& x, const T& y) { return same(x, y); });
}
inline bool same(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  for (int y = 0; y < a.rows; ++y) {
    if (std::memcmp(a.ptr(y), b.ptr(y), a.elemSize() * static_cast<std::size_t>(a.cols)) != 0) return false;
  }
  return true;
}

inline bool same_lookup(const features::FrameFeatures& a, const features::FrameFeatures& b) {
  std::vector<int> in_a;
  std::vector<int> in_b;
  a.grid.within(a.points, 320, 240, 200, in_a);
  b.grid.within(b.points, 320, 240, 200, in_b);
  return in_a == in_b;
}

inline bool same(const maps::Keyframe& a, const maps::Keyframe& b) {
  if (a.id != b.id || a.frame_index != b.frame_index || a.stamp != b.stamp || a.turn_rate != b.turn_rate ||
      a.reference != b.reference || !same(a.camera_from_reference, b.camera_from_reference) ||
      a.reference_sigma_m != b.reference_sigma_m || !same_all(a.surface, b.surface) ||
      (a.features == nullptr) != (b.features == nullptr)) {
    return false;
  }
  if (a.features == nullptr) return true;
  const features::FrameFeatures& x = *a.features;
  const features::FrameFeatures& y = *b.features;
  return same_all(x.points, y.points) && x.descriptors == y.descriptors && same_all(x.patches, y.patches) &&
         same_all(x.lines, y.lines) && same(x.thumbnail, y.thumbnail) &&
         same(x.thumbnail_depth, y.thumbnail_depth) && same_lookup(x, y);
}

/// Says what differs first.
inline testing::AssertionResult equal(const maps::Map& a, const maps::Map& b) {
  const auto differ = [](const char* what) { return testing::AssertionFailure() << what << " differ"; };
  if (a.keyframe_ids() != b.keyframe_ids()) return differ("keyframe ids");
  if (a.point_ids() != b.point_ids() || a.line_ids() != b.line_ids()) return differ("landmark ids");
  const maps::NextIds next_a = a.next_ids();
  const maps::NextIds next_b = b.next_ids();
  if (next_a.keyframes != next_b.keyframes || next_a.points != next_b.points ||
      next_a.lines != next_b.lines || next_a.edge != next_b.edge) {
    return differ("next ids");
  }
  for (const core::KeyframeId k : a.keyframe_ids()) {
    if (!same(a.keyframe(k), b.keyframe(k))) return differ("keyframes");
    if (!same(a.camera_from_world(k), b.camera_from_world(k))) return differ("poses");
    if (a.parent(k) != b.parent(k) || a.children(k) != b.children(k)) return differ("spanning trees");
    if (a.points_of(k) != b.points_of(k) || a.lines_of(k) != b.lines_of(k)) return differ("observations");
    if (a.covisible(k, 1) != b.covisible(k, 1)) return differ("covisibilities");
    if (!same_all(a.edges_of(k), b.edges_of(k))) return differ("edges of a keyframe");
  }
  if (!same_all(a.loops(), b.loops())) return differ("loops");
  for (const core::PointId p : a.point_ids()) {
    if (!same(a.point(p), b.point(p))) return differ("points");
  }
  for (const core::LineId l : a.line_ids()) {
    if (!same(a.line(l), b.line(l))) return differ("lines");
  }
  return testing::AssertionSuccess();
}

}  // namespace plumbline::tests
