// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/trajectory_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>

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

/// Moves a whole curve by full turns so that it starts beside a value of another.
void start_beside(std::vector<double>& degrees, double other) {
  if (degrees.empty()) return;
  const double turns = 360.0 * std::round((other - degrees.front()) / 360.0);
  for (double& d : degrees) d += turns;
}

const Trajectory& drawn_truth(const TrajectoryComparison& comparison) {
  return comparison.whole_truth.empty() ? comparison.truth : comparison.whole_truth;
}

/// The first of several that has a truth to draw, else none.
Trajectory shared_truth(const std::vector<TrajectoryComparison>& comparisons) {
  for (const auto& c : comparisons) {
    if (!drawn_truth(c).empty()) return drawn_truth(c);
  }
  return {};
}

/// All curves count time from the first true pose, else from the first pose of all.
double start_of(const std::vector<TrajectoryComparison>& comparisons) {
  const Trajectory truth = shared_truth(comparisons);
  if (!truth.empty()) return truth.front().stamp;
  double start = std::numeric_limits<double>::infinity();
  for (const auto& c : comparisons) {
    if (!c.estimate.empty()) start = std::min(start, c.estimate.front().stamp);
  }
  return std::isfinite(start) ? start : 0.0;
}

/// Where tracking was lost the line must not go on: indices before which a curve of these poses is broken.
std::vector<bool> gaps_in(const Trajectory& trajectory) {
  constexpr double kLeast_s = 0.25, kUsualSteps = 5.0;
  std::vector<bool> broken(trajectory.size(), false);
  std::vector<double> steps;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    steps.push_back(trajectory[i].stamp - trajectory[i - 1].stamp);
  }
  const double most = std::max(kLeast_s, kUsualSteps * median(steps));
  for (std::size_t i = 1; i < trajectory.size(); ++i) broken[i] = steps[i - 1] > most;
  return broken;
}

/// `values` with a NaN put in before every gap.
std::vector<double> with_breaks(const std::vector<double>& values, const std::vector<bool>& broken) {
  std::vector<double> out;
  out.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i < broken.size() && broken[i]) out.push_back(std::numeric_limits<double>::quiet_NaN());
    out.push_back(values[i]);
  }
  return out;
}

std::string titled(const std::string& what, const std::vector<TrajectoryComparison>& comparisons) {
  const bool named = comparisons.size() == 1 && !comparisons[0].name.empty();
  return named ? what + ": " + comparisons[0].name : what;
}

LengthUnit unit_for(const std::vector<TrajectoryComparison>& comparisons) {
  std::vector<double> all;
  for (const auto& c : comparisons) {
    const auto errors = errors_of(c);
    all.insert(all.end(), errors.begin(), errors.end());
  }
  return unit_for(all);
}

Rgb estimate_color(std::size_t index, std::size_t count) {
  return count == 1 ? kEstimate : category_color(index);
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

namespace {

/// The path of one estimate, seen along the axis that the truth moves least along.
Axes path_panel(const TrajectoryComparison& comparison, const LengthUnit& unit,
                const std::optional<AxisRange>& range) {
  const Trajectory& truth = drawn_truth(comparison);
  const auto [first, second] = widest_axes(truth.empty() ? comparison.estimate : truth);
  Axes axes;
  axes.equal_aspect = true;
  axes.x_label = fmt::format("{} (m)", kAxisNames[static_cast<std::size_t>(first)]);
  axes.y_label = fmt::format("{} (m)", kAxisNames[static_cast<std::size_t>(second)]);
  if (!truth.empty()) {
    axes.lines.push_back({"truth", coordinate(truth, first), coordinate(truth, second), kTruth, 2.0, true});
  }
  const std::vector<double> x = coordinate(comparison.estimate, first);
  const std::vector<double> y = coordinate(comparison.estimate, second);
  const std::vector<double> errors = errors_of(comparison);
  const std::vector<bool> gaps = gaps_in(comparison.estimate);
  if (!errors.empty() && errors.size() == x.size()) {
    axes.colored_paths.push_back({with_breaks(x, gaps), with_breaks(y, gaps),
                                  with_breaks(in_unit(errors, unit), gaps),
                                  fmt::format("error ({})", unit.name), range, 4.0});
  } else {
    axes.lines.push_back({"estimate", with_breaks(x, gaps), with_breaks(y, gaps), kEstimate, 3.0, false});
  }
  if (!x.empty()) axes.scatter.push_back({"start", {x.front()}, {y.front()}, {45, 48, 54}, 11.0});
  return axes;
}

/// The least and the greatest error of all estimates, so that one colour means one error in all panels.
std::optional<AxisRange> shared_range(const std::vector<TrajectoryComparison>& comparisons,
                                      const LengthUnit& unit) {
  if (comparisons.size() < 2) return std::nullopt;
  std::vector<double> all;
  for (const auto& c : comparisons) {
    const std::vector<double> errors = finite(in_unit(errors_of(c), unit));
    all.insert(all.end(), errors.begin(), errors.end());
  }
  if (all.empty()) return std::nullopt;
  const auto [low, high] = std::minmax_element(all.begin(), all.end());
  return *low < *high ? std::optional<AxisRange>({*low, *high}) : std::nullopt;
}

}  // namespace

Figure path_figure(const std::vector<TrajectoryComparison>& comparisons) {
  const LengthUnit unit = unit_for(comparisons);
  Figure figure{titled("Path", comparisons), 1, 1200, 1000, {}};
  const std::optional<AxisRange> range = shared_range(comparisons, unit);
  for (const auto& c : comparisons) {
    figure.panels.push_back(path_panel(c, unit, range));
    if (comparisons.size() > 1) figure.panels.back().title = c.name;
  }
  if (comparisons.size() > 1) {
    constexpr int kMostPixels = 8000;
    const auto count = static_cast<int>(comparisons.size());
    figure.columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
    const int rows = (count + figure.columns - 1) / figure.columns;
    figure.width_px = std::min(kMostPixels, 860 * figure.columns);
    figure.height_px = std::min(kMostPixels, 60 + 720 * rows);
  }
  return figure;
}

Figure error_figure(const std::vector<TrajectoryComparison>& comparisons) {
  const LengthUnit unit = unit_for(comparisons);
  const double start = start_of(comparisons);
  const bool single = comparisons.size() == 1;
  Axes axes;
  axes.x_label = "time (s)";
  axes.y_label = fmt::format("position error ({})", unit.name);
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    const std::vector<double> errors = in_unit(errors_of(comparisons[i]), unit);
    const std::vector<bool> gaps = gaps_in(comparisons[i].estimate);
    std::vector<double> t = seconds(comparisons[i].estimate, start);
    t.resize(errors.size());
    const std::vector<double> known = finite(errors);
    const std::string label =
        single ? "error" : fmt::format("{}: RMS {:.1f} {}", comparisons[i].name, rms(known), unit.name);
    axes.lines.push_back({label, with_breaks(t, gaps), with_breaks(errors, gaps),
                          estimate_color(i, comparisons.size()), 2.0, false});
    if (!single || known.empty()) continue;
    const auto level = [&](const char* name, double value, const Rgb& color) {
      const std::string text = fmt::format("{} {:.1f} {}", name, value, unit.name);
      axes.lines.push_back({text, {t.front(), t.back()}, {value, value}, color, 2.0, true});
    };
    level("RMS", rms(known), category_color(1));
    level("median", median(known), category_color(2));
  }
  return {titled("Position error", comparisons), 1, 1400, 640, {axes}};
}

