// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Views that clouds are laid down from: poses of a map, and clouds that lie in a store.
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "plumbline/maps/store.hpp"
#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/graph.hpp"

namespace plumbline::pipeline {

/// All that have a cloud and a pose: keyframes by id, then frames between them.
struct StoredViews {
  const maps::StoreReader* reader = nullptr;
  std::vector<core::KeyframeId> keyframes;  ///< invalid: a frame's
  std::vector<maps::FrameId> frames;
  std::vector<geometry::Rigid3> world_from_camera;
  std::vector<std::int32_t> robots;
  std::vector<double> stamps;

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
  /// A view's cloud; from several threads at a time. Errors (kInput): damaged.
  [[nodiscard]] core::Result<cloud::CloudPtr> read(std::size_t view) const;
};

/// When clouds of frames came; those that are not there came before.
using Arrivals = std::map<maps::FrameId, std::size_t>;

/// `reader` must outlive the views. Frames stand in the order of their arrival, else by robot and order: sums
/// of a dense cloud are rounded as they come. Errors (kInput): damaged.
core::Result<StoredViews> views_of(const maps::StoreReader& reader, const MapResult& map,
                                   const Arrivals& arrivals = {});

/// Whether a stage keeps the clouds that the graph lays down, all of them, in map.db.
bool keeps_clouds(const Graph& graph);

/// Clouds of a run until their final poses are known: in its map.db, where a stage keeps it, else in a
/// temporary store beside the results.
class WaitingClouds {
 public:
  /// Errors (kOutput): no file can be made in the result's folder.
  static core::Result<WaitingClouds> create(const RunContext& context);
  /// Notes a cloud, and keeps it where nobody else does. Errors (kOutput): disk full.
  core::Result<void> append(const KeyframeCloud& cloud);
  /// All that came, when all have come. Errors (kInput): they cannot be read back.
  core::Result<const maps::StoreReader*> open();
  [[nodiscard]] const Arrivals& arrivals() const { return arrivals_; }
  /// Removes the temporary store.
  void clear();

 private:
  std::filesystem::path file_;
  std::optional<maps::StoreWriter> writer_;  ///< of a temporary store
  std::optional<maps::StoreReader> reader_;
  Arrivals arrivals_;
};

}  // namespace plumbline::pipeline
