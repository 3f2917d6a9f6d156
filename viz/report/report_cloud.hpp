// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Measurements of the merged cloud for a report.
#include <optional>

#include "plumbline/cloud/types.hpp"
#include "plumbline/viz/svg_chart.hpp"
#include "report_data.hpp"

namespace plumbline::report {

/// Empty for a cloud without finite points.
std::optional<CloudExtent> measure_extent(const cloud::Cloud& cloud);

/// The two axes of the plan: x and y where z is up, else x and z.
std::pair<int, int> plan_axes(const ReportData& data);

/// The cloud from above: the more points lie above each other, the darker; grey that shows on any ground.
std::optional<viz::SvgBackground> plan_of(const ReportData& data);

}  // namespace plumbline::report
