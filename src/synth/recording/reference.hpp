// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Dense samples of the true surfaces and what of them the cameras could see.
#include <atomic>
#include <filesystem>
#include <memory>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/synth/source.hpp"
#include "render/world.hpp"

namespace plumbline::synth {

/// Marks blocks (about 2 cm) of every face that were seen whole from some camera pose, within the sensor's
/// range, not at a grazing angle, and where the sensor measures reliably.
class Visibility {
 public:
  Visibility(std::shared_ptr<const World> world, double spacing);
  /// Marks what one source saw, looking through some of its frames.
  void add(const SynthSource& source, const core::Executor& executor, const core::StopToken& stop);
  [[nodiscard]] bool seen(std::size_t face, double u, double v) const;
  /// Share of a face's blocks that were seen.
  [[nodiscard]] double seen_share(std::size_t face) const;
  [[nodiscard]] double block() const { return block_; }

 private:
  struct Grid {
    double u0, v0;
    int columns, rows;
    std::size_t first;  ///< index of its first block
    [[nodiscard]] std::size_t at(int column, int row) const {
      return first + static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
             static_cast<std::size_t>(column);
    }
  };
  void mark(const geometry::Rigid3& world_from_camera, const sensor::Pinhole& camera);
  std::shared_ptr<const World> world_;
  double block_;
  std::vector<Grid> grids_;
  std::vector<std::atomic<std::uint8_t>> flags_;
};

struct ReferenceCounts {
  std::size_t samples = 0;
  std::size_t visible = 0;
};

/// Spacing that keeps reference.ply under some ten million samples, at least 5 mm.
double default_spacing(const Scene& scene);

core::Result<ReferenceCounts> write_reference(const std::filesystem::path& file, const World& world,
                                              const Visibility& visibility, double spacing,
                                              const core::Executor& executor);

}  // namespace plumbline::synth
