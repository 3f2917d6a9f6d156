// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/adjust/adjust.hpp"

namespace plumbline::adjust {

/// Fills text and json from the rest.
void write_report(Adjustment& adjustment);

}  // namespace plumbline::adjust
