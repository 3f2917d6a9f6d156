// SPDX-License-Identifier: BSD-3-Clause
#include "visits/visit_thinning.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::pipeline {
namespace {

using core::KeyframeId;

/// Poses of keyframes that are kept, to tell whether one is near another.
class KeptPoses {
 public:
  explicit KeptPoses(const ThinningOptions& options) : options_(options) {}
  void add(const geometry::Rigid3& camera_from_world) { poses_.push_back(camera_from_world.inverse()); }
  [[nodiscard]] bool has_near(const geometry::Rigid3& camera_from_world) const {
    return std::any_of(poses_.begin(), poses_.end(), [&](const geometry::Rigid3& kept) {
      const geometry::Rigid3 between = camera_from_world * kept;
      return between.translation.norm() < options_.apart_m &&
             geometry::rotation_angle(between.rotation) < options_.apart_rad;
    });
  }

 private:
  const ThinningOptions& options_;
  std::vector<geometry::Rigid3> poses_;
};

template <typename Id>
void remove_gone_landmarks(const std::vector<Id>& ids, const VisitChanges& changes,
                           const std::set<std::int32_t>& visitors, maps::Map& map) {
  const auto place = [](const auto& landmark) -> Eigen::Vector3d {
    if constexpr (std::is_same_v<Id, core::PointId>)
      return landmark.position;
    else
      return 0.5 * (landmark.start + landmark.end);
  };
  for (const Id id : ids) {
    const auto& landmark = *std::as_const(map).find(id);
    const bool seen = std::any_of(landmark.observations.begin(), landmark.observations.end(),
                                  [&](const auto& o) { return visitors.count(o.keyframe.robot) != 0; });
    if (!seen && changes.is_gone(place(landmark))) map.remove(id);
  }
}

}  // namespace

void ThinningOptions::declare(core::OptionTable& table) {
  table.boolean("thin", thin, "Leave out keyframes of the visit whose view the map holds");
  table.number("share_new", share_new, {0.0, 1.0}, "", "Keep keyframes with a larger share of new surface");
  table.integer("views", views, {1, 1000}, "", "Keep other new surface in this many keyframes");
  table.integer("cells", cells, {1, 100000}, "", "Smallest number of 3 cm cells that such a keyframe adds");
  table.number("apart", apart_m, {0.0, 100.0}, "m",
               "Keep keyframes that have no other one within this distance");
  table.number("turned", apart_rad, {0.0, 3.2}, "rad", "and turned by less than this");
}

std::set<KeyframeId> redundant_keyframes(const maps::Map& map, const std::set<std::int32_t>& visitors,
                                         const std::map<KeyframeId, std::size_t>& views,
                                         const VisitChanges& changes, const ThinningOptions& options) {
  std::set<KeyframeId> redundant;
  if (!options.thin) return redundant;
  KeptPoses poses(options);
  std::vector<int> covered(changes.new_cells, 0);  // keyframes that show a new cell
  std::set<std::int32_t> begun;

  // Keyframes of the map are all kept: a visit needs views of its own only where none of them is near.
  for (const KeyframeId id : map.keyframe_ids()) {
    if (visitors.count(id.robot) == 0) poses.add(map.camera_from_world(id));
  }

  for (const KeyframeId id : map.keyframe_ids()) {
    if (visitors.count(id.robot) == 0) continue;

    // First keyframes and roots hold the map together, and what a keyframe without a cloud shows is not
    // known: all of these stay.
    const auto view = views.find(id);
    bool keep = begun.insert(id.robot).second || view == views.end() || !map.parent(id).valid();

    if (!keep) {
      const auto& shows = changes.shows[view->second];
      const auto adds = std::count_if(shows.begin(), shows.end(),
                                      [&](std::uint32_t cell) { return covered[cell] < options.views; });
      keep = changes.share_new[view->second] > options.share_new || adds >= options.cells ||
             !poses.has_near(map.camera_from_world(id));
    }

    if (!keep) {
      redundant.insert(id);
      continue;
    }

    // Kept keyframes count for the following ones, which need not show the same surface again.
    poses.add(map.camera_from_world(id));
    if (view == views.end()) continue;
    for (const std::uint32_t cell : changes.shows[view->second]) ++covered[cell];
  }
  return redundant;
}

void refer_to_others(const maps::Map& map, const std::set<KeyframeId>& gone,
                     std::vector<maps::FramePose>& frames) {
  std::map<std::int32_t, std::vector<KeyframeId>> kept;  // by robot
  for (const KeyframeId id : map.keyframe_ids()) {
    if (gone.count(id) == 0) kept[id.robot].push_back(id);
  }

  for (maps::FramePose& frame : frames) {
    if (gone.count(frame.reference) == 0) continue;
    const std::vector<KeyframeId>& others = kept.at(frame.reference.robot);

    // The nearest keyframe in time most probably shows the same place, so adjustments move both alike.
    const KeyframeId nearest =
        *std::min_element(others.begin(), others.end(), [&](KeyframeId x, KeyframeId y) {
          return std::abs(map.keyframe(x).stamp - frame.stamp) <
                 std::abs(map.keyframe(y).stamp - frame.stamp);
        });

    // The pose in the world stays as it was; only its reference changes.
    frame.camera_from_reference = frame.camera_from_reference * map.camera_from_world(frame.reference) *
                                  map.camera_from_world(nearest).inverse();
    frame.reference = nearest;
    frame.seen = nullptr;
  }
}

void remove_gone(const VisitChanges& changes, const std::set<std::int32_t>& visitors, maps::Map& map) {
  remove_gone_landmarks(map.point_ids(), changes, visitors, map);
  remove_gone_landmarks(map.line_ids(), changes, visitors, map);

  for (const KeyframeId id : map.keyframe_ids()) {
    if (visitors.count(id.robot) != 0) continue;
    const geometry::Rigid3 world_from_camera = map.camera_from_world(id).inverse();
    const auto is_gone = [&](const maps::SurfaceSample& sample) {
      return changes.is_gone(world_from_camera * sample.point.cast<double>());
    };
    const std::vector<maps::SurfaceSample>& surface = map.keyframe(id).surface;
    if (std::none_of(surface.begin(), surface.end(), is_gone)) continue;

    auto keyframe = std::make_shared<maps::Keyframe>(map.keyframe(id));
    auto& left = keyframe->surface;
    left.erase(std::remove_if(left.begin(), left.end(), is_gone), left.end());
    map.replace_keyframe(std::move(keyframe));
  }
}

}  // namespace plumbline::pipeline
