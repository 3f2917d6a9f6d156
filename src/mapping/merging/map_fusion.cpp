// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/merging/map_fusion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr std::size_t kAroundPair = 4;  // keyframes around each end of a pair whose landmarks are compared

/// Poses of the parts in the anchor's group, and the keyframes that tie them together.
struct Layout {
  std::map<std::size_t, Rigid3> anchor_from_part;
  /// Root of a part, and the keyframe that becomes its parent.
  std::vector<std::pair<KeyframeId, KeyframeId>> ties;
};

/// Connects a part to those placed already, by the pair of keyframes that share most.
std::pair<KeyframeId, KeyframeId> tie_of(const MergeEvidence& merge, const maps::Map& part) {
  const auto share = [](const VerifiedPair& pair) { return pair.evidence.points + 2 * pair.evidence.lines; };
  const auto best =
      std::max_element(merge.pairs.begin(), merge.pairs.end(),
                       [&](const VerifiedPair& x, const VerifiedPair& y) { return share(x) < share(y); });
  const bool query_in_part = part.has_keyframe(best->query);
  const KeyframeId inside = query_in_part ? best->query : best->match;
  return {maps::root_of(part, inside), query_in_part ? best->match : best->query};
}

/// Places the parts along a spanning tree of merges, those with most pairs first.
Layout lay_out(const std::vector<MapPart>& parts, const std::vector<MergeEvidence>& merges,
               std::size_t anchor) {
  std::vector<const MergeEvidence*> order;
  for (const MergeEvidence& merge : merges) {
    if (merge.accepted) order.push_back(&merge);
  }
  std::stable_sort(order.begin(), order.end(), [](const MergeEvidence* x, const MergeEvidence* y) {
    return x->pairs.size() > y->pairs.size();
  });

  Layout layout;
  auto& anchor_from_part = layout.anchor_from_part;
  anchor_from_part[anchor] = {};

  for (bool grown = true; grown;) {
    grown = false;
    for (const MergeEvidence* merge : order) {
      const bool has_a = anchor_from_part.count(merge->a) != 0;
      const bool has_b = anchor_from_part.count(merge->b) != 0;

      // A merge attaches a part only if exactly one of its ends has a place;
      // with both it would close a circle.
      if (has_a == has_b) continue;

      if (has_a) {
        anchor_from_part[merge->b] = anchor_from_part[merge->a] * merge->alignment.a_from_b;
      } else {
        anchor_from_part[merge->a] = anchor_from_part[merge->b] * merge->alignment.a_from_b.inverse();
      }

      if (!merge->pairs.empty())
        layout.ties.push_back(tie_of(*merge, *parts[has_a ? merge->b : merge->a].map));
      grown = true;
      break;  // start again with the best remaining merge
    }
  }

  return layout;
}

/// The pairs of one merge as edges of the pose graph.
std::vector<PoseEdge> edges_of(const MergeEvidence& merge) {
  std::vector<PoseEdge> edges;
  for (const VerifiedPair& pair : merge.pairs) {
    edges.push_back(
        {pair.match, pair.query, pair.evidence.query_from_match, pair.evidence.information, false});
  }
  return edges;
}

std::vector<KeyframeId> surroundings(const maps::Map& map, KeyframeId id) {
  std::vector<KeyframeId> result{id};
  for (const KeyframeId other : map.neighbours(id, map.keyframe_count())) {
    if (result.size() > kAroundPair) break;
    if (other.robot == id.robot) result.push_back(other);
  }
  return result;
}

/// Merges landmarks that exist around both ends of an edge.
void merge_duplicates(const PoseEdge& edge, const MapFusionOptions& options,
                      std::set<std::pair<KeyframeId, KeyframeId>>& done, FusedMap& fused) {
  const std::vector<KeyframeId> ours = surroundings(fused.map, edge.a);
  for (const KeyframeId id : surroundings(fused.map, edge.b)) {
    std::vector<KeyframeId> others;
    for (const KeyframeId other : ours) {
      if (other != id && done.emplace(std::min(id, other), std::max(id, other)).second)
        others.push_back(other);
    }
    if (others.empty()) continue;
    fused.merged_points += fuse_points(fused.map, id, others, fused.cameras, options.doubles).merged;
    fused.merged_lines += fuse_lines(fused.map, id, others, fused.cameras, options.doubles).merged;
  }
}

/// Takes back merges of which the pose graph rejects most pairs; true if there were any.
bool take_back(const std::vector<optimize::EdgeVerdict>& verdicts, const std::vector<MergeEvidence*>& used,
               FusedMap& fused) {
  bool any = false;
  std::size_t at = 0;
  for (MergeEvidence* merge : used) {
    merge->rejected = 0;
    for (std::size_t i = 0; i < merge->pairs.size() && at < verdicts.size(); ++i, ++at) {
      merge->rejected += verdicts[at].rejected ? 1 : 0;
    }
    fused.rejected += merge->rejected;
    if (2 * merge->rejected <= static_cast<int>(merge->pairs.size())) continue;
    merge->accepted = false;
    merge->refused =
        fmt::format("{} of its {} pairs contradict the other merges", merge->rejected, merge->pairs.size());
    any = true;
  }
  return any;
}

}  // namespace

