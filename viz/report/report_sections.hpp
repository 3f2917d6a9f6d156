// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The parts of a report, each made from the data of the result folder; empty if there is nothing to show.
#include <string>

#include "plumbline/report/report.hpp"
#include "report_data.hpp"
#include "report_html.hpp"

namespace plumbline::report {

/// The first page: what it is of, whether to trust it, plan, rooms and openings. Errors (kInput): the logo.
core::Result<std::string> head_html(const ReportData& data, const ReportRequest& request);
/// Key figures, gaps, input and settings.
std::string run_html(const ReportData& data);
/// The folder's snapshots; if it has none, they are drawn now. `scratch`: folder for temporary pictures.
core::Result<std::string> pictures_html(ReportData& data, const std::filesystem::path& scratch);
/// The map to turn and walk through; empty without a cloud. If it cannot be shown, `data` says so. Errors
/// (kInput): request.other cannot be read; (kUntrustworthy): it cannot be aligned with the map.
core::Result<std::string> viewer_html(ReportData& data, const ReportRequest& request,
                                      const core::Executor& executor, core::Log& log);
/// The paths from above, over the plan of the cloud.
std::string path_html(const ReportData& data);
/// Exports in the folder.
std::string exports_html(const ReportData& data);
std::string tracking_html(const ReportData& data);
std::string loops_html(const ReportData& data);
std::string merges_html(const ReportData& data);
std::string refinement_html(const ReportData& data);
std::string cloud_html(const ReportData& data);
std::string accuracy_html(const ReportData& data);
std::string cost_html(const ReportData& data);
std::string configuration_html(const ReportData& data);
/// `left_out`: the report itself.
std::string files_html(const ReportData& data, const std::filesystem::path& left_out);

/// A count of the summary as text, by its JSON pointer.
inline std::string count_at(const nlohmann::ordered_json& json, const std::string& place) {
  return count_text(number_at(json, place));
}

/// Note on what standard deviations leave out, for each place that shows them.
inline constexpr const char* kSigmaNote =
    "Standard deviations count noise alone. What all measurements share, such as a wrong focal length or "
    "depth "
    "that is off everywhere, is not in them: the true error exceeds them.";

/// CSS classes of a robot's marks.
inline std::string robot_kind(std::size_t robot) { return "k" + std::to_string(robot % 8); }
/// A table of LostStretch, longest losses first; at most a screen full.
std::string lost_html(const ReportData& data);

}  // namespace plumbline::report
