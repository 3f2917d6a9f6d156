// SPDX-License-Identifier: BSD-3-Clause
// store: the map as map.db. Of one robot while the run goes, so that a run that ends early has lost nothing;
// of several when they have become one map.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/cloud/cloud_spool.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/stored_maps.hpp"
#include "run/fusion_state.hpp"
#include "run/resumed_run.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

constexpr std::size_t kCloudsAtATime = 128;  // in one transaction

/// Clouds of a map that is written when it is finished: those of finished maps are where they are, others
/// wait in a temporary file.
class LaterClouds {
 public:
  static core::Result<LaterClouds> create(const RunContext& context) {
    LaterClouds clouds;
    clouds.maps_ = context.stored_maps;
    if (clouds.maps_ != nullptr) return clouds;
    auto spool = cloud::CloudSpool::create(context.output_folder);
    if (!spool) return tl::unexpected<core::Error>(spool.error());
    clouds.spool_.emplace(std::move(*spool));
    return clouds;
  }
  core::Result<void> append(const KeyframeCloud& cloud, std::size_t frame) {
    waiting_.push_back({cloud.id, cloud.robot, cloud.stamp, frame});
    return spool_ ? spool_->append(*cloud.compact) : core::Result<void>();
  }
  /// Writes those that belong to `map`, which is in the file already.
  core::Result<void> write(const MapResult& map, maps::StoreWriter& writer) const {
    std::map<std::pair<std::int32_t, double>, std::size_t> frames;
    for (std::size_t f = 0; f < map.frame_poses.size(); ++f) {
      const maps::FramePose& frame = map.frame_poses[f];
      if (frame.tracked) frames[{frame.reference.robot, frame.stamp}] = f;
    }
    maps::StoreStep step;
    for (std::size_t i = 0; i < waiting_.size(); ++i) {
      maps::StoreCloud cloud;
      cloud.keyframe = waiting_[i].id;
      if (cloud.keyframe.valid() && !map.map->has_keyframe(cloud.keyframe)) continue;  // its map is left out
      if (!cloud.keyframe.valid()) {
        const auto found = frames.find({waiting_[i].robot, waiting_[i].stamp});
        if (found == frames.end()) continue;
        cloud.frame = found->second;
      }
      auto bytes = spool_ ? spool_->read_compact(i) : maps_->cloud_bytes(waiting_[i].frame);
      if (!bytes) return tl::unexpected<core::Error>(bytes.error());
      cloud.bytes = std::make_shared<std::vector<std::uint8_t>>(std::move(*bytes));
      step.clouds.push_back(std::move(cloud));
      if (step.clouds.size() < kCloudsAtATime) continue;
      if (auto added = add(map, step, writer); !added) return added;
      step = {};
    }
    return step.clouds.empty() ? core::Result<void>{} : add(map, step, writer);
  }

 private:
  struct Waiting {
    core::KeyframeId id;
    std::int32_t robot = 0;
    double stamp = 0.0;
    std::size_t frame = 0;  ///< that it came with
  };
  static core::Result<void> add(const MapResult& map, maps::StoreStep& step, maps::StoreWriter& writer) {
    step.map = std::make_shared<maps::MapChanges>(map.map->changes_since(map.map->now()));
    return writer.add(step);
  }

  const StoredMaps* maps_ = nullptr;
  std::optional<cloud::CloudSpool> spool_;
  std::vector<Waiting> waiting_;
};

class StoreStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean(
        "enabled", enabled_,
        "Write map.db, the map with its clouds; of one robot as the run goes: what a run that was ended can "
        "go on from");
  }
  [[nodiscard]] std::vector<std::string> files() const override {
    return enabled_ ? std::vector<std::string>{kStoreFile} : std::vector<std::string>{};
  }
  [[nodiscard]] bool wants_map_changes() const override { return enabled_; }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    if (!enabled_) return {};
    if (!context.keep_changes) {
      auto clouds = LaterClouds::create(context);
      if (!clouds) return tl::unexpected<core::Error>(clouds.error());
      later_.emplace(std::move(*clouds));
      return {};
    }
    if (context.resumed != nullptr) {
      frames_ = context.resumed->map.frames.size();
      return take(maps::StoreWriter::resume(context.resumed->store));
    }
    return take(maps::StoreWriter::create(
        context.output_folder / kStoreFile,
        header(context.recordings->robot(0).name, context.recordings->robot(0).camera)));
  }

  /// One transaction a keyframe; what comes between waits for the next one.
  core::Result<void> process(StageIo& io) override {
    const auto cloud = io.input<KeyframeCloud>("cloud");
    if (later_ && cloud != nullptr) return later_->append(*cloud, io.frame());
    const auto track = io.input<TrackedFrame>("track");
    if (!writer_ || track == nullptr) return {};
    step_.log.push_back(to_line(track->row));
    if (track->pose) step_.frames.push_back(*track->pose);
    if (cloud != nullptr) keep_cloud(*track, *cloud);
    if (!track->keyframe.valid()) return {};
    if (track->changes == nullptr) {
      return core::usage_error(
          "store: only a map that was tracked can be stored; remove this stage where poses come from a file");
    }
    step_.map = track->changes;
    frames_ += step_.frames.size();
    auto added = writer_->add(step_);
    step_ = {};
    return added;
  }

  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("map");
    if (!enabled_ || map->map == nullptr) return {};
    if (later_) {
      if (auto written = write_at_once(*map); !written) return written;
    }
    maps::ResultFrame frame;
    if (const auto dense = io.input<DenseCloud>("result")) {
      frame = {dense->output_from_map, dense->upright};
      if (dense->state != nullptr) {
        if (auto kept = writer_->attach(kFusionAttachment, to_bytes(*dense->state)); !kept) return kept;
      }
    }
    auto saved = writer_->save_final(*map->map, map->frame_poses, frame, step_);
    writer_.reset();
    return saved;
  }

 private:
  [[nodiscard]] maps::StoreHeader header(const std::string& robot, const sensor::Camera& camera) const {
    maps::StoreHeader header;
    header.camera = camera;
    header.configuration = context_->configuration;
    header.input = context_->input;
    header.robot = robot;
    header.program_version = core::version();
    return header;
  }
  core::Result<void> take(core::Result<maps::StoreWriter> writer) {
    if (!writer) return tl::unexpected<core::Error>(writer.error());
    writer_.emplace(std::move(*writer));
    return {};
  }
  /// A frame between keyframes that was lost lies nowhere: its cloud is of no use.
  void keep_cloud(const TrackedFrame& track, const KeyframeCloud& cloud) {
    if (cloud.id.valid()) {
      step_.clouds.push_back({cloud.id, 0, cloud.compact, cloud.surface});
    } else if (track.pose && track.pose->tracked) {
      step_.clouds.push_back({{}, frames_ + step_.frames.size() - 1, cloud.compact, nullptr});
    }
  }

  core::Result<void> write_at_once(const MapResult& map) {
    const RobotInfo& first = map.robots.front();
    auto made = take(maps::StoreWriter::create(context_->output_folder / kStoreFile,
                                               header(first.name, first.camera), maps::StoreUse::kInOneGo));
    if (!made) return made;
    maps::StoreStep whole;
    whole.map = std::make_shared<maps::MapChanges>(map.map->changes_since({}));
    whole.frames = map.frame_poses;
    if (auto added = writer_->add(whole); !added) return added;
    if (auto added = later_->write(map, *writer_); !added) return added;
    later_.reset();
    return writer_->attach(kRobotsAttachment, robots_to_bytes(map.robots));
  }

  const RunContext* context_ = nullptr;
  bool enabled_ = true;
  std::optional<maps::StoreWriter> writer_;
  std::optional<LaterClouds> later_;  ///< of a map that is written when it is finished
  maps::StoreStep step_;              ///< since the last keyframe
  std::size_t frames_ = 0;            ///< in the store
};

}  // namespace

StageType store_stage() {
  return {
      "store",
      "Keeps the map in map.db: of one robot as the run goes, one transaction a keyframe; of several when "
      "they are one map",
      Mode::kSerial,
      {{"track", track_port(), false},
       {"cloud", keyframe_cloud_port(), false},
       {"map", map_port()},
       {"result", cloud_port(), false}},
      {},
      [] { return std::make_unique<StoreStage>(); },
      true};
}

}  // namespace plumbline::pipeline
