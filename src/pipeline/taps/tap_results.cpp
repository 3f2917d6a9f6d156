// SPDX-License-Identifier: BSD-3-Clause
// Taps of tracking results and of results at the end of a run.
#include <fmt/format.h>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "stages/stages.hpp"
#include "taps/tap_file.hpp"

namespace plumbline::pipeline {
namespace {

class TrackTap : public Tap {
 public:
  TrackTap() : Tap(Count::kOne, {".csv"}) {}
  core::Result<void> process(StageIo& io) override {
    const auto track = io.input<TrackedFrame>("in");
    rows_ += fmt::format("{},{:.6f},{}\n", io.frame(), track->stamp,
                         track->keyframe.valid() ? std::to_string(track->keyframe.index) : "");
    return {};
  }
  core::Result<void> finish(StageIo& /*io*/) override {
    return core::write_file(path(), "frame,stamp,keyframe\n" + rows_);
  }

 private:
  std::string rows_;
};

class KeyframeCloudTap : public Tap {
 public:
  KeyframeCloudTap() : Tap(Count::kMany, {".ply", ".pcd"}) {}
  core::Result<void> process(StageIo& io) override {
    const auto keyframe = io.input<KeyframeCloud>("in");
    if (!keyframe->id.valid()) return {};
    const auto cloud = cloud_of(*keyframe);
    if (!cloud) return tl::unexpected(cloud.error());
    return cloud::write_cloud(path(static_cast<std::size_t>(keyframe->id.index)), **cloud);
  }
};

class MapTap : public Tap {
 public:
  MapTap() : Tap(Count::kOne, {".txt", ".ply"}) {}
  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("in");
    return ending() == ".txt" ? dataset::write_trajectory(path(), map->trajectory)
                              : maps::write_trajectory_ply(path(), map->trajectory);
  }
};

class MapsTap : public Tap {
 public:
  MapsTap() : Tap(Count::kMany, {".txt", ".ply"}) {}
  core::Result<void> finish(StageIo& io) override {
    const auto maps = io.input<RobotMaps>("in");
    for (std::size_t i = 0; i < maps->maps.size(); ++i) {
      const auto poses = maps::trajectory(maps->maps[i].frame_poses, *maps->maps[i].map);
      auto written = ending() == ".txt" ? dataset::write_trajectory(path(i), poses)
                                        : maps::write_trajectory_ply(path(i), poses);
      if (!written) return written;
    }
    return {};
  }
};

class CloudTap : public Tap {
 public:
  CloudTap() : Tap(Count::kOne, {".ply", ".pcd"}) {}
  core::Result<void> finish(StageIo& io) override {
    const auto dense = io.input<DenseCloud>("in");
    const auto up = dense->upright ? cloud::Up::kZ : cloud::Up::kMinusY;
    return cloud::write_cloud(path(), *dense->cloud, dense->columns, Eigen::Vector3d::Zero(),
                              cloud::frame_with(up).comments());
  }
};

}  // namespace

StageType track_tap() {
  return tap_type<TrackTap>(track_port(), "One line per tracked frame: number, stamp, keyframe made of it",
                            Mode::kSerial);
}
StageType keyframe_cloud_tap() {
  return tap_type<KeyframeCloudTap>(keyframe_cloud_port(),
                                    "The cloud of each keyframe, in its camera's frame", Mode::kStateless);
}
StageType map_tap() {
  return tap_type<MapTap>(map_port(),
                          "The camera's path in the map's frame: poses in TUM format (.txt) or edges (.ply)",
                          Mode::kSerial);
}
StageType maps_tap() {
  return tap_type<MapsTap>(maps_port(),
                           "Each robot's path in its own map: poses in TUM format (.txt) or edges (.ply)",
                           Mode::kSerial);
}
StageType cloud_tap() {
  return tap_type<CloudTap>(cloud_port(), "The cloud, in the frame of the results", Mode::kSerial);
}

}  // namespace plumbline::pipeline
