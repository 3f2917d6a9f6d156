// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A bag as a recording: pairs of colour and depth by their stamps, and the camera.
#include "bags/survey.hpp"
#include "layout.hpp"

namespace plumbline::dataset {

/// Reads a bag. Layout::images gives the images; Layout::camera is set if the bag contains it. Errors
/// (kInput, kUsage): not a bag, ambiguous topics, no pairs.
core::Result<Layout> read_bag(const std::filesystem::path& path, const TopicNames& topics,
                              const LayoutOptions& options, core::Log& log);

/// The rate of colour, to the hundredth, for a camera from messages; 30 if there are too few.
double usual_fps(const std::vector<PairInfo>& pairs);

}  // namespace plumbline::dataset
