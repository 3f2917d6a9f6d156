// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Contents of a result folder, read for its report. Any file but summary.json may be missing.
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "report_fit.hpp"
#include "report_table.hpp"

namespace plumbline::report {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();  ///< unknown value

/// The path of one robot in the frame of the results.
struct ReportPath {
  std::size_t number = 0;  ///< of the robot in the map; its colour
  std::string robot;       ///< empty: the only one
  geometry::Trajectory poses;
  geometry::Trajectory keyframes;
  std::optional<evaluate::TrajectoryReport> accuracy;  ///< against the truth
  [[nodiscard]] double length_m() const;               ///< without the stretches where poses are missing
};

/// Frames of one robot, one after the other.
struct ReportFrames {
  std::string robot;              ///< empty: the only one
  std::vector<std::size_t> rows;  ///< of frames.csv
  std::vector<double> time_s;     ///< of each, since the first frame of the run
};

/// Frames without a pose, one after the other.
struct LostStretch {
  std::string robot;
  double from_s = 0.0;  ///< of the first frame without a pose, since the first frame of the run
  double to_s = 0.0;    ///< of the first frame with a pose after it, or of the last one without
  std::size_t lost = 0;
  std::size_t unreadable = 0;
  double gap_m = 0.0;  ///< between the poses before and after; NaN: one of them is missing
};

/// Extent of the merged cloud; metres, frame of the results.
struct CloudExtent {
  Eigen::Vector3d low, high;                  ///< all points
  Eigen::Vector3d central_low, central_high;  ///< without the outer 0.5 % of either side, along each axis
  [[nodiscard]] Eigen::Vector3d size() const { return high - low; }
  [[nodiscard]] Eigen::Vector3d central_size() const { return central_high - central_low; }
};

struct ReportData {
  std::filesystem::path folder;
  std::string name;
  nlohmann::ordered_json summary;
  bool fused_afterwards = false;  ///< by plumbline fuse: of maps, not of recordings
  std::string kind;               ///< what the result is, if files of most results are not part of it
  bool z_up = true;               ///< of the frame of the results; else y is down
  double start_s = 0.0;           ///< stamp of the run's first frame
  double end_s = 0.0;             ///< of the last one
  std::vector<ReportPath> paths;
  std::optional<CsvTable> frame_table;   ///< frames.csv
  std::optional<CsvTable> timing_table;  ///< timing.csv
  std::vector<ReportFrames> frames;
  std::vector<LostStretch> lost;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> loops;  ///< keyframes that a loop or merge ties
  std::map<std::int32_t, std::string> robot_names;                 ///< by number, as far as map.db has them
  std::optional<MapFit> fit;                                       ///< none without map.db
  std::optional<cloud::CloudFile> cloud;
  std::optional<CloudExtent> extent;            ///< none without finite points
  std::string cloud_file;                       ///< its name
  std::vector<std::string> missing;             ///< one line each
  std::string plan_html;                        ///< floor plan and its tables; empty: none was found
  std::string truth;                            ///< the file or files that the paths are compared with
  std::optional<evaluate::Statistics> joint_m;  ///< ATE of all robots, one alignment for all
};

/// Errors (kInput): not a result folder, summary.json is damaged.
core::Result<ReportData> read_report_data(const std::filesystem::path& folder);

/// Reads frames.csv and timing.csv: frames by robot, times, lost stretches. Paths must be there.
void add_frames(ReportData& data);

/// Compares the paths with the truth. Errors (kInput): nothing there fits, or it cannot be compared.
core::Result<void> add_truth(const std::filesystem::path& truth, ReportData& data);

/// A number of the summary by its JSON pointer ("/frames/read"); NaN if there is none.
double number_at(const nlohmann::ordered_json& json, const std::string& place);
/// True if the JSON has `true` at this path.
bool flag_at(const nlohmann::ordered_json& json, const std::string& place);
std::string text_at(const nlohmann::ordered_json& json, const std::string& place);
/// The list at a JSON pointer; empty if there is none.
const nlohmann::ordered_json& list_at(const nlohmann::ordered_json& json, const std::string& place);

}  // namespace plumbline::report
