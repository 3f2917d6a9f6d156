// SPDX-License-Identifier: BSD-3-Clause
// store: the maps as map.db while the run goes, so that a run that ends early has lost nothing.
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/version.hpp"
#include "plumbline/dataset/jpeg.hpp"
#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/map_join.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "results/frame_rows.hpp"
#include "results/resumed_run.hpp"
#include "stages/stages.hpp"
#include "visits/revised_clouds.hpp"

namespace plumbline::pipeline {
namespace {

/// Pictures of keyframes that are kept.
enum class Images { kAuto, kSmall, kWhole, kOff };
constexpr int kWholeQuality = 95;  // of JPEG files: no loss that an eye or a matcher finds

class StoreStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean(
        "enabled", enabled_,
        "Write map.db, the map with its clouds, during the run, so that an interrupted run can be continued");
    table.choice<Images>(
        "images", images_,
        {{"auto", Images::kAuto},
         {"small", Images::kSmall},
         {"whole", Images::kWhole},
         {"off", Images::kOff}},
        "Pictures of keyframes in map.db: 160 pixels wide, or whole as well; auto: whole for "
        "live cameras, whose pictures are kept nowhere else");
  }
  [[nodiscard]] std::vector<std::string> files() const override {
    return enabled_ ? std::vector<std::string>{maps::kStoreFile} : std::vector<std::string>{};
  }
  [[nodiscard]] bool keeps_map() const override { return enabled_; }

  core::Result<void> start(const RunContext& context) override {
    if (!enabled_) return {};
    context_ = &context;
    const RobotRecordings* recordings = context.input.recordings;
    whole_ = images_ == Images::kWhole ||
             (images_ == Images::kAuto && recordings != nullptr && recordings->live() != nullptr);
    if (context.resumed != nullptr) return take(maps::StoreWriter::resume(context.resumed->store));
    maps::StoreHeader header;
    header.robots = *context.input.robots;
    header.configuration = context.store.configuration;
    header.input = context.input.text;
    header.program_version = core::version();
    // Fusing finished maps always starts from the beginning after an interruption.
    const auto use =
        context.input.stored_maps != nullptr ? maps::StoreUse::kInOneGo : maps::StoreUse::kGrowing;
    return take(maps::StoreWriter::create(context.output_folder / maps::kStoreFile, header, use));
  }

  /// One transaction a keyframe, with what came of its robot since the last one; other clouds have their
  /// own, for stages at the end read them from the file.
  core::Result<void> process(StageIo& io) override {
    if (!writer_) return {};
    const auto track = io.input<TrackedFrame>("track");
    const auto cloud = io.input<KeyframeCloud>("cloud");

    // Clouds of a map that is visited again are written at the end, when it is known which of their points
    // are gone.
    std::vector<maps::StoreCloud> clouds;
    if (cloud != nullptr && !context_->input.into && (cloud->id.valid() || cloud->frame.valid())) {
      auto waiting = store_cloud_of(*cloud);
      if (!waiting) return tl::unexpected(waiting.error());
      clouds.push_back(std::move(*waiting));
    }

    // Frames wait for the next keyframe, so that the store of an interrupted run ends with a keyframe and can
    // be continued there.
    if (track != nullptr) {
      maps::StoreStep& step = steps_[track->robot];
      step.robot = track->robot;
      step.log.push_back(to_line(track->row));
      if (track->pose) step.frames.push_back(*track->pose);

      if (track->keyframe.valid()) {
        if (const auto frame = io.input<sensor::RgbdFrame>("frame"))
          add_picture(track->keyframe, frame->color, step.pictures);
        return add(std::exchange(step, {}), *track, std::move(clouds));
      }
    }
    return clouds.empty() ? core::Result<void>() : writer_->add_cloud(clouds.front());
  }

  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("map");
    if (!writer_ || map->map == nullptr) return {};

    // The frame of the results is stored, so that later exports and visits have the same coordinates.
    maps::ResultFrame frame;
    if (const auto dense = io.input<DenseCloud>("result")) {
      frame = {dense->output_from_map, dense->upright};
      if (dense->state != nullptr) {
        if (auto kept = writer_->attach(maps::kFusionAttachment, to_bytes(*dense->state)); !kept) return kept;
      }
    }

    if (map->revised != nullptr) {
      if (auto added = add_revised(*map->revised); !added) return added;
    }

    // Frames after the last keyframe are not stored yet, nor are pictures for a camera that was found later.
    std::vector<maps::StoreStep> rest;
    for (auto& [robot, step] : steps_) rest.push_back(std::move(step));
    rest.emplace_back();
    rest.back().pictures =
        context_->input.stored_maps != nullptr ? stored_pictures(*map) : corrected_pictures(*map);

