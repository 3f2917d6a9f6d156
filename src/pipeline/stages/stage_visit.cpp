// SPDX-License-Identifier: BSD-3-Clause
// visit: another visit of a finished map (docs/method/another_visit.md): what is gone leaves the map, and
// keyframes of the visit that show nothing new are left out. Other maps are passed on unchanged.
#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "plumbline/maps/components.hpp"
#include "plumbline/maps/map_selection.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"
#include "visits/revised_clouds.hpp"
#include "visits/visit_changes.hpp"
#include "visits/visit_thinning.hpp"
#include "visits/visit_weld.hpp"

namespace plumbline::pipeline {
namespace {

class VisitStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }
  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    const auto before = io.input<MapResult>("map");
    if (!context_->input.into) {
      io.output<MapResult>("map", before);
      return {};
    }

    auto result = std::make_shared<MapResult>(*before);

    // The first of the maps is the one that is visited; the robots of all others are visitors.
    for (const maps::StoredPart& part : context_->input.stored_maps->parts()) {
      if (&part == &context_->input.stored_maps->parts().front()) continue;
      for (const RobotInfo& robot : part.robots) visitors_.insert(robot.number);
    }

    for (const core::KeyframeId id : before->map->keyframe_ids()) keyframes_ += visitors_.count(id.robot);
    auto revised = std::make_shared<RevisedClouds>();

    // The poses of the earlier map are restored before surfaces are compared, so that its coordinates stay
    // valid.
    const maps::StoredMap& earlier = context_->input.stored_maps->parts().front().run.stored();
    held_ = hold_earlier(maps::component(earlier.map, maps::main_root(earlier.map, earlier.frames)),
                         visitors_, *result);

    if (keyframes_ > 0) {
      if (auto done = revise(*result, *revised); !done) return done;
    }

    result->revised = std::move(revised);
    result_ = result;

