// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds of a map after another visit: without what is gone, and without views that show nothing new.
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "plumbline/maps/store.hpp"
#include "plumbline/maps/stored_maps.hpp"

namespace plumbline::pipeline {

struct RevisedClouds {
  using View = std::pair<core::KeyframeId, maps::FrameId>;  ///< one of them is valid
  std::map<View, std::vector<std::uint8_t>> removed;        ///< by point of the cloud: 1 if it goes
  std::set<View> left_out;

  /// Makes the points of a view that go not finite.
  void apply(const View& view, cloud::Cloud& cloud) const;
  /// The clouds that stay, for a store. Errors (kInput): damaged.
  [[nodiscard]] core::Result<maps::StoreCloud> stored(const maps::StoredViews& views, std::size_t view) const;
};

}  // namespace plumbline::pipeline
