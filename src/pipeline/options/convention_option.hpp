// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "plumbline/core/options.hpp"
#include "plumbline/geometry/pose_convention.hpp"

namespace plumbline::pipeline {

/// Declares the convention in which poses are read; `whose`: as in "of the poses".
inline void declare_convention(core::OptionTable& table, const std::string& key,
                               geometry::PoseConvention& value, const std::string& whose) {
  table.choice<geometry::PoseConvention>(key, value,
                                         {{"world_from_camera", geometry::PoseConvention::kWorldFromCamera},
                                          {"inverted", geometry::PoseConvention::kInverted},
                                          {"opengl", geometry::PoseConvention::kOpenGl},
                                          {"wxyz", geometry::PoseConvention::kWFirst}},
                                         "Convention of " + whose +
                                             ": inverted (camera from world), opengl (y up, z backwards), "
                                             "wxyz (quaternions begin with w)");
}

}  // namespace plumbline::pipeline
