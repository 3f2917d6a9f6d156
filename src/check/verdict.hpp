// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/check/self_check.hpp"

namespace plumbline::check {

/// The least shift at one place that stands out, metres.
double least_local(const CheckReport& report);

/// Share of graph_m that counts in expected_m.
double found_share(const CheckReport& report);
/// The same of camera_m.
double camera_share();

/// Fills in drift_m, expected_m, p95_m, reasons and unchecked from the other numbers.
void judge(CheckReport& report);

}  // namespace plumbline::check
