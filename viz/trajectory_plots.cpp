// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/trajectory_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace plumbline::viz {
namespace {

using geometry::Trajectory;

constexpr Rgb kTruth{120, 124, 130};
constexpr Rgb kEstimate{0, 114, 178};
constexpr std::array<const char*, 3> kAxisNames{"x", "y", "z"};

std::vector<double> seconds(const Trajectory& trajectory, double start) {
  std::vector<double> t;
  t.reserve(trajectory.size());
  for (const auto& pose : trajectory) t.push_back(pose.stamp - start);
  return t;
}

std::vector<double> coordinate(const Trajectory& trajectory, int axis) {
  std::vector<double> values;
  values.reserve(trajectory.size());
  for (const auto& pose : trajectory) values.push_back(pose.world_from_camera.translation[axis]);
  return values;
}

std::vector<double> errors_of(const TrajectoryComparison& comparison) {
  if (!comparison.error_m.empty()) return comparison.error_m;
  std::vector<double> errors;
  const std::size_t count = std::min(comparison.estimate.size(), comparison.truth.size());
  for (std::size_t i = 0; i < count; ++i) {
    errors.push_back((comparison.estimate[i].world_from_camera.translation -
                      comparison.truth[i].world_from_camera.translation)
                         .norm());
  }
  return errors;
}

std::vector<double> finite(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); }),
               values.end());
  return values;
}

double rms(const std::vector<double>& values) {
  const double sum = std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

/// Errors below a decimetre read better in millimetres.
struct LengthUnit {
  double per_metre = 1.0;
  const char* name = "m";
};
LengthUnit unit_for(const std::vector<double>& metres) {
  const std::vector<double> known = finite(metres);
  const double most = known.empty() ? 1.0 : *std::max_element(known.begin(), known.end());
  if (most < 0.1) return {1000.0, "mm"};
  return most < 1.0 ? LengthUnit{100.0, "cm"} : LengthUnit{};
}

std::vector<double> in_unit(std::vector<double> metres, const LengthUnit& unit) {
  for (double& v : metres) v *= unit.per_metre;
  return metres;
}

/// The two axes along which a trajectory reaches furthest, in x, y, z order.
std::pair<int, int> widest_axes(const Trajectory& trajectory) {
  std::array<double, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double> values = finite(coordinate(trajectory, static_cast<int>(axis)));
    if (values.empty()) continue;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    reach[axis] = *high - *low;
  }
  const auto least = static_cast<int>(std::min_element(reach.begin(), reach.end()) - reach.begin());
  if (reach[0] == reach[1] && reach[1] == reach[2]) return {0, 1};
  return {least == 0 ? 1 : 0, least == 2 ? 1 : 2};
}

/// Roll, pitch, yaw in degrees: R = Rz(yaw) Ry(pitch) Rx(roll), unwrapped over time.
std::array<std::vector<double>, 3> angles_of(const Trajectory& trajectory) {
  std::array<std::vector<double>, 3> angles;
  constexpr double kToDegrees = 180.0 / M_PI;
  for (const auto& pose : trajectory) {
    const Eigen::Matrix3d& r = pose.world_from_camera.rotation;
    const std::array<double, 3> now{std::atan2(r(2, 1), r(2, 2)), std::asin(std::clamp(-r(2, 0), -1.0, 1.0)),
                                    std::atan2(r(1, 0), r(0, 0))};
    for (std::size_t k = 0; k < 3; ++k) {
      double degrees = now[k] * kToDegrees;
      if (!angles[k].empty()) degrees = angles[k].back() + std::remainder(degrees - angles[k].back(), 360.0);
      angles[k].push_back(degrees);
    }
  }
  return angles;
}

/// Moves a whole curve by full turns so that it starts beside another.
void start_beside(std::vector<double>& degrees, const std::vector<double>& other) {
  if (degrees.empty() || other.empty()) return;
  const double turns = 360.0 * std::round((other.front() - degrees.front()) / 360.0);
  for (double& d : degrees) d += turns;
}

