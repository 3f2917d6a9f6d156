// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Version of the program, as in CMakeLists.txt.
namespace plumbline::core {
const char* version();
}  // namespace plumbline::core
