// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Connected components of a map. A robot that got lost continues in a new component with its own origin:
// poses of different components are unrelated until the components are joined. Each component is one tree of
// keyframes (Map::parent).
#include <vector>

#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

/// The root of the tree in which a keyframe is; std::out_of_range when it is not in the map.
[[nodiscard]] core::KeyframeId root_of(const Map& map, core::KeyframeId keyframe);

/// Roots of all components, ascending.
[[nodiscard]] std::vector<core::KeyframeId> roots(const Map& map);

/// The component with this root as a map of its own: ids stay, and the next ids are those of the whole.
/// Edges, loops and observations that lead out of it are left out.
[[nodiscard]] Map component(const Map& map, core::KeyframeId root);

/// Moves the keyframes, points and lines of the component with this root by new_from_old of their world.
void move_component(Map& map, core::KeyframeId root, const geometry::Rigid3& new_from_old_world);

/// Cuts the component of `first` in two: `first` becomes the root of everything its robot made from then on.
/// The other keyframes' landmarks are no longer seen there, and nothing connects the two parts: loops between
/// them are removed, and other edges have no effect. Nothing happens if `first` is a root.
void split_component(Map& map, core::KeyframeId first);

/// All of the robots' frames, so that their numbers (FrameId) are kept; those whose reference keyframe is not
/// in `map` are not tracked.
[[nodiscard]] std::vector<FramePose> frames_in(const Map& map, std::vector<FramePose> frames);

/// The root of the component in which most frames are tracked; of several the lowest. The map has keyframes.
[[nodiscard]] core::KeyframeId main_root(const Map& map, const std::vector<FramePose>& frames);

}  // namespace plumbline::maps
