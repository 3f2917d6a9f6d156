// SPDX-License-Identifier: BSD-3-Clause
// Taps of what tracking says and of what the end of a run gives.
#include <fmt/format.h>

#include <memory>

#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "stages/stages.hpp"
#include "taps/tap_file.hpp"

namespace plumbline::pipeline {
namespace {

class TrackTap : public Tap {
 public:
  TrackTap() : Tap(TapFile::Count::kOne, {".csv"}) {}
  core::Result<void> process(StageIo& io) override {
    const auto track = io.input<TrackedFrame>("in");
    rows_ += fmt::format("{},{:.6f},{}\n", io.frame(), track->stamp,
                         track->keyframe.valid() ? std::to_string(track->keyframe.index) : "");
    return {};
  }
  core::Result<void> finish(StageIo& /*io*/) override {
    core::OutputFile out(file_.path());
    out.write("frame,stamp,keyframe\n");
    out.write(rows_);
    return out.commit();
  }

 private:
  std::string rows_;
};

class KeyframeCloudTap : public Tap {
 public:
  KeyframeCloudTap() : Tap(TapFile::Count::kMany, {".ply", ".pcd"}) {}
  core::Result<void> process(StageIo& io) override {
    const auto keyframe = io.input<KeyframeCloud>("in");
    if (!keyframe->id.valid()) return {};
    const auto cloud = cloud_of(*keyframe);
    if (!cloud) return tl::unexpected(cloud.error());
    return cloud::write_cloud(file_.path(static_cast<std::size_t>(keyframe->id.index)), **cloud);
  }
};

class MapTap : public Tap {
 public:
  MapTap() : Tap(TapFile::Count::kOne, {".txt", ".ply"}) {}
  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("in");
    return file_.ending() == ".txt" ? dataset::write_trajectory(file_.path(), map->trajectory)
                                    : maps::write_trajectory_ply(file_.path(), map->trajectory);
  }
};

class MapsTap : public Tap {
 public:
  MapsTap() : Tap(TapFile::Count::kMany, {".txt", ".ply"}) {}
  core::Result<void> finish(StageIo& io) override {
    const auto maps = io.input<RobotMaps>("in");
    for (std::size_t i = 0; i < maps->maps.size(); ++i) {
      const auto path = maps::trajectory(maps->maps[i].frame_poses, *maps->maps[i].map);
      auto written = file_.ending() == ".txt" ? dataset::write_trajectory(file_.path(i), path)
                                              : maps::write_trajectory_ply(file_.path(i), path);
      if (!written) return written;
    }
    return {};
  }
};

class CloudTap : public Tap {
 public:
  CloudTap() : Tap(TapFile::Count::kOne, {".ply", ".pcd"}) {}
  core::Result<void> finish(StageIo& io) override {
    const auto dense = io.input<DenseCloud>("in");
    return cloud::write_cloud(file_.path(), *dense->cloud, dense->columns);
  }
};

template <typename T>
StageType tap(PortType port, std::string help, Mode mode) {
  std::string name = port.name;
  return {std::move(name),
          std::move(help),
          mode,
          {{"in", std::move(port)}},
          {},
          [] { return std::make_unique<T>(); },
          true};
}

}  // namespace

StageType track_tap() {
  return tap<TrackTap>(track_port(), "One line a tracked frame: number, stamp, keyframe made of it",
                       Mode::kSerial);
}
StageType keyframe_cloud_tap() {
  return tap<KeyframeCloudTap>(keyframe_cloud_port(), "The cloud of each keyframe, in its camera's frame",
                               Mode::kStateless);
}
StageType map_tap() {
  return tap<MapTap>(map_port(),
                     "The camera's path in the map's frame: poses in TUM format (.txt) or edges (.ply)",
                     Mode::kSerial);
}
StageType maps_tap() {
  return tap<MapsTap>(maps_port(),
                      "Each robot's path in its own map: poses in TUM format (.txt) or edges (.ply)",
                      Mode::kSerial);
}
StageType cloud_tap() {
  return tap<CloudTap>(cloud_port(), "The cloud, in the frame of the results", Mode::kSerial);
}

}  // namespace plumbline::pipeline
