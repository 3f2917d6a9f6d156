// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Printed tags as landmarks: AprilTag 36h11 or ArUco in the keyframes' whole pictures that map.db keeps
// (store.images=whole). A map is made without them; they are found when it is adjusted.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/adjust/control.hpp"
#include "plumbline/adjust/place_views.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/maps/stored_maps.hpp"

namespace plumbline::adjust {

/// The middle of a tag, in the frame of results.
struct Tag {
  int id = 0;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  double sigma_m = 0.0;
  PlaceViews seen;
  bool copied = false;  ///< the number is at several places: it says nothing
};

/// tags.yaml.
struct TagControl {
  std::string family = "36h11";          ///< or 4x4, 5x5, 6x6 of ArUco
  std::vector<Control> control;          ///< of tags: kPoint and kLength, without places
  std::vector<std::pair<int, int>> ids;  ///< of p and q
};
/// Errors (kUsage): file, line, what is wrong.
core::Result<TagControl> read_tags(const std::filesystem::path& file);

/// Tags of the first map, by number. Errors (kInput): it has no whole pictures.
core::Result<std::vector<Tag>> find_tags(const maps::StoredMaps& maps, const std::string& family,
                                         const core::Executor& executor);

/// The file's control of tags that were seen at one place; `messages` tells of the others.
std::vector<Control> control_of(const TagControl& told, const std::vector<Tag>& tags,
                                std::vector<std::string>& messages);

/// tags.csv of a map whose lengths have become `scale` times as long.
std::string tags_table(const std::vector<Tag>& tags, const maps::StoredMap& map, double scale);

}  // namespace plumbline::adjust
