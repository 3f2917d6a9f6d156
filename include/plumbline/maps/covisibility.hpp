// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace plumbline::maps {

/// Keyframes are neighbours when they share so many landmarks (METHOD section 3).
constexpr int kCovisible = 15;

}  // namespace plumbline::maps