MapFusionOptions::MapFusionOptions() {
  places.consistent = 1;  // pairs need not be consecutive, since they must agree
}

void MapFusionOptions::declare_decision(core::OptionTable& table, const std::string& prefix) {
  table.integer(
      prefix + "min_pairs", min_pairs, {2, 1000}, "",
      "If fewer keyframes of each of two maps agree on their relative pose, more around them are verified");
  table.number(prefix + "few_extent", few_extent_m, {0.0, 1000.0}, "m",
               "Smallest extent of both maps along a direction that no surface constrains, to detect "
               "repeated structure");

  table.number(prefix + "min_span", min_span_m, {0.0, 100.0}, "m",
               "Keyframes that agree count as one if they are nearer to one another than this");
  table.number(prefix + "min_turn", min_span_rad, {0.0, 3.2}, "rad", "And turned by less than this");
  table.number(prefix + "max_translation", consistency.max_apart_m, {0.0, 10.0}, "m",
               "Largest distance between the alignments of two pairs that agree");
  table.number(prefix + "max_rotation", consistency.max_turned_rad, {0.0, 3.2}, "rad",
               "Largest rotation between them");
  table.number(prefix + "drift", consistency.apart_per_metre, {0.0, 1.0}, "",
               "Additional distance per metre between the pairs, for drift");

  table.number(prefix + "prior_shared", prior_shared, {0.001, 0.999}, "",
               "Probability that two maps share a place, before anything is compared");
  table.number(prefix + "prior_wrong", prior_wrong, {1e-12, 0.5}, "",
               "Largest probability of a merge that is wrong");
  table.integer(prefix + "verifications", verifications, {1, 100000}, "",
                "Largest number of pairs of keyframes to verify for each two maps");
  table.boolean(prefix + "robust", robust, "Let the pose graph reject wrong pairs of keyframes");
}

void MapFusionOptions::declare(core::OptionTable& table) {
  declare_decision(table);
  vocabulary.declare(table);
  places.declare(table);
  verify.declare(table);
}

std::vector<std::size_t> connected_parts(std::size_t parts, const std::vector<MergeEvidence>& merges) {
  std::vector<std::size_t> group(parts);
  for (std::size_t p = 0; p < parts; ++p) group[p] = p;
  for (const MergeEvidence& merge : merges) {
    if (!merge.accepted) continue;
    const std::size_t low = std::min(group[merge.a], group[merge.b]);
    const std::size_t high = std::max(group[merge.a], group[merge.b]);
    std::replace(group.begin(), group.end(), high, low);
  }
  return group;
}

FusedMap fuse_maps(const std::vector<MapPart>& parts, std::vector<MergeEvidence>& merges, std::size_t anchor,
                   const MapFusionOptions& options) {
  FusedMap fused;
  std::vector<const maps::Map*> maps;
  const Layout layout = lay_out(parts, merges, anchor);
  for (const auto& [part, anchor_from_part] : layout.anchor_from_part) {
    fused.parts.push_back(part);
    fused.anchor_from_part.push_back(anchor_from_part);
    maps.push_back(parts[part].map);
    fused.cameras.insert(parts[part].cameras.begin(), parts[part].cameras.end());
  }

  fused.map = joined(maps, fused.anchor_from_part);
  for (const auto& [root, parent] : layout.ties) fused.map.set_parent(root, parent);

  // Only merges within the anchor's group have both ends in the joined map.
  std::vector<PoseEdge> edges;
  std::vector<MergeEvidence*> used;
  for (MergeEvidence& merge : merges) {
    if (!merge.accepted || !std::binary_search(fused.parts.begin(), fused.parts.end(), merge.a)) continue;
    const std::vector<PoseEdge> more = edges_of(merge);
    edges.insert(edges.end(), more.begin(), more.end());
    used.push_back(&merge);
  }

  fused.edges = static_cast<int>(edges.size());
  if (edges.empty()) return fused;

  const std::vector<PoseEdge> loops = loop_edges(fused.map);  // closed by each robot
  edges.insert(edges.end(), loops.begin(), loops.end());
  const std::vector<KeyframeId> ids = parts[anchor].map->keyframe_ids();
  GlobalAdjustmentOptions adjustment = options.adjustment;
  adjustment.robust = options.robust;
  adjustment.noise.orb_scale_factor = options.verify.orb_scale_factor;
  adjustment.bundle = false;  // before surfaces are aligned it would bend a map with a narrow overlap

  // The pose graph may reject most pairs of a merge; the maps are then fused again without it.
  const GlobalAdjustmentSummary graph = adjust_map(fused.map, fused.cameras, edges, adjustment, ids.front());
  fused.refused = graph.refused;
  fused.refusal = graph.refusal;
  if (take_back(graph.extra, used, fused)) return fuse_maps(parts, merges, anchor, options);
  if (!options.merge_duplicates) return fused;

  const std::vector<PoseEdge> believed = believed_edges(edges, graph.extra);
  std::set<std::pair<KeyframeId, KeyframeId>> done;
  for (const PoseEdge& edge : believed) merge_duplicates(edge, options, done, fused);
  set_loops(fused.map, believed);
  return fused;
}

}  // namespace plumbline::mapping
