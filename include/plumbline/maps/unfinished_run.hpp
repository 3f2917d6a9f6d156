// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The mark of a run that has not ended in OUT.partial, as others see it.
#include <filesystem>

namespace plumbline::maps {

/// File in every OUT.partial, locked by its run: it distinguishes the remains of an interrupted run from
/// anything else, and from a run that is still active.
inline constexpr const char* kUnfinishedMarker = ".plumbline-unfinished";

/// True if a run is writing to this OUT.partial now; false if it was interrupted, or there is none.
bool is_running(const std::filesystem::path& partial);

}  // namespace plumbline::maps
