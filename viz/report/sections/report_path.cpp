// SPDX-License-Identifier: BSD-3-Clause
// The paths of a report, from above.
#include <fmt/format.h>

#include <algorithm>

#include "plumbline/core/numbers.hpp"
#include "report_cloud.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

/// Poses are missing where stamps are further apart than five usual steps and 0.25 s.
double longest_step(const geometry::Trajectory& poses) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < poses.size(); ++i) steps.push_back(poses[i].stamp - poses[i - 1].stamp);
  if (steps.empty()) return 0.25;
  return std::max(0.25, 5.0 * core::median(std::move(steps)));
}

/// Empty in results of programs that did not look for any.
nlohmann::ordered_json tears_of(const nlohmann::ordered_json& summary) {
  const auto path = summary.find("path");
  return path != summary.end() && path->contains("tears") ? path->at("tears")
                                                          : nlohmann::ordered_json::array();
}

constexpr double kLeastDoubt_m = 0.005;

class PathChart {
 public:
  explicit PathChart(const ReportData& data) : data_(data), axes_(plan_axes(data)) {
    chart_.title = "The path from above";
    chart_.x_label = "x (m)";
    chart_.y_label = data.z_up ? "y (m)" : "z (m)";
    chart_.equal_aspect = true;
    chart_.background = plan_of(data);
  }

  std::string draw() {
    // From back to front.
    for (const ReportPath& path : data_.paths) add_truth(path);
    add_loops();
    for (const ReportPath& path : data_.paths) add(path);
    add_doubts();
    if (!lost_.x.empty()) chart_.lines.push_back(lost_);
    for (viz::SvgDots* dots : {&start_, &end_}) {
      if (!dots->x.empty()) chart_.dots.push_back(*dots);
    }
    return svg_chart(chart_);
  }

 private:
  template <typename Series>
  void put(Series& series, const Eigen::Vector3d& place) const {
    series.x.push_back(place[axes_.first]);
    series.y.push_back(place[axes_.second]);
  }
  template <typename Series>
  static void lift(Series& series) {
    series.x.push_back(kNaN);
    series.y.push_back(kNaN);
  }

  void add(const ReportPath& path) {
    if (path.poses.empty()) return;
    viz::SvgLine line{path.robot.empty() ? "path" : path.robot, robot_kind(path.number), {}, {}};
    const double most_s = longest_step(path.poses);

    // Gaps in time are drawn as lost.
    for (std::size_t i = 0; i < path.poses.size(); ++i) {
      const Eigen::Vector3d& here = path.poses[i].world_from_camera.translation;
      if (i > 0 && path.poses[i].stamp - path.poses[i - 1].stamp > most_s) {
        lift(line);
        put(lost_, path.poses[i - 1].world_from_camera.translation);
        put(lost_, here);
        lift(lost_);
      }

      put(line, here);
    }

    chart_.lines.push_back(std::move(line));

    // Keyframes, start and end.
    viz::SvgDots keyframes{path.robot.empty() ? "keyframes" : "", robot_kind(path.number), {}, {}, 2.0};
    for (const geometry::StampedPose& pose : path.keyframes)
      put(keyframes, pose.world_from_camera.translation);
    chart_.dots.push_back(std::move(keyframes));
    put(start_, path.poses.front().world_from_camera.translation);
    put(end_, path.poses.back().world_from_camera.translation);
  }

  void add_truth(const ReportPath& path) {
    if (!path.accuracy) return;
    viz::SvgLine line{truth_reported_ ? "" : "truth", "truth", {}, {}};
    truth_reported_ = true;

    // Truth in the map's frame.
    const geometry::Rigid3 estimate_from_truth = path.accuracy->truth_from_estimate.inverse();
    for (const evaluate::PoseError& pose : path.accuracy->poses) {
      put(line, estimate_from_truth * pose.truth.translation);
    }
    chart_.lines.push_back(std::move(line));
  }

  void add_loops() {
    if (data_.loops.empty()) return;
    const bool several = data_.paths.size() > 1;
    viz::SvgLine line{several ? "places recognised again, also by another robot" : "loops", "loop", {}, {}};
    for (const auto& [a, b] : data_.loops) {
      put(line, a);
      put(line, b);
      lift(line);
    }
    chart_.lines.push_back(std::move(line));
  }

