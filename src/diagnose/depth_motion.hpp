// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "plumbline/diagnose/samples.hpp"

namespace plumbline::diagnose {

/// Share of the pixels whose depth differs by more than 4 % between samples that follow each other, first
/// frames of groups only.
double moved_share(const std::vector<Sample>& samples);

}  // namespace plumbline::diagnose