Figure pose_figure(const std::vector<TrajectoryComparison>& comparisons) {
  constexpr std::array<const char*, 3> kAngleNames{"roll", "pitch", "yaw"};
  Figure figure{titled("Pose", comparisons), 2, 1600, 1200, std::vector<Axes>(6)};
  const double start = start_of(comparisons);
  const Trajectory truth = shared_truth(comparisons);
  const auto truth_angles = angles_of(truth);
  for (std::size_t k = 0; k < 3; ++k) {
    figure.panels[2 * k].y_label = fmt::format("{} (m)", kAxisNames[k]);
    figure.panels[2 * k + 1].y_label = fmt::format("{} (deg)", kAngleNames[k]);
    if (k == 2) figure.panels[4].x_label = figure.panels[5].x_label = "time (s)";
  }
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    const TrajectoryComparison& c = comparisons[i];
    const std::vector<bool> gaps = gaps_in(c.estimate);
    const std::vector<double> t = with_breaks(seconds(c.estimate, start), gaps);
    const Rgb color = estimate_color(i, comparisons.size());
    auto angles = angles_of(c.estimate);
    const auto own_truth = angles_of(c.truth);
    for (std::size_t k = 0; k < 3; ++k) {
      // The truth at the first estimated pose, within the turns that the whole truth has made by then.
      if (!own_truth[k].empty()) {
        const auto at = std::lower_bound(truth.begin(), truth.end(), c.estimate.front().stamp,
                                         [](const auto& pose, double stamp) { return pose.stamp < stamp; });
        const auto index = static_cast<std::size_t>(std::min(at, std::prev(truth.end())) - truth.begin());
        start_beside(angles[k], truth_angles[k][index]);
      }
      const std::string name = comparisons.size() == 1 ? "estimate" : c.name;
      figure.panels[2 * k].lines.push_back({k == 0 ? name : "", t,
                                            with_breaks(coordinate(c.estimate, static_cast<int>(k)), gaps),
                                            color, 2.5, false});
      figure.panels[2 * k + 1].lines.push_back({"", t, with_breaks(angles[k], gaps), color, 2.5, false});
    }
  }
  const std::vector<double> t_truth = seconds(truth, start);
  for (std::size_t k = 0; k < 3 && !truth.empty(); ++k) {
    constexpr Rgb kInk{45, 48, 54};
    figure.panels[2 * k].lines.push_back(
        {k == 0 ? "truth" : "", t_truth, coordinate(truth, static_cast<int>(k)), kInk, 1.5, true});
    figure.panels[2 * k + 1].lines.push_back({"", t_truth, truth_angles[k], kInk, 1.5, true});
  }
  return figure;
}

Figure error_distribution_figure(const std::vector<TrajectoryComparison>& comparisons) {
  const LengthUnit unit = unit_for(comparisons);
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

core::Result<void> write_trajectory_plots(const std::vector<TrajectoryComparison>& comparisons,
                                          const std::filesystem::path& folder) {
  bool with_errors = false;
  for (const auto& comparison : comparisons) {
    if (auto checked = check(comparison); !checked) return checked;
    with_errors = with_errors || !errors_of(comparison).empty();
  }
  if (comparisons.empty()) return core::usage_error("trajectory plots: no estimate to draw");
  if (auto done = write_figure(path_figure(comparisons), folder, "path"); !done) return done;
  if (auto done = write_figure(pose_figure(comparisons), folder, "poses"); !done) return done;
  if (!with_errors) return {};  // without truth there is no error to draw
  if (auto done = write_figure(error_figure(comparisons), folder, "error"); !done) return done;
  return write_figure(error_distribution_figure(comparisons), folder, "error_distribution");
}

}  // namespace plumbline::viz
