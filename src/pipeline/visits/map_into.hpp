// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// `plumbline map INPUT --into MAP`: another visit of a finished map.
#include "plumbline/pipeline/map_recording.hpp"

namespace plumbline::pipeline {

/// Maps the recording by itself in OUT.visit, then joins that to `request.into`. Errors as map_recording.
core::Result<RunSummary> map_into(const MapRequest& request, const core::Executor& executor, core::Log& log,
                                  const core::StopToken& stop, const Progress& progress);

}  // namespace plumbline::pipeline
