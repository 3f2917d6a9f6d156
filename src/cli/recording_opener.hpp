// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app.hpp"
#include "plumbline/exports/export.hpp"

namespace plumbline::cli {

/// Function that opens a recording again as it was opened for the map; refers to the session.
exports::OpenRecording recording_opener(Session& session);

}  // namespace plumbline::cli
