// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds of a run until their final poses are known.
#include <filesystem>
#include <optional>

#include "plumbline/maps/stored_views.hpp"
#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/graph.hpp"

namespace plumbline::pipeline {

/// True if some stage keeps all clouds that the graph fuses in map.db.
bool keeps_clouds(const Graph& graph);

/// Clouds of a run until their final poses are known: in its map.db, where a stage keeps it, else in a
/// temporary store beside the results.
class WaitingClouds {
 public:
  /// Errors (kOutput): no file can be made in the result's folder.
  static core::Result<WaitingClouds> create(const RunContext& context);
  /// Notes a cloud, and stores it unless a stage does. Errors (kOutput): disk full.
  core::Result<void> append(const KeyframeCloud& cloud);
  /// All clouds, once every one was appended. Errors (kInput): they cannot be read back.
  core::Result<const maps::StoreReader*> open();
  [[nodiscard]] const maps::Arrivals& arrivals() const { return arrivals_; }
  /// Removes the temporary store.
  void clear();

 private:
  std::filesystem::path file_;
  std::optional<maps::StoreWriter> writer_;  ///< of a temporary store
  std::optional<maps::StoreReader> reader_;
  maps::Arrivals arrivals_;
};

}  // namespace plumbline::pipeline
