// SPDX-License-Identifier: BSD-3-Clause
// keep: the finished map of several robots as map.db, so that it can be fused, exported and drawn again.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/cloud/cloud_spool.hpp"
#include "plumbline/cloud/compact_cloud.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/pipeline/stored_maps.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

constexpr std::size_t kCloudsAtATime = 128;  // in one transaction

class KeepStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean("enabled", enabled_, "Write map.db, the map with its clouds");
  }
  [[nodiscard]] std::vector<std::string> files() const override {
    return enabled_ ? std::vector<std::string>{"map.db"} : std::vector<std::string>{};
  }
  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    if (!enabled_ || context.stored_maps != nullptr) return {};  // clouds of stored maps wait there
    auto spool = cloud::CloudSpool::create(context.output_folder);
    if (!spool) return tl::unexpected<core::Error>(spool.error());
    spool_.emplace(std::move(*spool));
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    if (!enabled_) return {};
    const auto cloud = io.input<KeyframeCloud>("cloud");
    waiting_.push_back({cloud->id, cloud->robot, cloud->stamp, io.frame()});
    if (!spool_) return {};
    return cloud->compact != nullptr ? spool_->append(*cloud->compact) : spool_->append(*cloud->cloud);
  }

  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("map");
    if (!enabled_ || map->map == nullptr) return {};
    maps::StoreHeader header;
    header.camera = map->robots.empty() ? context_->source->camera() : map->robots.front().camera;
    header.configuration = context_->configuration;
    header.input = context_->input;
    header.robot = map->robots.empty() ? context_->source->name() : map->robots.front().name;
    header.program_version = core::version();
    auto writer =
        maps::StoreWriter::create(context_->output_folder / "map.db", header, maps::StoreUse::kInOneGo);
    if (!writer) return tl::unexpected<core::Error>(writer.error());
    maps::StoreStep whole;
    whole.map = std::make_shared<maps::MapChanges>(map->map->changes_since({}));
    whole.frames = map->frame_poses;
    if (auto added = writer->add(whole); !added) return added;
    if (auto added = add_clouds(*map, *writer); !added) return added;
    if (!map->robots.empty()) {
      if (auto kept = writer->attach(kRobotsAttachment, robots_to_bytes(map->robots)); !kept) return kept;
    }
    maps::ResultFrame frame;
    if (const auto dense = io.input<DenseCloud>("result")) frame = {dense->output_from_map, dense->upright};
    spool_.reset();
    return writer->save_final(*map->map, map->frame_poses, frame);
  }

 private:
  struct Waiting {
    core::KeyframeId id;
    std::int32_t robot = 0;
    double stamp = 0.0;
    std::size_t frame = 0;  ///< that it came with
  };

  core::Result<void> add_clouds(const MapResult& map, maps::StoreWriter& writer) const {
    std::map<std::pair<std::int32_t, double>, std::size_t> frames;
    for (std::size_t f = 0; f < map.frame_poses.size(); ++f) {
      const maps::FramePose& frame = map.frame_poses[f];
      if (frame.tracked) frames[{frame.reference.robot, frame.stamp}] = f;
    }
    const auto known = [&](core::KeyframeId id) {
      return std::binary_search(map.keyframes.begin(), map.keyframes.end(), KeyframePose{id, 0.0, {}},
                                [](const KeyframePose& a, const KeyframePose& b) { return a.id < b.id; });
    };
    maps::StoreStep step;
    for (std::size_t i = 0; i < waiting_.size(); ++i) {
      maps::StoreCloud cloud;
      cloud.keyframe = waiting_[i].id;
      if (cloud.keyframe.valid() && !known(cloud.keyframe)) continue;  // of a map that was left out
      if (!cloud.keyframe.valid()) {
        const auto found = frames.find({waiting_[i].robot, waiting_[i].stamp});
        if (found == frames.end()) continue;
        cloud.frame = found->second;
      }
      auto bytes = spool_ ? spool_->read_compact(i) : context_->stored_maps->cloud_bytes(waiting_[i].frame);
      if (!bytes) return tl::unexpected<core::Error>(bytes.error());
      cloud.bytes = std::make_shared<std::vector<std::uint8_t>>(std::move(*bytes));
      step.clouds.push_back(std::move(cloud));
      if (step.clouds.size() < kCloudsAtATime) continue;
      if (auto added = add(map, step, writer); !added) return added;
      step = {};
    }
    return step.clouds.empty() ? core::Result<void>{} : add(map, step, writer);
  }

  /// Clouds alone: the map is in the file already.
  static core::Result<void> add(const MapResult& map, maps::StoreStep& step, maps::StoreWriter& writer) {
    step.map = std::make_shared<maps::MapChanges>(map.map->changes_since(map.map->now()));
    return writer.add(step);
  }

  const RunContext* context_ = nullptr;
  bool enabled_ = true;
  std::optional<cloud::CloudSpool> spool_;
  std::vector<Waiting> waiting_;  ///< for the clouds in the spool or in stored maps
};

}  // namespace

StageType keep_stage() {
  return {"keep",
          "Writes the finished map of several robots with its clouds to map.db",
          Mode::kSerial,
          {{"cloud", keyframe_cloud_port()}, {"map", map_port()}, {"result", cloud_port(), false}},
          {},
          [] { return std::make_unique<KeepStage>(); },
          true};
}

}  // namespace plumbline::pipeline
