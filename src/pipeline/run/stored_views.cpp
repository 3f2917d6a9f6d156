// SPDX-License-Identifier: BSD-3-Clause
#include "run/stored_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <system_error>
#include <utility>

#include "run/resumed_run.hpp"

namespace plumbline::pipeline {

core::Result<cloud::CloudPtr> StoredViews::read(std::size_t view) const {
  return keyframes[view].valid() ? reader->cloud(keyframes[view]) : reader->cloud(frames[view]);
}

core::Result<StoredViews> views_of(const maps::StoreReader& reader, const MapResult& map,
                                   const Arrivals& arrivals) {
  const auto keyframes = reader.cloud_ids();
  if (!keyframes) return tl::unexpected<core::Error>(keyframes.error());
  auto frames = reader.frame_cloud_ids();
  if (!frames) return tl::unexpected<core::Error>(frames.error());
  const auto arrival = [&](maps::FrameId frame) {
    const auto found = arrivals.find(frame);
    return found == arrivals.end() ? 0 : found->second;
  };
  std::stable_sort(frames->begin(), frames->end(),
                   [&](maps::FrameId a, maps::FrameId b) { return arrival(a) < arrival(b); });
  StoredViews views;
  views.reader = &reader;
  const auto add = [&](core::KeyframeId keyframe, maps::FrameId frame, double stamp,
                       const geometry::Rigid3& world_from_camera) {
    views.keyframes.push_back(keyframe);
    views.frames.push_back(frame);
    views.world_from_camera.push_back(world_from_camera);
    views.robots.push_back(keyframe.valid() ? keyframe.robot : frame.robot);
    views.stamps.push_back(stamp);
  };
  const std::set<core::KeyframeId> there(keyframes->begin(), keyframes->end());
  std::set<std::pair<std::int32_t, double>> seen;  // a run that went on may make a keyframe of what was none
  for (const KeyframePose& keyframe : map.keyframes) {
    if (there.count(keyframe.id) == 0) continue;
    add(keyframe.id, {}, keyframe.stamp, keyframe.world_from_camera);
    seen.emplace(keyframe.id.robot, keyframe.stamp);
  }
  std::map<maps::FrameId, std::size_t> places;
  for (std::size_t i = 0; i < map.trajectory_ids.size(); ++i) places[map.trajectory_ids[i]] = i;
  for (const maps::FrameId frame : *frames) {
    const auto found = places.find(frame);
    if (found == places.end()) continue;  // it was lost, or its map is left out
    const geometry::StampedPose& pose = map.trajectory[found->second];
    if (seen.count({frame.robot, pose.stamp}) == 0) add({}, frame, pose.stamp, pose.world_from_camera);
  }
  return views;
}

bool keeps_clouds(const Graph& graph) {
  std::set<std::pair<std::size_t, std::size_t>> kept, wanted;
  for (const Node& node : graph.nodes) {
    if (!node.stage->keeps_map() && node.type->name != "fuse") continue;
    for (std::size_t i = 0; i < node.inputs.size(); ++i) {
      if (!node.inputs[i] || !(node.type->inputs[i].type == keyframe_cloud_port())) continue;
      (node.stage->keeps_map() ? kept : wanted).insert({node.inputs[i]->node, node.inputs[i]->port});
    }
  }
  return kept.size() == 1 && kept == wanted;
}

core::Result<WaitingClouds> WaitingClouds::create(const RunContext& context) {
  WaitingClouds clouds;
  clouds.file_ = context.output_folder / kStoreFile;
  if (context.keeps_clouds) return clouds;
  std::error_code ignored;
  for (int i = 1; std::filesystem::exists(clouds.file_, ignored) || i == 1; ++i) {
    clouds.file_ = context.output_folder / fmt::format(".clouds-{}.db", i);
  }
  auto writer = maps::StoreWriter::create(clouds.file_, {}, maps::StoreUse::kInOneGo);
  if (!writer) return tl::unexpected<core::Error>(writer.error());
  clouds.writer_.emplace(std::move(*writer));
  return clouds;
}

core::Result<void> WaitingClouds::append(const KeyframeCloud& cloud) {
  if (!cloud.id.valid() && !cloud.frame.valid()) return {};
  if (!cloud.id.valid()) arrivals_.emplace(cloud.frame, arrivals_.size() + 1);
  if (!writer_) return {};
  const auto waiting = store_cloud_of(cloud);
  return waiting ? writer_->add_cloud(*waiting) : tl::unexpected<core::Error>(waiting.error());
}

core::Result<const maps::StoreReader*> WaitingClouds::open() {
  auto reader = maps::StoreReader::open(file_);
  if (!reader) return tl::unexpected<core::Error>(reader.error());
  reader_.emplace(std::move(*reader));
  return &*reader_;
}

void WaitingClouds::clear() {
  reader_.reset();
  if (!writer_) return;
  writer_.reset();
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

}  // namespace plumbline::pipeline