    auto saved = map->apart.empty()
                     ? writer_->save_final(*map->map, map->frame_poses, frame, rest, map->robots)
                     : writer_->save_final(with_components(*map), frames_with_components(*map), frame, rest,
                                           robots_with_components(*map));
    writer_.reset();
    return saved;
  }

 private:
  core::Result<void> take(core::Result<maps::StoreWriter> writer) {
    if (!writer) return tl::unexpected(writer.error());
    writer_.emplace(std::move(*writer));
    return {};
  }
  core::Result<void> add(maps::StoreStep step, const TrackedFrame& track,
                         std::vector<maps::StoreCloud> clouds) {
    if (track.changes == nullptr) {
      return core::usage_error(
          "store: only a map that was tracked can be stored; remove this stage where poses come from a file");
    }
    step.map = track.changes;
    step.robots = track.robots;
    if (track.frames_anew != nullptr) {
      step.frames = *track.frames_anew;
      step.frames_anew = true;
    }
    step.clouds = std::move(clouds);
    return writer_->add(step);
  }

  void add_picture(core::KeyframeId keyframe, const cv::Mat& color,
                   std::vector<maps::StorePicture>& pictures) const {
    if (images_ == Images::kOff || color.empty()) return;
    maps::StorePicture picture{keyframe, dataset::encode_small_jpeg(color), {}};
    if (whole_) picture.whole = dataset::encode_jpeg(color, kWholeQuality);
    pictures.push_back(std::move(picture));
  }

  /// The clouds of a map that was visited again.
  core::Result<void> add_revised(const RevisedClouds& revised) {
    for (const maps::StoredCloud& stored : context_->input.stored_maps->clouds()) {
      const maps::StoredViews& views = context_->input.stored_maps->views_of(stored);
      if (revised.left_out.count({views.keyframes[stored.view], views.frames[stored.view]}) != 0) continue;
      const auto cloud = revised.stored(views, stored.view);
      if (!cloud) return tl::unexpected(cloud.error());
      if (auto added = writer_->add_cloud(*cloud); !added) return added;
    }
    return {};
  }

  /// Whole pictures of keyframes that were rectified with an earlier version of their camera, again.
  [[nodiscard]] std::vector<maps::StorePicture> corrected_pictures(const MapResult& map) const {
    std::vector<maps::StorePicture> pictures;
    if (!whole_ || context_->input.recordings == nullptr) return pictures;
    for (const RobotInfo& robot : map.robots) {
      if (robot.versions.empty()) continue;
      const maps::CameraVersion& newest = robot.versions.back();
      const auto source = context_->input.recordings->taken_by(robot.number, newest.camera);
      if (source == nullptr) continue;
      for (const core::KeyframeId id : map.map->keyframe_ids()) {
        if (id.robot != robot.number || id.index >= newest.first_keyframe) continue;
        const auto frame = source->read(static_cast<std::size_t>(map.map->keyframe(id).frame_index));
        if (frame) add_picture(id, frame->color, pictures);
      }
    }
    return pictures;
  }

  /// Pictures of the stores that finished maps were read from.
  [[nodiscard]] std::vector<maps::StorePicture> stored_pictures(const MapResult& map) const {
    std::vector<maps::StorePicture> pictures;
    if (images_ == Images::kOff) return pictures;
    for (const maps::StoredCloud& cloud : context_->input.stored_maps->clouds()) {
      const maps::StoredViews& views = context_->input.stored_maps->views_of(cloud);
      const core::KeyframeId id = views.keyframes[cloud.view];
      if (!id.valid() || (map.revised != nullptr && map.revised->left_out.count({id, {}}) != 0)) continue;
      const core::KeyframeId stored = views.stored_keyframe(cloud.view);
      const auto small = views.reader->small_picture(stored);
      const auto whole = views.reader->whole_picture(stored);
      if (small && whole && !small->empty()) pictures.push_back({id, *small, *whole});
    }
    return pictures;
  }

  /// All components as one map; each keeps its own frame, given by its tree.
  static maps::Map with_components(const MapResult& map) {
    std::vector<const maps::Map*> all{map.map.get()};
    for (const auto& component : map.apart) all.push_back(component->map.get());
    return maps::joined(all, std::vector<geometry::Rigid3>(all.size()));
  }
  static std::vector<RobotInfo> robots_with_components(const MapResult& map) {
    std::vector<RobotInfo> robots = map.robots;
    for (const auto& component : map.apart) {
      for (const RobotInfo& robot : component->robots) {
        const auto same = [&](const RobotInfo& other) { return other.number == robot.number; };
        if (std::none_of(robots.begin(), robots.end(), same)) robots.push_back(robot);
      }
    }
    return robots;
  }
  static std::vector<maps::FramePose> frames_with_components(const MapResult& map) {
    std::vector<maps::FramePose> frames = map.frame_poses;
    for (const auto& component : map.apart) {
      std::size_t begin = 0;
      const std::int32_t robot = component->robots.front().number;
      while (begin < frames.size() && frames[begin].reference.robot != robot) ++begin;

      // In a fusion, a robot may have no component in the main map.
      if (begin == frames.size()) {
        frames.insert(frames.end(), component->frame_poses.begin(), component->frame_poses.end());
        continue;
      }
      for (std::size_t i = 0; i < component->frame_poses.size(); ++i) {
        if (component->frame_poses[i].tracked) frames[begin + i] = component->frame_poses[i];
      }
    }
    return frames;
  }

  bool enabled_ = true;
  Images images_ = Images::kAuto;
  bool whole_ = false;  ///< whole pictures are kept
  const RunContext* context_ = nullptr;
  std::optional<maps::StoreWriter> writer_;
  std::map<std::int32_t, maps::StoreStep> steps_;  ///< since each robot's last keyframe
};

}  // namespace

StageType store_stage() {
  return stage_type<StoreStage>(
      "store", "Writes the maps to map.db during the run, one transaction per keyframe", Mode::kSerial,
      {{"track", track_port(), false},
       {"cloud", keyframe_cloud_port(), false},
       {"frame", frame_port(), false},
       {"map", map_port()},
       {"result", cloud_port(), false}},
      {}, true);
}

}  // namespace plumbline::pipeline
