// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/core/stop.hpp"

namespace plumbline::cli {

/// From now on the first Ctrl-C (or SIGTERM) asks `stop` to end the run in order, the second ends the
/// program.
void stop_on_signals(const core::StopToken& stop);

/// A full disk's or a closed pipe's signal becomes an error of the write, which can be told.
void ignore_write_signals();

}  // namespace plumbline::cli
