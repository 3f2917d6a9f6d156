// SPDX-License-Identifier: BSD-3-Clause
#include "results/frame_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

#include "plumbline/core/csv.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::pipeline {
namespace {

using Report = mapping::FrameReport;

struct Column {
  const char* name;
  std::string (*text)(const Report&);
};

std::string number(int value) { return std::to_string(value); }
std::string flag(bool value) { return value ? "1" : "0"; }
std::string fine(double value) { return fmt::format("{:.4f}", value); }
std::string degrees(double value) { return fmt::format("{:.2f}", value); }

FrameState state_of(tracking::TrackState state) {
  if (state == tracking::TrackState::kInitialising) return FrameState::kInitialising;
  return state == tracking::TrackState::kTracked ? FrameState::kTracked : FrameState::kLost;
}

/// The share of the bundle's cost that is left.
double cost_ratio(const mapping::BundleReport& bundle) {
  return bundle.summary.initial_cost > 0.0 ? bundle.summary.final_cost / bundle.summary.initial_cost : 1.0;
}

/// The last but one of the columns.
std::string reason_of(const std::string& columns) {
  const std::size_t end = columns.rfind(',');
  if (end == std::string::npos || end == 0) return {};
  const std::size_t before = columns.rfind(',', end - 1);
  return before == std::string::npos ? std::string() : columns.substr(before + 1, end - before - 1);
}

const std::array kColumns{
    Column{"stamp", [](const Report& r) { return fmt::format("{:.6f}", r.stamp); }},  // seconds
    Column{"reference", [](const Report& r) { return number(r.reference.index); }},
    Column{"keyframe", [](const Report& r) { return number(r.keyframe.index); }},
    Column{"component", [](const Report& r) { return number(r.component.index); }},
    Column{"relocalised", [](const Report& r) { return flag(r.relocalised); }},

    // Residuals that fit, and their rms in standard deviations.
    Column{"points", [](const Report& r) { return number(r.points.inliers); }},
    Column{"points_rms", [](const Report& r) { return fine(r.points.rms); }},
    Column{"lines", [](const Report& r) { return number(r.lines.inliers); }},
    Column{"lines_rms", [](const Report& r) { return fine(r.lines.rms); }},
    Column{"surface", [](const Report& r) { return number(r.surface.inliers); }},
    Column{"surface_rms", [](const Report& r) { return fine(r.surface.rms); }},
    Column{"photometric", [](const Report& r) { return number(r.photometric.inliers); }},
    Column{"photometric_rms", [](const Report& r) { return fine(r.photometric.rms); }},
    Column{"min_eigenvalue", [](const Report& r) { return fmt::format("{:.6g}", r.min_eigenvalue); }},
    Column{"weak_directions", [](const Report& r) { return number(r.degenerate_directions); }},

    // Columns of the keyframe decision.
    Column{"frames_since_keyframe", [](const Report& r) { return number(r.decision.frames_since); }},
    Column{"shared", [](const Report& r) { return fine(r.decision.shared); }},
    Column{"overlap", [](const Report& r) { return fine(r.decision.overlap); }},
    Column{"parallax", [](const Report& r) { return fine(r.decision.parallax); }},
    Column{"rotation_rad", [](const Report& r) { return fine(r.decision.rotation_rad); }},
    Column{"mapper_idle", [](const Report& r) { return flag(r.decision.mapper_idle); }},

    // Section 4.1: the viewing cones.
    Column{"cone_candidate", [](const Report& r) { return flag(r.decision.cone.candidate); }},
    Column{"cone_shared", [](const Report& r) { return fine(r.decision.cone.shared); }},
    Column{"cone_matched", [](const Report& r) { return fmt::format("{}", r.decision.cone.now.matched); }},
    Column{"cone_all", [](const Report& r) { return fmt::format("{}", r.decision.cone.now.all); }},
    Column{"cone_changed", [](const Report& r) { return fmt::format("{}", r.decision.cone.now.changed); }},
    Column{"cone_theta", [](const Report& r) { return fine(r.decision.cone.threshold.theta); }},
    Column{"cone_beta", [](const Report& r) { return fine(r.decision.cone.threshold.beta); }},
    Column{"cone_alpha", [](const Report& r) { return fine(r.decision.cone.threshold.alpha); }},
    Column{"cone_initial", [](const Report& r) { return degrees(r.decision.cone.threshold.initial); }},
    Column{"cone_adaptive", [](const Report& r) { return degrees(r.decision.cone.threshold.adaptive); }},
    Column{"cone_ecog", [](const Report& r) { return fine(r.decision.cone.balance.ecog); }},
    Column{"cone_offset", [](const Report& r) { return fine(r.decision.cone.balance.offset); }},
    Column{"wanted", [](const Report& r) { return flag(r.decision.wanted); }},
    Column{"urgent", [](const Report& r) { return flag(r.decision.urgent); }},

    // The bundle that was put back before this frame; empty: none was.
    Column{"bundle", [](const Report& r) { return number(r.bundle.keyframe.index); }},
    Column{"bundle_cost",
           [](const Report& r) { return r.bundle.keyframe.valid() ? fine(cost_ratio(r.bundle)) : ""; }},
    Column{"bundle_outliers",
           [](const Report& r) {
             const auto& summary = r.bundle.summary;
             return r.bundle.keyframe.valid() ? number(summary.point_outliers + summary.line_outliers) : "";
           }},
    Column{"bundle_refused",
           [](const Report& r) { return flag(r.bundle.keyframe.valid() && r.bundle.refused); }},
};

}  // namespace