  /// Adds marks where the path jumps although the tracker saw no jump, and where pairs of frames ask for
  /// another one.
  void add_doubts() {
    viz::SvgDots torn{"torn", "lost", {}, {}, 7.0, true};
    for (const auto& tear : tears_of(data_.summary)) mark(tear, torn);
    if (!torn.x.empty()) chart_.dots.push_back(std::move(torn));

    viz::SvgDots doubtful{"off by more than the result as a whole", "loop", {}, {}, 4.0, true};
    const auto& check = data_.summary.value("check", nlohmann::ordered_json::object());
    const double usual_m = std::max(kLeastDoubt_m, check.value("p95_m", 0.0));
    for (const auto& place : check.value("along", nlohmann::ordered_json::array())) {
      if (place.value("off_m", 0.0) > usual_m) mark(place, doubtful);
    }
    if (!doubtful.x.empty()) chart_.dots.push_back(std::move(doubtful));
  }

  /// Adds a dot at a place of summary.json.
  void mark(const nlohmann::ordered_json& place, viz::SvgDots& dots) const {
    for (const ReportPath& path : data_.paths) {
      if (data_.paths.size() > 1 && path.number != static_cast<std::size_t>(place.value("robot", 0)))
        continue;
      const double stamp = place.value("stamp", 0.0);
      const auto at = std::lower_bound(path.poses.begin(), path.poses.end(), stamp - 1e-6,
                                       [](const geometry::StampedPose& p, double s) { return p.stamp < s; });
      if (at != path.poses.end()) put(dots, at->world_from_camera.translation);
    }
  }

  const ReportData& data_;
  std::pair<int, int> axes_;
  viz::SvgChart chart_;
  viz::SvgLine lost_{"no poses", "lost", {}, {}};
  viz::SvgDots start_{"start", "plain", {}, {}, 5.0, true};
  viz::SvgDots end_{"end", "plain", {}, {}, 5.0, false};
  bool truth_reported_ = false;
};

/// Extent of a path along an axis.
double reach(const geometry::Trajectory& poses, int axis) {
  const auto less = [axis](const geometry::StampedPose& a, const geometry::StampedPose& b) {
    return a.world_from_camera.translation[axis] < b.world_from_camera.translation[axis];
  };
  const auto [low, high] = std::minmax_element(poses.begin(), poses.end(), less);
  return high->world_from_camera.translation[axis] - low->world_from_camera.translation[axis];
}

/// Length, speed and extent of each robot's path.
std::string numbers(const ReportData& data) {
  RobotTable table;
  for (const ReportPath& path : data.paths) {
    if (path.poses.empty()) continue;
    const geometry::StampedPose& first = path.poses.front();
    const geometry::StampedPose& last = path.poses.back();

    // A round trip ends at its start.
    const double apart_m = (last.world_from_camera.translation - first.world_from_camera.translation).norm();
    const double time_s = last.stamp - first.stamp;

    table.robot(path.robot);
    table.value("Poses", count_text(static_cast<double>(path.poses.size())));
    table.value("Keyframes", count_text(static_cast<double>(path.keyframes.size())));
    table.value("From, to", fmt::format("{} to {}", number_text(first.stamp - data.start_s, 1, "s"),
                                        number_text(last.stamp - data.start_s, 1, "s")));

    table.value("Length", number_text(path.length_m(), 2, "m"));
    table.value("Mean speed", number_text(time_s > 0.0 ? path.length_m() / time_s : kNaN, 2, "m/s"));
    table.value("Extent along x, y, z", fmt::format("{:.2f}, {:.2f}, {:.2f} m", reach(path.poses, 0),
                                                    reach(path.poses, 1), reach(path.poses, 2)));
    table.value("End from start", number_text(apart_m, 3, "m"));
  }

  return table.html();
}

}  // namespace

std::string path_html(const ReportData& data) {
  const bool any =
      std::any_of(data.paths.begin(), data.paths.end(), [](const auto& p) { return !p.poses.empty(); });
  if (!any) return note("There are no poses.");
  std::string out = PathChart(data).draw();
  out +=
      note(std::string(data.z_up ? "Seen from above" : "In the first camera's frame, along its y axis") +
           "; dots are keyframes" +
           (data.extent ? ", grey is the cloud: the darker, the more of it lies above each other, as walls do"
                        : "") +
           ".");
  return out + numbers(data);
}

}  // namespace plumbline::report
