// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app.hpp"
#include "plumbline/exports/export.hpp"

namespace plumbline::cli {

/// How a recording is opened again, as it was for the map; refers to the session.
exports::OpenRecording recording_opener(Session& session);

}  // namespace plumbline::cli
