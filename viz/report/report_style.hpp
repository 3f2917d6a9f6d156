// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace plumbline::report {

/// By this a report is known as one.
inline const char* const kReportGenerator = "plumbline report";

/// CSS of the page: light, dark and on paper.
const char* report_style();

}  // namespace plumbline::report
