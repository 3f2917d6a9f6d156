// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The stage types of this library, one file each: stage_<name>.cpp. registry.cpp lists them.
#include <vector>

#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/stage.hpp"

namespace plumbline::pipeline {

struct RunSummary;

StageType read_stage();
StageType features_stage();
StageType track_stage();
StageType poses_stage();
StageType cloud_stage();
StageType fuse_stage();
StageType output_stage();

/// Counts tracked and lost frames and the longest run of lost ones.
void count_frames(const std::vector<FrameRow>& rows, RunSummary& summary);

}  // namespace plumbline::pipeline