    io.output<MapResult>("map", result);
    return {};
  }

  void report(Json& summary) const override {
    if (!context_->input.into) return;
    summary["keyframes"] = result_->map->keyframe_count();
    summary["landmarks"] = {{"points", result_->map->point_count()}, {"lines", result_->lines.size()}};
    summary["visit"] = {{"joined", keyframes_ > 0},
                        {"held", held_},
                        {"keyframes", keyframes_},
                        {"kept", keyframes_ - left_out_},
                        {"gone_points", gone_points_},
                        {"gone_landmarks", gone_landmarks_},
                        {"new_m2", rounded(kVisitCell_m * kVisitCell_m * static_cast<double>(new_cells_))}};
  }

 private:
  using View = RevisedClouds::View;

  /// Views of the map that have a cloud.
  struct Views {
    std::vector<maps::StoredCloud> clouds;
    std::vector<View> names;
    std::vector<VisitedView> views;
    std::map<core::KeyframeId, std::size_t> of_keyframe;
  };

  [[nodiscard]] Views views_of(const MapResult& map) const {
    Views all;
    std::map<maps::FrameId, geometry::Rigid3> frames;
    for (std::size_t i = 0; i < map.trajectory.size(); ++i)
      frames[map.trajectory_ids[i]] = map.trajectory[i].world_from_camera;

    // Clouds are those of keyframes or of frames in between. Without a pose in the result, as in a component
    // that did not join, a cloud cannot be compared.
    for (const maps::StoredCloud& cloud : context_->input.stored_maps->clouds()) {
      const maps::StoredViews& views = context_->input.stored_maps->views_of(cloud);
      const View name{views.keyframes[cloud.view], views.frames[cloud.view]};

      VisitedView view;
      if (name.first.valid()) {
        if (!map.map->has_keyframe(name.first)) continue;
        view.world_from_camera = map.map->camera_from_world(name.first).inverse();
        all.of_keyframe[name.first] = all.views.size();
      } else {
        const auto found = frames.find(name.second);
        if (found == frames.end()) continue;
        view.world_from_camera = found->second;
      }

      const std::int32_t robot = views.robots[cloud.view];
      view.camera = maps::camera_of(*context_->input.robots, robot).color;
      view.of_visit = visitors_.count(robot) != 0;
      all.clouds.push_back(cloud);
      all.names.push_back(name);
      all.views.push_back(view);
    }

    return all;
  }

  [[nodiscard]] core::Result<cloud::CloudPtr> read(const Views& all, std::size_t v) const {
    const maps::StoredMaps& maps = *context_->input.stored_maps;
    const auto bytes = maps.views_of(all.clouds[v]).bytes(all.clouds[v].view);
    auto cloud = bytes ? cloud::decode_cloud(bytes->data(), bytes->size()) : tl::unexpected(bytes.error());
    if (!cloud) return tl::unexpected(maps.damaged(all.names[v].first, all.names[v].second, cloud.error()));
    return cloud;
  }

  core::Result<void> revise(MapResult& result, RevisedClouds& revised) {
    const Views all = views_of(result);
    auto changes = find_changes(
        all.views, [&](std::size_t v) { return read(all, v); }, *context_->executor);
    if (!changes) return tl::unexpected(changes.error());
    const std::set<core::KeyframeId> redundant =
        redundant_keyframes(*result.map, visitors_, all.of_keyframe, *changes, options_);

    leave_out(all, result, redundant, revised);
    for (std::size_t v = 0; v < all.views.size(); ++v) {
      if (!changes->removed[v].empty()) revised.removed[all.names[v]] = std::move(changes->removed[v]);
    }

    // Gone landmarks are removed before the redundant keyframes, whose observations show which landmarks the
    // visit has seen.
    maps::Map map = *result.map;
    remove_gone(*changes, visitors_, map);
    gone_landmarks_ =
        result.map->point_count() + result.map->line_count() - map.point_count() - map.line_count();

    // Frames are made relative to other keyframes while the poses of their own ones are still in the map.
    refer_to_others(map, redundant, result.frame_poses);
    result.map = std::make_shared<maps::Map>(maps::without(map, redundant));
    take_poses_from_map(result);

    auto& accuracy = result.accuracy.keyframes;
    accuracy.erase(std::remove_if(accuracy.begin(), accuracy.end(),
                                  [&](const auto& of) { return redundant.count(of.keyframe) != 0; }),
                   accuracy.end());

    left_out_ = redundant.size();
    gone_points_ = changes->gone_points;
    new_cells_ = changes->new_cells;
    context_->log->info(fmt::format(
        "the visit is joined to the map{}: {} of its {} keyframes are kept; {} points of the map are gone",
        held_ ? "" : ", in which a new loop closes", keyframes_ - left_out_, keyframes_, gone_points_));
    return {};
  }

  /// Leaves out the clouds of redundant keyframes and of the frames between them.
  void leave_out(const Views& all, const MapResult& map, const std::set<core::KeyframeId>& redundant,
                 RevisedClouds& revised) const {
    std::set<maps::FrameId> frames;
    std::map<std::int32_t, std::int32_t> numbers;  // of frames, by robot
    for (const maps::FramePose& frame : map.frame_poses) {
      const std::int32_t number = numbers[frame.reference.robot]++;
      if (redundant.count(frame.reference) != 0) frames.insert({frame.reference.robot, number});
    }

    for (const View& name : all.names) {
      if (name.first.valid() ? redundant.count(name.first) != 0 : frames.count(name.second) != 0)
        revised.left_out.insert(name);
    }
  }

  const RunContext* context_ = nullptr;
  std::shared_ptr<const MapResult> result_;
  ThinningOptions options_;
  std::set<std::int32_t> visitors_;  ///< robots of the visit
  std::size_t keyframes_ = 0;        ///< of the visit, in the map
  std::size_t left_out_ = 0;
  std::size_t gone_points_ = 0;
  std::size_t gone_landmarks_ = 0;
  std::size_t new_cells_ = 0;
  bool held_ = false;
};

}  // namespace

StageType visit_stage() {
  return stage_type<VisitStage>("visit",
                                "Takes what is gone out of a map that was visited again, and thins the visit",
                                Mode::kSerial, {{"map", map_port()}}, {{"map", map_port()}});
}

}  // namespace plumbline::pipeline
