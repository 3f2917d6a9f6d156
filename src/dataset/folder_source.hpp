// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The FrameSource behind every layout on disk.
#include <memory>
#include <string>

#include "layout.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

std::unique_ptr<FrameSource> make_folder_source(std::string name, Layout layout, sensor::Camera camera);

}  // namespace plumbline::dataset
