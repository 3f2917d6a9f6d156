// SPDX-License-Identifier: BSD-3-Clause
// store: the map as map.db while the run goes, so that a run that ends early has lost nothing.
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "plumbline/core/version.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/maps/store.hpp"
#include "resumed_run.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

class StoreStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean(
        "enabled", enabled_,
        "Write map.db, the map with its clouds, as the run goes: what a run that was ended can go on "
        "from");
  }
  [[nodiscard]] std::vector<std::string> files() const override {
    return enabled_ ? std::vector<std::string>{kStoreFile} : std::vector<std::string>{};
  }
  [[nodiscard]] bool wants_map_changes() const override { return enabled_; }

  core::Result<void> start(const RunContext& context) override {
    if (!enabled_) return {};
    if (context.resumed != nullptr) {
      frames_ = context.resumed->map.frames.size();
      return take(maps::StoreWriter::resume(context.resumed->store));
    }
    maps::StoreHeader header;
    header.camera = context.source->camera();
    header.configuration = context.configuration;
    header.input = context.input;
    header.robot = context.source->name();
    header.program_version = core::version();
    return take(maps::StoreWriter::create(context.output_folder / kStoreFile, header));
  }

  /// One transaction a keyframe; what comes between waits for the next one.
  core::Result<void> process(StageIo& io) override {
    if (!writer_) return {};
    const auto track = io.input<TrackedFrame>("track");
    step_.log.push_back(to_line(track->row));
    if (track->pose) step_.frames.push_back(*track->pose);
    if (const auto cloud = io.input<KeyframeCloud>("cloud")) keep_cloud(*track, *cloud);
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
    if (!writer_) return {};
    const auto map = io.input<MapResult>("map");
    if (map->map == nullptr) return {};
    maps::ResultFrame frame;
    if (const auto dense = io.input<DenseCloud>("result")) {
      frame = {dense->output_from_map, dense->upright};
    }
    auto saved = writer_->save_final(*map->map, map->frame_poses, frame, step_);
    writer_.reset();
    return saved;
  }

 private:
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

  bool enabled_ = true;
  std::optional<maps::StoreWriter> writer_;
  maps::StoreStep step_;    ///< since the last keyframe
  std::size_t frames_ = 0;  ///< in the store
};

}  // namespace

StageType store_stage() {
  return {"store",
          "Keeps the map in map.db as the run goes: one transaction a keyframe",
          Mode::kSerial,
          {{"track", track_port()},
           {"cloud", keyframe_cloud_port(), false},
           {"map", map_port()},
           {"result", cloud_port(), false}},
          {},
          [] { return std::make_unique<StoreStage>(); },
          true};
}

}  // namespace plumbline::pipeline
