// SPDX-License-Identifier: BSD-3-Clause
#include "store/store_check.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <limits>

#include "plumbline/cloud/compact/compact_cloud.hpp"

namespace plumbline::maps {
namespace {

constexpr std::int64_t kMostRobots = 255;
constexpr std::int64_t kMostNumbers = 1 << 22;  // of keyframes, of pages: far above what a run can have
constexpr std::size_t kMostPlain = 64U << 20U;  // bytes of a keyframe or a surface, unpacked
constexpr std::size_t kMostPage = 8U << 20U;    // of a page of landmarks, frames or lines of the log
constexpr std::size_t kMostSmall = 64U << 10U;
constexpr double kMostSide = 16384;  // pixels

void demand(bool holds, const char* otherwise) {
  if (!holds) throw BadBytes(otherwise);
}

void check(const geometry::Rigid3& pose) {
  demand(pose.rotation.allFinite() && pose.translation.allFinite(), "a pose is not finite");
  const Eigen::Matrix3d unit = pose.rotation * pose.rotation.transpose();
  demand(unit.isIdentity(1e-3) && pose.rotation.determinant() > 0.0, "a pose has an invalid rotation");
}

void check(const sensor::Pinhole& c) {
  const bool finite =
      std::isfinite(c.fx) && std::isfinite(c.fy) && std::isfinite(c.cx) && std::isfinite(c.cy);
  demand(finite && c.fx > 0.0 && c.fy > 0.0, "a camera's focal length is not positive");
  demand(c.width > 0 && c.height > 0 && c.width <= kMostSide && c.height <= kMostSide,
         "a camera's image has no size");
}

void check_id(const core::KeyframeId& id) {
  demand(!id.valid() || (id.robot <= kMostRobots && id.index < kMostNumbers), "an id is out of range");
}

/// The next free ids must be within the range of ids.
template <typename Ids>
void check_next(const Ids& ids) {
  constexpr std::int64_t kMost = kMostNumbers * kLandmarksPerPage;
  for (const auto& id : ids) {
    demand(id.robot >= 0 && id.robot <= kMostRobots && id.index >= 0 && id.index < kMost,
           "an id is out of range");
  }
}

void check(std::monostate /*none*/) {}

/// A keyframe's numbers must be finite and within an image.
void check(const std::shared_ptr<const Keyframe>& keyframe) {
  demand(std::isfinite(keyframe->stamp) && std::isfinite(keyframe->turn_rate), "its stamp is not finite");
  check_id(keyframe->reference);
  check(keyframe->camera_from_reference);
  if (keyframe->features == nullptr) return;
  for (const features::PointFeature& p : keyframe->features->points) {
    demand(p.pixel.allFinite() && p.pixel.cwiseAbs().maxCoeff() <= static_cast<float>(kMostSide),
           "a point's pixel is out of range");
  }
}

void check(const KeyframeState& state) {
  check(state.camera_from_world);
  check_id(state.parent);
}

/// Landmarks of a page are in order and finite.
template <typename Landmark>
void check_landmarks(const std::vector<Landmark>& landmarks) {
  std::int32_t last = -1;
  for (const Landmark& landmark : landmarks) {
    demand(landmark.id.index > last, "a landmark is there twice");
    last = landmark.id.index;
    if constexpr (std::is_same_v<Landmark, MapPoint>) {
      demand(
          landmark.position.allFinite() && landmark.normal.allFinite() && landmark.view_direction.allFinite(),
          "a landmark is not finite");
    } else {
      demand(landmark.start.allFinite() && landmark.end.allFinite(), "a landmark is not finite");
    }
    for (const Observation& o : landmark.observations) check_id(o.keyframe);
  }
}

void check(const Page<MapPoint>& points) { check_landmarks(*points); }
void check(const Page<MapLine>& lines) { check_landmarks(*lines); }

/// Only tracked frames have a pose.
void check(const Page<FramePose>& frames) {
  for (const FramePose& frame : *frames) {
    demand(std::isfinite(frame.stamp), "a frame's stamp is not finite");
    check_id(frame.reference);
    if (!frame.tracked) continue;
    check(frame.camera_from_reference);
    if (frame.camera_from_previous) check(*frame.camera_from_previous);
  }
}

void check(const Page<std::string>& /*log*/) {}

void check_edge(const KeyframeEdge& edge) {
  check_id(edge.a);
  check_id(edge.b);
  check(edge.b_from_a);
  demand(edge.information.allFinite(), "an edge is not finite");
}

void check(const EdgeRow& row) { check_edge(row.edge); }

/// Both cameras and all distortion terms.
void check(const sensor::Camera& camera) {
  check(camera.color);
  if (camera.depth) check(*camera.depth);
  if (camera.color_from_depth) check(*camera.color_from_depth);
  for (const double k : camera.distortion) demand(std::isfinite(k), "the camera is not finite");
  for (const double k : camera.depth_lens.k) demand(std::isfinite(k), "the camera is not finite");
  for (const double k : camera.depth_slope) demand(std::isfinite(k), "the camera is not finite");
  demand(std::isfinite(camera.depth_delay_s), "the camera is not finite");
}

void check(const MapRow& row) {
  check_next(row.next.keyframes);
  check_next(row.next.points);
  check_next(row.next.lines);
  for (const LoopEdge& loop : row.loops) check_edge(loop);
}

/// A refined camera's numbers must be finite and in range.
void check(const CameraEstimate& estimate) {
  check(estimate.found);
  demand(estimate.asked_at >= -1 && estimate.used_from >= 0, "a camera's estimate is out of range");
  const bool finite = estimate.covariance.allFinite() && std::isfinite(estimate.gain);
  demand(finite && estimate.covariance.diagonal().minCoeff() >= 0.0, "a camera's covariance is none");
  for (const double wrong : estimate.wrong)
    demand(wrong >= 0.0 && wrong <= 1.0, "a camera's estimate is out of range");
}

void check_header(const std::string& key, const Bytes& bytes, std::vector<RobotInfo>& robots) {
  // A small packet must not unpack to gigabytes
  const auto plain = [&](std::size_t most) { return unpack(bytes.data(), bytes.size(), most); };

  // Robots are kept: keyframes refer to their cameras
  if (key == "robots") {
    robots = decode<std::vector<RobotInfo>>(plain(kMostSmall));
    demand(!robots.empty(), "there is no robot");
    for (const RobotInfo& robot : robots) {
      demand(robot.number >= 0 && robot.number <= kMostRobots, "an id is out of range");
      check(robot.camera);
    }

  } else if (key == "cameras") {
    for (const CameraVersions& of : decode<std::vector<CameraVersions>>(plain(kMostSmall))) {
      for (const CameraVersion& version : of.versions) {
        check(version.camera);
        demand(version.first_keyframe >= 0 && version.first_frame >= 0, "a camera's version is out of range");
      }
    }

  } else if (key == "estimates") {
    const auto estimates = decode<CameraEstimates>(plain(kMostSmall));
    for (const auto& estimate : estimates.each) check(estimate.second);
    for (const auto& [robot, s] : estimates.told) {
      for (const double one : {s.fx, s.centre, s.distortion, s.readout_s, s.depth_slope, s.depth_delay_s})
        demand(one >= 0.0 && one < 1e9, "a camera's standard deviation is out of range");
    }

  } else if (key == "result") {
    check(decode<ResultFrame>(plain(kMostSmall)).output_from_map);
  } else {
    const bool known = key == "input" || key == "program" || key == "configuration" || key == "complete";
    demand(known, "nothing has this name");
  }
}

void check_cloud(const Bytes& bytes) {
  const auto cloud = cloud::decode_cloud(bytes.data(), bytes.size());
  if (!cloud) throw BadBytes(cloud.error().message);
}

}  // namespace

/// Keys are short texts, or numbers within their table's range.
void check_name(const RowName& name) {
  const RowTable& table = kRowTables[name.table];
  if (table.named) {
    demand(!name.key.empty() && name.key.size() <= 64, "its name is out of range");
  } else {
    const std::string text = table.name;
    const std::int64_t most = text == "edge"          ? 1LL << 40U
                              : text == "frame_cloud" ? std::numeric_limits<std::int32_t>::max()
                                                      : kMostNumbers;
    demand(name.robot >= 0 && name.robot <= kMostRobots && name.number >= 0 && name.number < most,
           "its number is out of range");
  }
}

RowContent check_row(const RowName& name, const Bytes& bytes, std::vector<RobotInfo>& robots) {
  // Rows arrive packed
  check_name(name);
  const std::string table = kRowTables[name.table].name;
  const auto plain = [&](std::size_t most) { return unpack(bytes.data(), bytes.size(), most); };

  // Rows of other tables.
  if (table == "header") {
    check_header(name.key, bytes, robots);
    return {};
  }

  if (table == "attachment") {
    plain(kMostPlain);
    return {};
  }
  if (table == "surface") {
    decode_surface(plain(kMostPlain));
    return {};
  }

  if (table == "cloud" || table == "frame_cloud") {
    check_cloud(bytes);
    return {};
  }

  // Rows of a map.
  const std::size_t most = table == "map" || table == "keyframe" ? kMostPlain
                           : table == "state" || table == "edge" ? kMostSmall
                                                                 : kMostPage;
  if (table == "keyframe") demand(!robots.empty(), "there is no camera");
  RowContent content = decode_row(table, name.robot, name.number, plain(most), robots);
  std::visit([](const auto& row) { check(row); }, content);
  return content;
}

}  // namespace plumbline::maps
