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

#include "plumbline/core/output_file.hpp"

namespace plumbline::viz {
namespace {

using geometry::Trajectory;

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

/// Given errors, else distances between estimate and truth.
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

/// Moves a whole curve by full turns so that it starts near a value of another.
void start_beside(std::vector<double>& degrees, double other) {
  if (degrees.empty()) return;
  const double turns = 360.0 * std::round((other - degrees.front()) / 360.0);
  for (double& d : degrees) d += turns;
}

const Trajectory& drawn_truth(const TrajectoryComparison& comparison) {
  return comparison.whole_truth.empty() ? comparison.truth : comparison.whole_truth;
}

/// The truth of the first comparison that has one to draw, else none.
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

/// Indices before which a curve of these poses is broken, because tracking was lost there.
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

/// The greatest error of all estimates, so that one colour means one error in all charts; none: not known.
std::optional<double> greatest_error(const std::vector<TrajectoryComparison>& comparisons) {
  std::optional<double> most;
  for (const auto& c : comparisons) {
    for (const double error : finite(errors_of(c))) most = std::max(most.value_or(0.0), error);
  }
  return most;
}

LengthUnit unit_for(const std::vector<TrajectoryComparison>& comparisons) {
  const double most = greatest_error(comparisons).value_or(1.0);
  if (most < 0.1) return {1000.0, "mm"};
  return most < 1.0 ? LengthUnit{100.0, "cm"} : LengthUnit{};
}

std::string estimate_kind(std::size_t index) { return fmt::format("k{}", index % 8); }

/// All lists of a comparison must have one length.
core::Result<void> check(const TrajectoryComparison& comparison) {
  const bool truth_fits = comparison.truth.empty() || comparison.truth.size() == comparison.estimate.size();
  const bool errors_fit =
      comparison.error_m.empty() || comparison.error_m.size() == comparison.estimate.size();
  if (truth_fits && errors_fit) return {};
  return core::usage_error(
      fmt::format("trajectory plots of \"{}\": {} poses, but {} of the truth and {} errors", comparison.name,
                  comparison.estimate.size(), comparison.truth.size(), comparison.error_m.size()));
}

constexpr std::size_t kErrorClasses = 5;

/// A path as one line for each class of error.
void add_colored_path(const TrajectoryComparison& comparison, const std::vector<double>& x,
                      const std::vector<double>& y, double greatest_m, const LengthUnit& unit,
                      std::vector<SvgLine>& lines) {
  const std::vector<double> errors = errors_of(comparison);
  const std::vector<bool> gaps = gaps_in(comparison.estimate);
  const double step = greatest_m / kErrorClasses;
  const auto class_of = [&](std::size_t i) {
    if (!std::isfinite(errors[i])) return kErrorClasses;
    const double place = step > 0.0 ? errors[i] / step : 0.0;
    return std::min(kErrorClasses - 1, static_cast<std::size_t>(place));
  };

  // One line per class, so that the legend explains it.
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < kErrorClasses; ++k) {
    const double most = static_cast<double>(k + 1) * step;
    SvgLine line{
        fmt::format("up to {:.1f} {}", unit.per_metre * most, unit.name), fmt::format("e{}", k), {}, {}};

    for (std::size_t i = 0; i < x.size(); ++i) {
      // The curve of a class continues to the first point of the next one.
      const bool goes_on = i > 0 && !gaps[i] && class_of(i - 1) == k;
      if (!goes_on && class_of(i) != k) continue;
      if (!goes_on) {
        line.x.push_back(kNaN);
        line.y.push_back(kNaN);
      }
      line.x.push_back(x[i]);
      line.y.push_back(y[i]);
    }

    lines.push_back(std::move(line));
  }
}

/// The path of one estimate, seen along the axis that the truth moves least along.
SvgChart path_chart(const TrajectoryComparison& comparison, const LengthUnit& unit, double greatest_m) {
  const Trajectory& truth = drawn_truth(comparison);
  const auto [first, second] = widest_axes(truth.empty() ? comparison.estimate : truth);
  SvgChart chart;
  chart.title = comparison.name.empty() ? "Path" : "Path: " + comparison.name;
  chart.equal_aspect = true;
  chart.x_label = fmt::format("{} (m)", kAxisNames[static_cast<std::size_t>(first)]);
  chart.y_label = fmt::format("{} (m)", kAxisNames[static_cast<std::size_t>(second)]);

  // Truth is drawn below the estimate.
  if (!truth.empty()) {
    chart.lines.push_back({"truth", "truth", coordinate(truth, first), coordinate(truth, second)});
  }

  // Coloured by error if it is known.
  const std::vector<double> x = coordinate(comparison.estimate, first);
  const std::vector<double> y = coordinate(comparison.estimate, second);
  if (!x.empty() && errors_of(comparison).size() == x.size()) {
    add_colored_path(comparison, x, y, greatest_m, unit, chart.lines);
  } else {
    const std::vector<bool> gaps = gaps_in(comparison.estimate);
    chart.lines.push_back({"estimate", "k0", with_breaks(x, gaps), with_breaks(y, gaps)});
  }

  // The start shows the direction of travel.
  if (!x.empty()) chart.dots.push_back({"start", "plain", {x.front()}, {y.front()}, 4.0, false});
  return chart;
}

}  // namespace

std::vector<SvgChart> path_charts(const std::vector<TrajectoryComparison>& comparisons) {
  const double greatest_m = greatest_error(comparisons).value_or(0.0);
  std::vector<SvgChart> charts;
  for (const auto& c : comparisons) charts.push_back(path_chart(c, unit_for(comparisons), greatest_m));
  return charts;
}