double start_of(const TrajectoryComparison& comparison) {
  if (!comparison.truth.empty()) return comparison.truth.front().stamp;
  return comparison.estimate.empty() ? 0.0 : comparison.estimate.front().stamp;
}

core::Result<void> check(const TrajectoryComparison& comparison) {
  const bool truth_fits = comparison.truth.empty() || comparison.truth.size() == comparison.estimate.size();
  const bool errors_fit =
      comparison.error_m.empty() || comparison.error_m.size() == comparison.estimate.size();
  if (truth_fits && errors_fit) return {};
  return core::usage_error(
      fmt::format("trajectory plots of \"{}\": {} poses, but {} of the truth and {} errors", comparison.name,
                  comparison.estimate.size(), comparison.truth.size(), comparison.error_m.size()));
}

}  // namespace

Figure path_figure(const TrajectoryComparison& comparison) {
  const bool with_truth = !comparison.truth.empty();
  const auto [first, second] = widest_axes(with_truth ? comparison.truth : comparison.estimate);
  Axes axes;
  axes.equal_aspect = true;
  axes.x_label = fmt::format("{} (m)", kAxisNames[static_cast<std::size_t>(first)]);
  axes.y_label = fmt::format("{} (m)", kAxisNames[static_cast<std::size_t>(second)]);
  if (with_truth) {
    axes.lines.push_back({"truth", coordinate(comparison.truth, first), coordinate(comparison.truth, second),
                          kTruth, 2.0, true});
  }
  const std::vector<double> x = coordinate(comparison.estimate, first);
  const std::vector<double> y = coordinate(comparison.estimate, second);
  const std::vector<double> errors = errors_of(comparison);
  if (!errors.empty() && errors.size() == x.size()) {
    const LengthUnit unit = unit_for(errors);
    axes.colored_paths.push_back(
        {x, y, in_unit(errors, unit), fmt::format("error ({})", unit.name), {}, 4.0});
  } else {
    axes.lines.push_back({"estimate", x, y, kEstimate, 3.0, false});
  }
  if (!x.empty()) axes.scatter.push_back({"start", {x.front()}, {y.front()}, {45, 48, 54}, 11.0});
  return {comparison.name.empty() ? "Path" : "Path: " + comparison.name, 1, 1200, 1000, {axes}};
}

Figure error_figure(const TrajectoryComparison& comparison) {
  const std::vector<double> errors = errors_of(comparison);
  const LengthUnit unit = unit_for(errors);
  Axes axes;
  axes.x_label = "time (s)";
  axes.y_label = fmt::format("position error ({})", unit.name);
  std::vector<double> t = seconds(comparison.estimate, start_of(comparison));
  t.resize(errors.size());
  axes.lines.push_back({"error", t, in_unit(errors, unit), kEstimate, 2.0, false});
  const std::vector<double> known = finite(errors);
  if (!known.empty()) {
    const auto level = [&](const char* name, double metres, const Rgb& color) {
      const double value = metres * unit.per_metre;
      axes.lines.push_back({fmt::format("{} {:.1f} {}", name, value, unit.name),
                            {t.front(), t.back()},
                            {value, value},
                            color,
                            2.0,
                            true});
    };
    level("RMS", rms(known), category_color(1));
    level("median", median(known), category_color(2));
  }
  return {comparison.name.empty() ? "Position error" : "Position error: " + comparison.name,
          1,
          1400,
          640,
          {axes}};
}

