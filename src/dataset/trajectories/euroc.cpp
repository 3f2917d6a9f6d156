// SPDX-License-Identifier: BSD-3-Clause
// EuRoC and TUM-VI: "#timestamp, p_RS_R_x [m], ..., q_RS_w [], ..." separated by commas, nanoseconds, w
// first; and other tables whose header names the columns.
#include "trajectories/trajectory_formats.hpp"

namespace plumbline::dataset {
namespace {

/// True for a header with commas or a stamp in "ns"; without a header, for commas and whole nanoseconds.
bool is_euroc(const TrajectoryText& text) {
  if (text.header) return text.commas || text.header->stamp_name.find("ns") != std::string::npos;
  if (!text.commas || text.rows.empty()) return false;
  const std::string& stamp = text.rows.front().words.front();
  return text.rows.front().words.size() >= 8 && stamp.size() >= 16 &&
         stamp.find_first_not_of("0123456789") == std::string::npos;
}

core::Result<PoseOfRow> read_euroc(const TrajectoryText& text, const TextLine& row, double& stamp) {
  TrajectoryColumns columns;
  columns.at = {0, 1, 2, 3, 5, 6, 7, 4};
  return read_columns(text, row, text.header.value_or(columns), stamp);
}

}  // namespace

const TrajectoryFormat kEurocTrajectory = {"EuRoC", true, &is_euroc, &read_euroc};

}  // namespace plumbline::dataset