/// Error over time; a single trajectory also shows RMS and median.
SvgChart error_chart(const std::vector<TrajectoryComparison>& comparisons) {
  const LengthUnit unit = unit_for(comparisons);
  const double start = start_of(comparisons);
  const bool single = comparisons.size() == 1;
  SvgChart chart;
  chart.title = titled("Position error", comparisons);
  chart.height_px = 400;
  chart.x_label = "time (s)";
  chart.y_label = fmt::format("position error ({})", unit.name);

  // Gaps in tracking break the line.
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    const std::vector<double> errors = in_unit(errors_of(comparisons[i]), unit);
    const std::vector<bool> gaps = gaps_in(comparisons[i].estimate);
    std::vector<double> t = seconds(comparisons[i].estimate, start);
    t.resize(errors.size());

    // Unknown errors do not count.
    const std::vector<double> known = finite(errors);
    const std::string label =
        single ? "error" : fmt::format("{}: RMS {:.1f} {}", comparisons[i].name, rms(known), unit.name);
    chart.lines.push_back({label, estimate_kind(i), with_breaks(t, gaps), with_breaks(errors, gaps)});
    if (!single || known.empty()) continue;

    // Levels of a single trajectory.
    const auto level = [&](const char* name, double value, const char* kind) {
      const std::string text = fmt::format("{} {:.1f} {}", name, value, unit.name);
      chart.lines.push_back({text, kind, {t.front(), t.back()}, {value, value}});
    };
    level("RMS", rms(known), "k1");
    level("median", median(known), "k2");
  }

  return chart;
}

std::vector<SvgChart> pose_charts(const std::vector<TrajectoryComparison>& comparisons) {
  constexpr std::array<const char*, 3> kAngleNames{"roll", "pitch", "yaw"};
  std::vector<SvgChart> charts(6);
  const double start = start_of(comparisons);
  const Trajectory truth = shared_truth(comparisons);
  const auto truth_angles = angles_of(truth);

  // Positions on the left, angles on the right.
  for (std::size_t k = 0; k < 3; ++k) {
    charts[2 * k].y_label = fmt::format("{} (m)", kAxisNames[k]);
    charts[2 * k + 1].y_label = fmt::format("{} (deg)", kAngleNames[k]);
  }

  charts[0].title = titled("Pose", comparisons);
  charts[4].x_label = charts[5].x_label = "time (s)";
  for (SvgChart& chart : charts) {
    chart.width_px = 800;
    chart.height_px = 300;
  }

  // Estimates, with gaps.
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    const TrajectoryComparison& c = comparisons[i];
    const std::vector<bool> gaps = gaps_in(c.estimate);
    const std::vector<double> t = with_breaks(seconds(c.estimate, start), gaps);
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

      // Only the first chart names its curves.
      const std::string name = comparisons.size() == 1 ? "estimate" : c.name;
      charts[2 * k].lines.push_back({k == 0 ? name : "", estimate_kind(i), t,
                                     with_breaks(coordinate(c.estimate, static_cast<int>(k)), gaps)});
      charts[2 * k + 1].lines.push_back({"", estimate_kind(i), t, with_breaks(angles[k], gaps)});
    }
  }

  // Truth on top of all estimates.
  const std::vector<double> t_truth = seconds(truth, start);
  for (std::size_t k = 0; k < 3 && !truth.empty(); ++k) {
    charts[2 * k].lines.push_back(
        {k == 0 ? "truth" : "", "truth", t_truth, coordinate(truth, static_cast<int>(k))});
    charts[2 * k + 1].lines.push_back({"", "truth", t_truth, truth_angles[k]});
  }

  return charts;
}

/// Cumulative distribution of each trajectory's errors.
SvgChart error_distribution_chart(const std::vector<TrajectoryComparison>& comparisons) {
  const LengthUnit unit = unit_for(comparisons);
  SvgChart chart;
  chart.title = titled("Position error, distribution", comparisons);
  chart.height_px = 400;
  chart.x_label = fmt::format("position error ({})", unit.name);
  chart.y_label = "poses with at most that (%)";
  chart.y_range = {0.0, 100.0};
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    SvgLine line{comparisons[i].name, estimate_kind(i), finite(in_unit(errors_of(comparisons[i]), unit)), {}};
    std::sort(line.x.begin(), line.x.end());
    for (std::size_t k = 1; k <= line.x.size(); ++k) {
      line.y.push_back(100.0 * static_cast<double>(k) / static_cast<double>(line.x.size()));
    }
    chart.lines.push_back(std::move(line));
  }
  return chart;
}

core::Result<void> write_trajectory_plots(const std::vector<TrajectoryComparison>& comparisons,
                                          const std::filesystem::path& folder) {
  bool with_errors = false;

  // All inputs are checked before anything is written.
  for (const auto& comparison : comparisons) {
    if (auto checked = check(comparison); !checked) return checked;
    with_errors = with_errors || !errors_of(comparison).empty();
  }
  if (comparisons.empty()) return core::usage_error("trajectory plots: no estimate to draw");
  if (auto made = core::make_folder(folder); !made) return made;

  // Paths need no truth.
  if (auto done = core::write_file(folder / "path.svg", svg_document(path_charts(comparisons), 2)); !done)
    return done;
  if (auto done = core::write_file(folder / "poses.svg", svg_document(pose_charts(comparisons), 2)); !done)
    return done;
  if (!with_errors) return {};  // without truth there is no error to draw
  if (auto done = core::write_file(folder / "error.svg", svg_document({error_chart(comparisons)}, 1)); !done)
    return done;
  return core::write_file(folder / "error_distribution.svg",
                          svg_document({error_distribution_chart(comparisons)}, 1));
}

}  // namespace plumbline::viz
