// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Facts about a recording before it is mapped; `plumbline info` prints them.
#include <cstddef>
#include <string>
#include <vector>

#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

/// A few lines, "key: value": format, length in time, camera, depth of up to five frames, truth.
std::string to_text(const FrameSource& source);

/// Up to `samples` positions, evenly spread over [0, count), the first and the last among them.
std::vector<std::size_t> spread(std::size_t count, std::size_t samples);

}  // namespace plumbline::dataset
