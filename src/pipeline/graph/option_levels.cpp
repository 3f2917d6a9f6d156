// SPDX-License-Identifier: BSD-3-Clause
#include "graph/option_levels.hpp"

#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>

namespace plumbline::pipeline {
namespace {

using Keys = std::map<std::string, std::set<std::string>>;  ///< by stage

std::set<std::string> keys_in(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), std::istream_iterator<std::string>()};
}

/// Options for experts.
const Keys kAdvanced{
    {"features", keys_in("orb.levels orb.fast_threshold_min orb.min_corner line.min_gradient line.border "
                         "line.max_count line.join line.depth_samples")},
    {"track",
     keys_in(
         "min_surface match.max_hamming match.ratio match.align match.max_line_hamming "
         "local.surface_keyframes local.voxel solver.point_weight solver.line_weight solver.plane_weight "
         "solver.photometric_weight keyframe.min_features keyframe.cone_max_wait keyframe.cone_max_shared "
         "keyframe.cone_min_points keyframe.cone_min_lines landmark.min_found landmark.min_keyframes "
         "landmark.max_turn_rate fuse fuse.keyframes fuse.radius triangulate.keyframes bundle.max_iterations "
         "match.aligned_sigma bundle.line_sigma bundle.depth_factor edges.min_overlap surface.min_depth "
         "loops.robust loops.bundle loops.max_alternative vocabulary.branching vocabulary.levels "
         "verify.min_overlap verify.max_contradiction verify.rounds camera.pictures")},
    {"localize", keys_in("min_features min_found place.candidates place.min_score place.max_alternative")},
    {"merge", keys_in("few_extent prior_shared prior_wrong verifications lag")},
    {"cloud", keys_in("free_space_every smooth_position base")},
    {"refine",
     keys_in("pairs.min_overlap pairs.per_map icp.samples icp.iterations icp.max_rms icp.max_shift "
             "icp.max_turn adjust.observations adjust.iterations adjust.aligned_sigma adjust.line_sigma "
             "adjust.depth_factor adjust.surface_weight adjust.turn_rate adjust.gate")},
    {"fuse", keys_in("min_cos_incidence")},
};

/// Options without a known use: accepted, but not listed anywhere.
const Keys kInternal{
    {"features", keys_in("line.border_either line.exact_nfa orb.spread")},
    {"track",
     keys_in(
         "local.overlap_angle keyframe.cone_min_change landmark.min_visible landmark.min_age "
         "triangulate.max_sigma triangulate.line_views bundle.rounds surface.max_incidence vocabulary.split "
         "places.min_score places.min_absolute places.votes places.consistent verify.min_found "
         "verify.min_evidence verify.min_cells keyframe.cone_balance keyframe.cone_scaled keyframe.urgent "
         "thumbnails motion_prior pnp_start landmark.by_keyframes bundle.depth_rows solver.depth_rows "
         "verify.depth_rows verify.align verify.joint match.min_line_ratio")},
    {"localize",
     keys_in("depth align_stamps thumbnails motion_prior pnp_start readout min_inliers min_surface "
             "match.max_hamming match.ratio match.align match.aligned_sigma match.max_line_hamming "
             "match.min_line_ratio local.keyframes local.surface_keyframes local.voxel local.overlap_angle "
             "solver.point_weight solver.line_weight solver.depth_rows solver.plane_weight "
             "solver.photometric_weight vocabulary.branching vocabulary.levels vocabulary.split "
             "verify.min_inliers verify.min_found verify.min_evidence verify.min_cells verify.min_overlap "
             "verify.max_contradiction verify.rounds verify.depth_rows verify.joint verify.align")},
    {"merge",
     keys_in("min_span min_turn max_translation max_rotation drift "
             "robust vocabulary.branching vocabulary.levels vocabulary.split "
             "places.min_score places.min_absolute places.votes places.consistent verify.min_inliers "
             "verify.min_overlap verify.max_contradiction verify.min_found verify.min_evidence "
             "verify.min_cells verify.rounds verify.depth_rows verify.align verify.joint")},
    {"refine", keys_in("adjust.depth_rows local_map.angle local_map.voxel icp.min_information")},
    {"visit", keys_in("share_new views cells apart turned")},
};

bool lists(const Keys& keys, const std::string& stage, const std::string& key) {
  const auto found = keys.find(stage);
  return found != keys.end() && found->second.count(key) != 0;
}

}  // namespace

OptionLevel option_level(const std::string& stage, const std::string& key) {
  if (lists(kInternal, stage, key)) return OptionLevel::kInternal;
  return lists(kAdvanced, stage, key) ? OptionLevel::kAdvanced : OptionLevel::kBasic;
}

std::vector<std::pair<std::string, std::string>> levelled_options() {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Keys* keys : {&kAdvanced, &kInternal}) {
    for (const auto& [stage, names] : *keys) {
      for (const std::string& name : names) all.emplace_back(stage, name);
    }
  }
  return all;
}

}  // namespace plumbline::pipeline
