// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/version.hpp"

namespace plumbline::core {
const char* version() { return PLUMBLINE_VERSION; }
}  // namespace plumbline::core
