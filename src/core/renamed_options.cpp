// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/renamed_options.hpp"

namespace plumbline::core {
namespace {

const std::vector<RenamedOption> kRenamedOptions{
    {"cloud", "looks", "free_space_every"},
    {"cloud", "between", "intermediate_every"},
    {"fuse", "settle", "plane_projection"},
    {"refine", "icp.min_hold", "icp.min_information"},
    {"refine", "adjust.first_gate", "adjust.gate"},
    {"refine", "adjust.aligned", "adjust.aligned_sigma"},
    {"track", "bundle.aligned", "match.aligned_sigma"},
    {"track", "loops.agreeing", "loops.min_consistent"},
    {"track", "loops.max_rival", "loops.max_alternative"},
    {"track", "landmark.grace", "landmark.min_age"},
    {"track", "keyframe.cone_patience", "keyframe.cone_max_wait"},
    {"merge", "max_apart", "max_translation"},
    {"merge", "max_turned", "max_rotation"},
    {"merge", "rival", "max_alternative"},
    {"features", "method", "line.detector"},
    {"features", "scale", "line.scale"},
    {"features", "min_length", "line.min_length"},
    {"features", "min_gradient", "line.min_gradient"},
    {"features", "border", "line.border"},
    {"features", "max_count", "line.max_count"},
    {"features", "join", "line.join"},
    {"features", "depth_max", "line.max_depth"},
    {"features", "depth_samples", "line.depth_samples"}};

/// Options that another stage has now.
constexpr RenamedOption kMovedOptions[] = {{"track", "points", "features.points"},
                                           {"track", "lines", "features.lines"},
                                           {"track", "photometric", "features.photometric"},
                                           {"robots", "online", "merge.online"}};

/// Stages that went, and options of theirs that another one has.
constexpr RenamedOption kGoneStages[] = {
    {"robots", "merge.", "merge."}, {"robots", "", "track."}, {"maps", "", "merge."}, {"keep", "", "store."}};

}  // namespace

const std::vector<RenamedOption>& renamed_options() { return kRenamedOptions; }

std::string renamed_option(const std::string& stage, const std::string& key) {
  for (const RenamedOption& option : kRenamedOptions) {
    if (stage == option.stage && key == option.before) return option.now;
  }
  return key;
}

std::string moved_option(const std::string& stage, const std::string& key) {
  for (const RenamedOption& option : kMovedOptions) {
    if (stage == option.stage && key == option.before) return option.now;
  }
  return {};
}

std::string renamed_setting(const std::string& stage, const std::string& key) {
  if (const std::string moved = moved_option(stage, key); !moved.empty()) return moved;
  for (const RenamedOption& gone : kGoneStages) {
    const std::string before = gone.before;
    if (stage != gone.stage || key.rfind(before, 0) != 0) continue;
    const std::string now = gone.now;
    const std::string heir = now.substr(0, now.find('.'));
    return renamed_setting(heir, key.substr(before.size()));
  }
  return stage + "." + renamed_option(stage, key);
}

}  // namespace plumbline::core
