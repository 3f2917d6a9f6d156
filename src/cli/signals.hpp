// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/core/stop.hpp"

namespace plumbline::cli {

/// After this call the first Ctrl-C (or SIGTERM) requests an orderly end of the run; the second ends the
/// program.
const core::StopToken& stop_on_signals();

/// A full disk's or a closed pipe's signal becomes an error of the write, which can be told.
void ignore_write_signals();

}  // namespace plumbline::cli
