// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/core/stop.hpp"

namespace plumbline::cli {

/// After this call the first Ctrl-C (or SIGTERM, or SIGHUP of a closed terminal) requests an orderly end of
/// the run; the second ends the program.
const core::StopToken& stop_on_signals();

/// Turns the signal of a full disk or a closed pipe into an error of the write, which can be reported.
void ignore_write_signals();

}  // namespace plumbline::cli
