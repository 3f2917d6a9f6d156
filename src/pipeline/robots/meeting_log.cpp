// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/meeting_log.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <utility>

#include "plumbline/core/json.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/viz/snapshot.hpp"
#include "robots/robot_merge.hpp"

namespace plumbline::pipeline {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using mapping::MeetingEvent;
using mapping::MeetingStep;

/// The keyframes' surface samples and the landmarks, coloured by robot, and the robots' paths.
viz::Scene scene_of(const mapping::FusedMap& preview, const std::vector<std::string>& names) {
  viz::Scene scene;
  auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZRGBNormal>>();
  const auto add = [&](const Eigen::Vector3d& at, const Eigen::Vector3d& normal, std::int32_t robot) {
    pcl::PointXYZRGBNormal point;
    point.getVector3fMap() = at.cast<float>();
    point.getNormalVector3fMap() = normal.cast<float>();
    cloud->push_back(point);
    scene.scalars.push_back(static_cast<float>(robot));
  };

  // Surface samples are stored in the frame of their keyframe and follow its pose in the preview; landmarks
  // are in the world already.
  for (const KeyframeId id : preview.map.keyframe_ids()) {
    const Rigid3 world_from_camera = preview.map.camera_from_world(id).inverse();
    for (const maps::SurfaceSample& sample : preview.map.keyframe(id).surface) {
      add(world_from_camera * sample.point.cast<double>(),
          world_from_camera.rotation * sample.normal.cast<double>(), id.robot);
    }
  }

  for (const core::PointId id : preview.map.point_ids()) {
    const maps::MapPoint& point = preview.map.point(id);
    add(point.position, point.normal, id.robot);
  }

  scene.cloud = cloud;
  const std::vector<maps::KeyframePose> keyframes = maps::keyframe_poses(preview.map);
  for (const std::size_t robot : preview.parts) {
    viz::CameraPath path;
    path.name = names[robot];
    path.color = viz::category_color(robot);
    path.trajectory = maps::trajectory(keyframes, static_cast<std::int32_t>(robot));
    scene.paths.push_back(std::move(path));
  }

  return scene;
}

std::string text_of(const Meeting& meeting, const MeetingEvent& event,
                    const std::vector<std::string>& names) {
  Json robots = Json::array();
  for (std::size_t i = 0; i < event.preview->parts.size(); ++i) {
    robots.push_back({{"name", names[event.preview->parts[i]]},
                      {"frame_from_robot", rows(event.preview->anchor_from_part[i])}});
  }

  // The merge is a preview whose own times are not known (-1); the time of the meeting stands beside it.
  Json json = {
      {"number", meeting.number},
      {"preview", true},
      {"a", meeting.a},
      {"b", meeting.b},
      {"frame", event.frame},
      {"keyframe",
       {{"robot", names[static_cast<std::size_t>(event.keyframe.robot)]}, {"number", event.keyframe.index}}},
      {"frame_of", names[event.preview->parts.front()]},
      {"robots", robots},
      {"pairs_refused_by_graph", event.preview->rejected},
      {"evidence", section_of(RobotMerge{meeting.a, meeting.b, -1.0, -1.0, event.evidence})}};

  if (meeting.time_s >= 0.0) json["time_s"] = meeting.time_s;
  return core::json_text(json);
}

}  // namespace

core::Result<void> MeetingLog::note(const MeetingEvent& event, const std::vector<std::string>& names,
                                    const std::string& when, double time_s) {
  const std::string& a = names[event.a];
  const std::string& b = names[event.b];
  const std::string keyframe = fmt::format("keyframe {} of {}", event.keyframe.index,
                                           names[static_cast<std::size_t>(event.keyframe.robot)]);

  // Places that look similar are often different ones: users are informed of meetings only, and the steps
  // before are for debugging.
  switch (event.step) {
    case MeetingStep::kNone:
      return {};
    case MeetingStep::kSimilar:
      log_->debug(fmt::format("{} and {} look similar {} ({})", a, b, when, keyframe));
      return {};
    case MeetingStep::kVerified:
      log_->debug(fmt::format("{} and {}: a common place is verified {} ({})", a, b, when, keyframe));
      return {};
    case MeetingStep::kLocalMapAsked:
      log_->debug(
          fmt::format("{} and {}: the local maps around the common place are requested {}", a, b, when));
      return {};

    case MeetingStep::kMet:
      meetings_.push_back({static_cast<int>(meetings_.size()) + 1, a, b, time_s, event.frame, false});
      log_->info(
          fmt::format("{} and {} have met {}: {} keyframes agree to {:.0f} mm; {} maps are now in one frame",
                      a, b, when, event.evidence.consistency.agreeing,
                      1e3 * event.evidence.alignment.spread_m, event.preview->parts.size()));
      return write(event, names, when);

    // Files of the meeting have been written and announced, so its end is listed too.
    case MeetingStep::kTakenBack:
      meetings_.push_back({static_cast<int>(meetings_.size()) + 1, a, b, time_s, event.frame, true});
      log_->warning(
          fmt::format("{} and {} have not met after all, {}: {}", a, b, when, event.evidence.refused));
      return {};
  }

  return {};
}

core::Result<void> MeetingLog::write(const MeetingEvent& event, const std::vector<std::string>& names,
                                     const std::string& when) {
  const Meeting& meeting = meetings_.back();
  const std::filesystem::path folder =
      output_ / "meetings" / fmt::format("{:04}_{}_{}", meeting.number, meeting.a, meeting.b);
  if (auto made = core::make_folder(folder); !made) return made;

  const std::vector<maps::KeyframePose> keyframes = maps::keyframe_poses(event.preview->map);
  for (const std::size_t robot : event.preview->parts) {
    auto written = dataset::write_trajectory(folder / (names[robot] + ".txt"),
                                             maps::trajectory(keyframes, static_cast<std::int32_t>(robot)));
    if (!written) return written;
  }

  viz::Scene scene = scene_of(*event.preview, names);
  scene.title = fmt::format("{} and {} have met {}", meeting.a, meeting.b, when);
  pictures_.emplace_back(folder / "map.png", std::move(scene));
  return core::write_file(folder / "meeting.json", text_of(meeting, event, names));
}

core::Result<void> MeetingLog::draw() {
  for (const auto& [file, scene] : std::exchange(pictures_, {})) {
    viz::SnapshotOptions options;
    options.view = viz::View::kTop;
    options.color = viz::ColorMode::kRobot;
    if (auto drawn = viz::render_snapshot(scene, options, file); !drawn) return drawn;
  }
  return {};
}

}  // namespace plumbline::pipeline