bool shows_nothing(const sensor::RgbdFrame& frame, std::size_t corners) {
  constexpr int kStep = 8;
  constexpr double kLeastDepth = 0.05;
  constexpr double kLeastDeviation = 8.0;
  constexpr std::size_t kFewCorners = 30;
  double depth = 0.0, sum = 0.0, squares = 0.0, all = 0.0;
  for (int y = kStep / 2; y < frame.gray.rows; y += kStep) {
    for (int x = kStep / 2; x < frame.gray.cols; x += kStep) {
      const double gray = frame.gray.at<std::uint8_t>(y, x);
      depth += frame.depth.at<float>(y, x) > 0.0F ? 1.0 : 0.0;
      sum += gray;
      squares += gray * gray;
      all += 1.0;
    }
  }
  if (all == 0.0) return false;
  const double deviation = std::sqrt(std::max(0.0, squares / all - sum / all * (sum / all)));
  return depth < kLeastDepth * all || (deviation < kLeastDeviation && corners < kFewCorners);
}

FrameRow row_of(std::size_t frame, const mapping::FrameReport& report, bool shows_nothing,
                const std::string& robot) {
  FrameRow row{frame, state_of(report.state), robot.empty() ? "" : core::csv_field(robot) + ","};
  for (const Column& column : kColumns) row.columns += column.text(report) + ",";

  // The tracker's reason would lead astray if the frame shows nothing.
  if (row.state == FrameState::kLost) row.reason = shows_nothing ? kShowsNothing : to_string(report.loss);
  row.columns += row.reason + "," + flag(shows_nothing);
  row.shows_nothing = shows_nothing;
  return row;
}

std::string to_line(const FrameRow& row) {
  return fmt::format("{},{},{}", row.frame, to_string(row.state), row.columns);
}

std::optional<FrameRow> read_line(const std::string& line) {
  const std::size_t first = line.find(',');
  const std::size_t second = line.find(',', first + 1);
  if (first == std::string::npos || second == std::string::npos) return std::nullopt;

  // The frame's number and its state; the rest stays text.
  FrameRow row;
  const char* end = line.data() + first;
  const auto [stop, error] = std::from_chars(line.data(), end, row.frame);
  if (error != std::errc() || stop != end) return std::nullopt;

  const std::string state = line.substr(first + 1, second - first - 1);
  for (const auto known : {FrameState::kInitialising, FrameState::kTracked, FrameState::kLost}) {
    if (state != to_string(known)) continue;
    row.state = known;
    row.columns = line.substr(second + 1);
    row.shows_nothing = !row.columns.empty() && row.columns.back() == '1';
    row.reason = reason_of(row.columns);
    return row;
  }
  return std::nullopt;
}

std::string row_column_names() {
  std::string names;
  for (const Column& column : kColumns) names += std::string(column.name) + ",";
  return names + "reason,blind";
}

core::Result<void> write_frame_rows(const std::filesystem::path& file, const std::string& columns,
                                    const std::vector<FrameRow>& rows, std::size_t frames) {
  const std::string nothing(static_cast<std::size_t>(std::count(columns.begin(), columns.end(), ',')), ',');
  core::OutputFile out(file);
  out.write("frame,state," + columns + "\n");
  auto row = rows.begin();
  for (std::size_t f = 0; f < frames; ++f) {
    if (row != rows.end() && row->frame == f) {
      out.write(to_line(*row) + "\n");
      ++row;
    } else {
      out.write(fmt::format("{},unreadable,{}\n", f, nothing));
    }
  }
  return out.commit();
}

}  // namespace plumbline::pipeline
