// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace plumbline::pipeline {

/// The "file" of marks of values that stand on the command line.
inline constexpr const char* kCommandLineFile = "--set";

}  // namespace plumbline::pipeline