Figure pose_figure(const TrajectoryComparison& comparison) {
  constexpr std::array<const char*, 3> kAngleNames{"roll", "pitch", "yaw"};
  Figure figure{comparison.name.empty() ? "Pose" : "Pose: " + comparison.name, 2, 1600, 1200, {}};
  const double start = start_of(comparison);
  const std::vector<double> t = seconds(comparison.estimate, start);
  const std::vector<double> t_truth = seconds(comparison.truth, start);
  auto angles = angles_of(comparison.estimate);
  const auto truth_angles = angles_of(comparison.truth);
  for (std::size_t k = 0; k < 3; ++k) {
    Axes position;
    position.y_label = fmt::format("{} (m)", kAxisNames[k]);
    Axes angle;
    angle.y_label = fmt::format("{} (deg)", kAngleNames[k]);
    if (k == 2) position.x_label = angle.x_label = "time (s)";
    const auto axis = static_cast<int>(k);
    start_beside(angles[k], truth_angles[k]);
    position.lines.push_back(
        {k == 0 ? "estimate" : "", t, coordinate(comparison.estimate, axis), kEstimate, 2.5, false});
    angle.lines.push_back({"", t, angles[k], kEstimate, 2.5, false});
    if (!comparison.truth.empty()) {
      const std::string label = k == 0 ? "truth" : "";
      position.lines.push_back({label, t_truth, coordinate(comparison.truth, axis), {45, 48, 54}, 1.5, true});
      angle.lines.push_back({"", t_truth, truth_angles[k], {45, 48, 54}, 1.5, true});
    }
    figure.panels.push_back(std::move(position));
    figure.panels.push_back(std::move(angle));
  }
  return figure;
}

Figure error_distribution_figure(const std::vector<TrajectoryComparison>& comparisons) {
  std::vector<double> all;
  for (const auto& c : comparisons) {
    const auto errors = errors_of(c);
    all.insert(all.end(), errors.begin(), errors.end());
  }
  const LengthUnit unit = unit_for(all);
  Axes boxes;
  boxes.title = "Median, quartiles, whiskers, outliers";
  boxes.y_label = fmt::format("position error ({})", unit.name);
  Axes histogram;
  histogram.title = "Histogram";
  histogram.x_label = boxes.y_label;
  histogram.y_label = "poses";
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    const std::vector<double> errors = in_unit(errors_of(comparisons[i]), unit);
    boxes.boxes.push_back({comparisons[i].name, errors, category_color(i)});
    histogram.histograms.push_back({comparisons[i].name, errors, category_color(i)});
  }
  return {"Position error", 2, 1600, 760, {boxes, histogram}};
}

Figure resources_figure(const std::vector<double>& frame_ms, const std::vector<double>& memory_mb) {
  Figure figure{"Resources", 1, 1400, memory_mb.empty() ? 600 : 1000, {}};
  const auto panel = [&figure](const std::vector<double>& values, const char* label, const Rgb& color) {
    std::vector<double> frame(values.size());
    std::iota(frame.begin(), frame.end(), 0.0);
    Axes axes;
    axes.x_label = "frame";
    axes.y_label = label;
    axes.lines.push_back({"", frame, values, color, 1.8, false});
    const std::vector<double> known = finite(values);
    if (!known.empty()) {
      const double middle = median(known);
      axes.lines.push_back({fmt::format("median {:.1f}", middle),
                            {0.0, static_cast<double>(values.size() - 1)},
                            {middle, middle},
                            {45, 48, 54},
                            1.8,
                            true});
    }
    figure.panels.push_back(std::move(axes));
  };
  panel(frame_ms, "time per frame (ms)", kEstimate);
  if (!memory_mb.empty()) panel(memory_mb, "resident memory (MB)", category_color(1));
  return figure;
}

core::Result<void> write_figure(const Figure& figure, const std::filesystem::path& folder,
                                const std::string& name) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem) return core::output_error("cannot make folder " + folder.string() + ": " + problem.message());
  if (auto png = write_figure_png(figure, folder / (name + ".png")); !png) return png;
  return write_figure_svg(figure, folder / (name + ".svg"));
}

core::Result<void> write_trajectory_plots(const TrajectoryComparison& comparison,
                                          const std::filesystem::path& folder) {
  if (auto checked = check(comparison); !checked) return checked;
  if (auto done = write_figure(path_figure(comparison), folder, "path"); !done) return done;
  if (auto done = write_figure(pose_figure(comparison), folder, "poses"); !done) return done;
  if (errors_of(comparison).empty()) return {};  // without truth there is no error to draw
  if (auto done = write_figure(error_figure(comparison), folder, "error"); !done) return done;
  return write_figure(error_distribution_figure({comparison}), folder, "error_distribution");
}

}  // namespace plumbline::viz
