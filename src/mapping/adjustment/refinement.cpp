// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/adjustment/refinement.hpp"

#include <fmt/format.h>

namespace plumbline::mapping {
namespace {

/// Local maps that overlap, aligned by ICP: edges between their anchors.
std::vector<PoseEdge> align_local_maps(const maps::Map& map,
                                       const std::map<core::KeyframeId, CoarseSurface>& surfaces,
                                       const RefinementOptions& options, const core::Executor& executor,
                                       core::Log& log, RefinementSummary& counts) {
  // Pairs are chosen by where they lie, not by when they were made, so that revisits are aligned, too.
  const auto local_maps = make_local_maps(map, surfaces, options.local_maps, executor);
  const auto pairs = overlapping_pairs(map, local_maps, options.pairs, executor);
  const auto alignments = align_pairs(map, local_maps, pairs, options.alignment, executor);
  auto edges = to_edges(local_maps, pairs, alignments);
  counts.local_maps = local_maps.size();
  counts.tried = pairs.size();
  counts.accepted = edges.size();

  // Only accepted alignments count for the mean residual; the log has the reasons against the others.
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const SurfaceAlignment& a = alignments[i];
    if (a.refused.empty()) counts.mean_rms += a.rms / static_cast<double>(edges.size());
    log.debug(
        fmt::format("refine: local maps {} and {}: overlap {:.2f}, {} samples, rms {:.2f}, {} "
                    "directions held, moved by {:.1f} mm{}{}",
                    pairs[i].a, pairs[i].b, a.overlap, a.inliers, a.rms, a.held, 1e3 * a.shift_m,
                    a.refused.empty() ? "" : "; not used: ", a.refused));
  }

  return edges;
}

void count(const GlobalAdjustmentSummary& adjusted, RefinementSummary& counts) {
  for (std::size_t i = 0; i < std::min(counts.accepted, adjusted.extra.size()); ++i)
    counts.rejected += adjusted.extra[i].rejected ? 1U : 0U;
  counts.mean_shift_m = adjusted.mean_shift_m;
  counts.max_shift_m = adjusted.max_shift_m;
  counts.refused = static_cast<std::size_t>(adjusted.refused);
  counts.before = adjusted.bundle.before;
  counts.after = adjusted.bundle.after;
}

void tell(const GlobalAdjustmentSummary& adjusted, std::size_t edges, core::Log& log) {
  if (adjusted.refused > 0) log.warning("refine: not put into the map: " + adjusted.refusal);
  if (!adjusted.changed) log.warning("refine: the map is not changed: " + adjusted.message);
  log.debug(
      fmt::format("refine: {} keyframes, {} points, {} lines, {} surface edges, {} alignments and loops; "
                  "{} iterations; moved by {:.1f} mm on average, {:.1f} mm at most",
                  adjusted.keyframes, adjusted.points, adjusted.lines, adjusted.surface_edges, edges,
                  adjusted.bundle.iterations, 1e3 * adjusted.mean_shift_m, 1e3 * adjusted.max_shift_m));
}

}  // namespace

void RefinementOptions::declare(core::OptionTable& table) {
  table.boolean("icp", icp, "Align the surfaces of local maps that overlap, revisits included");
  table.boolean("adjust", adjust, "Adjust all keyframes and landmarks together, with these alignments");
  local_maps.declare(table);
  pairs.declare(table);
  alignment.declare(table);
  adjustment.declare(table);
  table.boolean("accuracy", accuracy, "Compute the accuracy of the keyframes (columns sigma)");
}

Refinement refine_map(maps::Map& map, const std::map<core::KeyframeId, CoarseSurface>& surfaces,
                      const Cameras& cameras, const RefinementOptions& options,
                      const core::Executor& executor, core::Log& log) {
  Refinement result;
  std::vector<PoseEdge> edges;
  if (options.icp) edges = align_local_maps(map, surfaces, options, executor, log, result.summary);

  // Loops that were closed while mapping stay in the adjustment, so that it cannot undo them. They follow the
  // alignments, which count() expects first.
  const std::vector<PoseEdge> loops = loop_edges(map);
  edges.insert(edges.end(), loops.begin(), loops.end());
  const GlobalAdjustmentSummary adjusted = adjust_map(map, cameras, edges, options.adjustment);
  count(adjusted, result.summary);
  tell(adjusted, edges.size(), log);

  if (!options.accuracy) {
    result.accuracy.missing = "refine.accuracy is off";
    return result;
  }

  // Edges that the pose graph rejected must not make the map look more accurate than it is.
  result.accuracy =
      keyframe_accuracy(map, cameras, believed_edges(edges, adjusted.extra), options.adjustment);
  if (!result.accuracy.missing.empty())
    log.warning("refine: standard deviations (sigma) are not known: " + result.accuracy.missing);
  return result;
}

}  // namespace plumbline::mapping
