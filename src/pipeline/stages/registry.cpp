// SPDX-License-Identifier: BSD-3-Clause
#include "stages/stages.hpp"

namespace plumbline::pipeline {

void register_stages(StageRegistry& registry) {
  registry.add(read_stage());
  registry.add(features_stage());
  registry.add(track_stage());
  registry.add(localize_stage());
  registry.add(poses_stage());

  registry.add(cloud_stage());
  registry.add(refine_stage());
  registry.add(fuse_stage());
  registry.add(filter_stage());
  registry.add(store_stage());

  registry.add(maps_stage());
  registry.add(merge_stage());
  registry.add(visit_stage());
  registry.add(check_stage());
  registry.add(output_stage());

  registry.add_tap(frame_tap());
  registry.add_tap(features_tap());
  registry.add_tap(track_tap());
  registry.add_tap(keyframe_cloud_tap());
  registry.add_tap(map_tap());
  registry.add_tap(maps_tap());
  registry.add_tap(cloud_tap());
}

}  // namespace plumbline::pipeline
