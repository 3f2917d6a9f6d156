// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Changes between two surfaces that were laid together (docs/guide/changes.md).
#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "plumbline/changes/distances.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::changes {

struct ChangeOptions {
  DistanceOptions distance;
  double spacing_m = 0.03;    ///< of core points
  double min_size_m = 0.1;    ///< smallest extent of a change that is listed
  double min_shift_m = 0.01;  ///< smallest shift of a surface that is listed
  void declare(core::OptionTable& table);
};

/// State of one place of a surface.
enum class PlaceKind : std::uint8_t { kSame, kShifted, kAppeared, kVanished, kNotSeenBefore, kNotSeenAfter };
const char* name_of(PlaceKind kind);  ///< "same", "shifted", ..., "not seen after"

/// A core point, of the earlier surface, or of the later one where the earlier has nothing.
struct Place {
  Eigen::Vector3f at{0, 0, 0}, normal{0, 0, 1};  ///< metres
  PlaceKind kind = PlaceKind::kSame;
  bool later = false;  ///< of the later surface
  Distance distance;   ///< not known unless kSame or kShifted
  int change = -1;     ///< index of the change that it is part of; -1: of none
};

enum class ChangeKind { kAppeared, kVanished, kMoved, kShifted };
const char* name_of(ChangeKind kind);  ///< "appeared", ...

/// Connected places that changed in one way.
struct Change {
  ChangeKind kind = ChangeKind::kAppeared;
  Eigen::AlignedBox3d before, after;  ///< what was seen of it then; empty: it was not there
  std::size_t places = 0;
  double area_m2 = 0.0;    ///< of its places
  double volume_m3 = 0.0;  ///< of its box; of what shifted, its area times the way
  double sigma_m = 0.0;    ///< standard deviation of the way, or of the place
  // For things that moved: p_after = after_from_before * p_before. For a shift: the median along the normal.
  geometry::Rigid3 after_from_before;
  double turn_rad = 0.0;  ///< about the vertical, counter-clockwise
  double shift_m = 0.0;   ///< of what shifted signed: towards the side that it is seen from
  double limit_m = 0.0;   ///< of what shifted: the median of the 95 % detection limits
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of what shifted
  [[nodiscard]] const Eigen::AlignedBox3d& box() const { return after.isEmpty() ? before : after; }
};

struct Comparison {
  std::vector<Place> places;
  std::vector<Change> changes;  ///< largest first
  double registration_m = 0.0;  ///< standard deviation
  double median_limit_m = 0.0;  ///< of all detection limits
  double agreement = 0.0;       ///< share of places of both surfaces that lie within 3 cm of each other
  std::array<std::size_t, 6> counts{};  ///< places by kind
};

/// For each point whether a map's cameras looked through it. Null: nobody knows.
using LookedThrough = std::function<std::vector<std::uint8_t>(const std::vector<Eigen::Vector3f>& points)>;

/// `up` points upwards in the frame of both surfaces. What one surface lacks has vanished or appeared only
/// where the other's cameras looked through it. The same for any number of threads.
Comparison find_changes(const SurfacePair& surfaces, const LookedThrough& through_before,
                        const LookedThrough& through_after, const Eigen::Vector3d& up,
                        const ChangeOptions& options, const core::Executor& executor);

}  // namespace plumbline::changes
