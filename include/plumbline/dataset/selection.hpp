// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The part of a recording that --from, --to and --every name, of whatever kind the recording is.
#include <cstddef>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

/// Positions of the frames from OpenOptions::from_s to to_s seconds after the first, every n-th of these,
/// beginning with the first of them. `stamps` are in order and not empty; `name` is for messages. Errors
/// (kUsage): n is below 1; no frame is in that span.
core::Result<std::vector<std::size_t>> selected_frames(const std::string& name,
                                                       const std::vector<double>& stamps,
                                                       const OpenOptions& options);

}  // namespace plumbline::dataset
