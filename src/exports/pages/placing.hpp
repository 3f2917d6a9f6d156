// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The pose of a second map in the frame of a first one.
#include <optional>
#include <string>
#include <vector>

#include "plumbline/viewer/scene.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// Two maps of the same recording: cameras of the same robot and stamp.
struct CommonPoses {
  geometry::Rigid3 first_from_second;
  std::size_t count = 0;
  double rms_m = 0.0;  ///< distance of the cameras' positions once aligned
};

/// Empty: fewer than three cameras have a partner, or they are so far apart that equal stamps are chance, as
/// between generated recordings, which all begin at the same time.
std::optional<CommonPoses> common_poses(const std::vector<ExportPose>& first,
                                        const std::vector<ExportPose>& second);

struct Placement {
  geometry::Rigid3 first_from_second;
  std::string how;  ///< a sentence for people: by what, and how well they fit
};

/// By cameras of the same stamp; else by places that both maps show (docs/method/merging.md), and then by ICP
/// of the clouds. Where one of the two is only a cloud, from where the files lie, by ICP alone. `first`,
/// `second`: their points. Errors: kUntrustworthy: nothing shows how they lie; those of reading the maps.
/// `by_cameras`: cameras of the same stamp may be used.
core::Result<Placement> place_second(const MapSource& one, const viewer::Points& first,
                                     const MapSource& other, const viewer::Points& second, bool by_cameras);

}  // namespace plumbline::exports
