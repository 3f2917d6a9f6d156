// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The stage types of this library, one file each: stage_<name>.cpp. registry.cpp lists them.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

/// The type of the stages that T is.
template <typename T>
StageType stage_type(std::string name, std::string help, Mode mode, std::vector<Port> inputs,
                     std::vector<Port> outputs, bool exports = false) {
  return {std::move(name),
          std::move(help),
          mode,
          std::move(inputs),
          std::move(outputs),
          [] { return std::make_unique<T>(); },
          exports};
}

StageType read_stage();
StageType features_stage();
StageType track_stage();
StageType localize_stage();
StageType poses_stage();
StageType cloud_stage();
StageType refine_stage();
StageType fuse_stage();
StageType filter_stage();
StageType store_stage();
StageType maps_stage();
StageType merge_stage();
StageType visit_stage();
StageType check_stage();
StageType output_stage();

/// Taps, one a port type: tap_<name>.cpp.
StageType frame_tap();
StageType features_tap();
StageType track_tap();
StageType keyframe_cloud_tap();
StageType map_tap();
StageType maps_tap();
StageType cloud_tap();

}  // namespace plumbline::pipeline
