// SPDX-License-Identifier: BSD-3-Clause
// The frames of a report: whose they are, when, and where tracking was lost.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "report_data.hpp"

namespace plumbline::report {
namespace {

std::optional<CsvTable> table_of(const char* name, ReportData& data) {
  auto table = CsvTable::read(data.folder / name);
  if (table) return std::move(*table);
  data.missing.push_back(table.error().message);
  return std::nullopt;
}

/// Stamps of all frames: of those that could not be read, timing.csv knows them.
std::vector<double> stamps_of(const ReportData& data) {
  const CsvTable& table = *data.frame_table;
  std::vector<double> stamps;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    double stamp = table.number(row, table.column("stamp"));
    if (std::isnan(stamp) && data.timing_table && row < data.timing_table->rows()) {
      stamp = data.timing_table->number(row, data.timing_table->column("stamp"));
    }
    if (std::isnan(stamp)) stamp = stamps.empty() ? 0.0 : stamps.back();
    stamps.push_back(stamp);
  }
  return stamps;
}

void sort_by_robot(ReportData& data) {
  const CsvTable& table = *data.frame_table;
  const std::vector<double> stamps = stamps_of(data);
  data.start_s = *std::min_element(stamps.begin(), stamps.end());
  data.end_s = *std::max_element(stamps.begin(), stamps.end());
  const std::size_t robot_column = table.column("robot");
  const bool several = robot_column < table.columns().size();

  // Rows by robot.
  std::map<std::string, ReportFrames> robots;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string robot(table.text(row, robot_column));
    if (several && robot.empty()) continue;  // could not be read: belongs to no robot
    ReportFrames& frames = robots[robot];
    frames.robot = robot;
    frames.rows.push_back(row);
    frames.time_s.push_back(stamps[row] - data.start_s);
  }

  for (auto& [robot, frames] : robots) data.frames.push_back(std::move(frames));
  if (!several || data.paths.size() != 1) return;

  // If robots did not meet, the result holds only one of them: the one with the stamps of its poses.
  std::size_t most = 0;
  for (const ReportFrames& frames : data.frames) {
    std::size_t own = 0;
    for (const std::size_t row : frames.rows) {
      own += geometry::pose_at(data.paths[0].poses, stamps[row], 1e-5) ? 1U : 0U;
    }
    if (own > most) data.paths[0].robot = frames.robot;
    most = std::max(most, own);
  }
}

void take_times_from_paths(ReportData& data) {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  for (const ReportPath& path : data.paths) {
    if (path.poses.empty()) continue;
    first = std::min(first, path.poses.front().stamp);
    last = std::max(last, path.poses.back().stamp);
  }

  // Unchanged without any pose.
  if (first <= last) {
    data.start_s = first;
    data.end_s = last;
  }
}

/// Between the last pose before and the first pose after a stretch of stamps.
double gap_m(const geometry::Trajectory& poses, double from, double to) {
  const auto after = std::find_if(poses.begin(), poses.end(), [&](const auto& p) { return p.stamp > to; });
  if (after == poses.end() || after == poses.begin()) return kNaN;
  const geometry::StampedPose& before = *(after - 1);
  if (!(before.stamp < from)) return kNaN;
  return (after->world_from_camera.translation - before.world_from_camera.translation).norm();
}

void add_lost(const ReportFrames& frames, ReportData& data) {
  const CsvTable& table = *data.frame_table;
  const std::size_t state = table.column("state");
  LostStretch now;

  // Ends a stretch of frames without poses.
  const auto end = [&](double to_s, double last_s) {
    if (now.lost + now.unreadable == 0) return;
    now.robot = frames.robot;
    now.to_s = to_s;
    now.gap_m = kNaN;

    // Distance between the poses around it.
    for (const ReportPath& path : data.paths) {
      if (path.robot == frames.robot) {
        now.gap_m = gap_m(path.poses, data.start_s + now.from_s - 1e-5, data.start_s + last_s + 1e-5);
      }
    }

    data.lost.push_back(now);
    now = {};
  };
  double last_s = 0.0;

  // Frames from one tracked frame to the next.
  for (std::size_t i = 0; i < frames.rows.size(); ++i) {
    const std::string_view what = table.text(frames.rows[i], state);
    if (what == "tracked") {
      end(frames.time_s[i], last_s);
      continue;
    }

    // A stretch begins or continues.
    if (now.lost + now.unreadable == 0) now.from_s = frames.time_s[i];
    ++(what == "unreadable" ? now.unreadable : now.lost);
    last_s = frames.time_s[i];
  }

  end(last_s, last_s);
}

}  // namespace

void add_frames(ReportData& data) {
  // A fused result has no frames.
  if (!data.fused_afterwards) {
    data.frame_table = table_of("frames.csv", data);
    data.timing_table = table_of("timing.csv", data);
  }
  if (!data.frame_table) return take_times_from_paths(data);
  sort_by_robot(data);
  for (const ReportFrames& frames : data.frames) add_lost(frames, data);
}

}  // namespace plumbline::report
