// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "plumbline/core/git_lfs.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/evaluate/trajectory.hpp"

namespace plumbline::evaluate {
namespace {

using Json = nlohmann::ordered_json;

/// The name of the option's value.
const char* name_of(TrajectoryAlignment align) {
  switch (align) {
    case TrajectoryAlignment::kNone:
      return "none";
    case TrajectoryAlignment::kSe3:
      return "se3";
    case TrajectoryAlignment::kSim3:
      return "sim3";
    case TrajectoryAlignment::kStart:
      break;
  }
  return "start";
}

Json json_of(const Statistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"min", s.min},
          {"max", s.max},   {"sse", s.sse},   {"std", s.std}};
}

Json json_of(const RelativeError& e) {
  const auto brief = [](const Statistics& s) {
    return Json{{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"max", s.max}};
  };
  return {
      {"pairs", e.pairs}, {"translation_m", brief(e.translation_m)}, {"rotation_deg", brief(e.rotation_deg)}};
}

Json json_of(const geometry::Rigid3& t) {
  const Eigen::Quaterniond q = t.quaternion();
  return {{"translation_m", {t.translation.x(), t.translation.y(), t.translation.z()}},
          {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

/// The pose of the camera in the body, and what it explains.
Json json_of(const BodyReport& body) {
  Json out = json_of(body.body_from_camera);
  out["lever_m"] = body.lever_m;
  out["turn_deg"] = body.turn_deg;
  out["removed"] = body.removed;
  out["ate_before_m"] = body.ate_before_m;
  out["ate_after_m"] = body.ate_after_m;
  out["orientation_before_deg"] = body.orientation_before_deg;
  out["orientation_after_deg"] = body.orientation_after_deg;
  return out;
}

std::string row(const std::string& name, const Statistics& s, const char* unit) {
  return fmt::format("{:<22} {:>10.6f} {:>10.6f} {:>10.6f} {:>10.6f} {:>10.6f} {:>10.6f}  {}\n", name, s.rmse,
                     s.mean, s.median, s.min, s.max, s.std, unit);
}

Json json_of(const TrajectoryReport& r) {
  // Errors along the axes
  Json per_axis = Json::object();
  const std::array<const char*, 3> names = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    per_axis[names[k]] = json_of(r.axis_m[k]);
    per_axis[names[k]]["bias"] = r.axis_bias_m[k];
  }

  // RPE names its distance
  Json per_frame = json_of(r.rpe_frame);
  per_frame["frames"] = r.rpe_frames;
  Json per_second = json_of(r.rpe_second);
  per_second["seconds"] = r.rpe_seconds;

  // Accuracy
  Json out;
  out["ate_m"] = json_of(r.ate_m);
  out["rotation_deg"] = json_of(r.rotation_deg);
  out["per_axis_m"] = per_axis;
  out["rpe"] = {{"per_frame", per_frame}, {"per_second", per_second}};
  out["poses"] = r.estimated;
  out["matched"] = r.matched;

  // Tracking and path
  if (r.frames) out["frames"] = *r.frames;
  out["tracked_percent"] = r.tracked_percent ? Json(*r.tracked_percent) : Json(nullptr);
  out["first_pose_s"] = r.first_pose_s ? Json(*r.first_pose_s) : Json(nullptr);
  out["path_m"] = r.path_m;
  out["duration_s"] = r.duration_s;

  // Alignment and the body's pose
  out["alignment"] = json_of(r.truth_from_estimate);
  out["alignment"]["type"] = name_of(r.align);
  if (r.scale) {
    out["alignment"]["scale"] = r.scale->value;
    out["alignment"]["scale_sigma"] = r.scale->sigma;
  }
  if (r.body) out["body"] = json_of(*r.body);
  out["warnings"] = r.warnings;

  // Components beside the main map
  for (const ComponentReport& c : r.components) {
    out["components"].push_back({{"name", c.name},
                                 {"poses", c.poses},
                                 {"percent", c.percent ? Json(*c.percent) : Json(nullptr)},
                                 {"ate_m", json_of(c.ate_m)}});
  }
  return out;
}

}  // namespace

core::Result<std::vector<double>> read_frame_stamps(const std::filesystem::path& list) {
  // Git LFS stores pointers instead of files
  std::ifstream in(list);
  if (!in) return core::input_error(fmt::format("{}: cannot be read", list.string()));
  if (core::is_lfs_pointer(list))
    return core::input_error(fmt::format("{}: {}", list.string(), core::kLfsPointer));
  std::vector<double> stamps;
  std::string line;

  // Stamps stand first in each line
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream fields(line);
    std::string first;
    if (!(fields >> first) || first[0] == '#') continue;

    // A bad stamp is reported with its line
    const auto stamp = core::to_number(first);
    if (!stamp || !std::isfinite(*stamp)) {
      return core::input_error(
          fmt::format("{}:{}: '{}' is not a time stamp in seconds", list.string(), number, first));
    }
    stamps.push_back(*stamp);
  }

  // Stamps in order; an empty list is an error
  if (stamps.empty()) return core::input_error(fmt::format("{}: lists no frames", list.string()));
  std::sort(stamps.begin(), stamps.end());
  return stamps;
}

std::string to_json(const TrajectoryReport& r) { return core::json_text(json_of(r)); }

/// All estimates with their names, in the given order.
std::string to_json(const std::vector<NamedReport>& reports) {
  Json estimates = Json::array();
  for (const NamedReport& named : reports) {
    Json one = {{"name", named.name}};
    one.update(json_of(named.report));
    estimates.push_back(std::move(one));
  }
  return core::json_text(Json{{"estimates", std::move(estimates)}});
}

std::string to_text(const std::vector<NamedReport>& reports) {
  // Columns fit the longest name
  std::size_t width = 8;
  bool scaled = false;
  for (const NamedReport& named : reports) {
    width = std::max(width, named.name.size());
    scaled = scaled || named.report.scale;
  }

  // A dash where no pairs exist
  std::string out =
      fmt::format("{:<{}} {:>10} {:>10} {:>10} {:>10} {:>10} {:>9} {:>9}{}\n", "estimate", width, "ATE rmse",
                  "median", "max", "RPE/s m", "RPE/s deg", "matched", "tracked", scaled ? "     scale" : "");
  for (const NamedReport& named : reports) {
    const TrajectoryReport& r = named.report;
    const auto relative = [&](const Statistics& s) {
      return r.rpe_second.pairs > 0 ? fmt::format("{:.6f}", s.rmse) : std::string("-");
    };

    out += fmt::format("{:<{}} {:>10.6f} {:>10.6f} {:>10.6f} {:>10} {:>10} {:>9} {:>9}{}\n", named.name,
                       width, r.ate_m.rmse, r.ate_m.median, r.ate_m.max, relative(r.rpe_second.translation_m),
                       relative(r.rpe_second.rotation_deg), r.matched,
                       r.tracked_percent ? fmt::format("{:.2f} %", *r.tracked_percent) : "-",
                       r.scale ? fmt::format(" {:>9.5f}", r.scale->value) : "");
  }
  return out;
}

std::string to_text(const TrajectoryReport& r) {
  // Matching and tracking
  std::string out = fmt::format("matched {} of {} poses, alignment {}, path {:.3f} m in {:.2f} s\n",
                                r.matched, r.estimated, name_of(r.align), r.path_m, r.duration_s);
  if (r.tracked_percent) out += fmt::format("tracked {:.2f} % of {} frames\n", *r.tracked_percent, *r.frames);
  if (r.first_pose_s) out += fmt::format("first pose after {:.3f} s\n", *r.first_pose_s);

  // Scale and lever, if they were estimated
  if (r.scale)
    out += fmt::format("scale {:.5f}, standard deviation {:.5f} (true length / estimated length)\n",
                       r.scale->value, r.scale->sigma);

  // The body's pose, if it was removed
  if (r.body && r.body->removed) {
    const Eigen::Vector3d& at = r.body->body_from_camera.translation;
    out += fmt::format(
        "taken out of the truth: the camera is at {:.4f} {:.4f} {:.4f} m in its body ({:.1f} cm away), "
        "turned by "
        "{:.2f} degrees; ATE rmse was {:.6f} m\n",
        at.x(), at.y(), at.z(), 100.0 * r.body->lever_m, r.body->turn_deg, r.body->ate_before_m);
  }

  // Absolute errors
  out += fmt::format("{:<22} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}\n", "", "rmse", "mean", "median",
                     "min", "max", "std");
  out += row("ATE", r.ate_m, "m");
  out += row("  along x", r.axis_m[0], "m");
  out += row("  along y", r.axis_m[1], "m");
  out += row("  along z", r.axis_m[2], "m");
  out += row("orientation", r.rotation_deg, "deg");

  // Relative errors
  const std::string frames = r.rpe_frames == 1 ? "frame" : fmt::format("{} frames", r.rpe_frames);
  const std::string seconds = r.rpe_seconds == 1.0 ? "second" : fmt::format("{} s", r.rpe_seconds);
  if (r.rpe_frame.pairs > 0) {
    out += row("RPE per " + frames, r.rpe_frame.translation_m, "m");
    out += row("", r.rpe_frame.rotation_deg, "deg");
  }

  // Seconds make recordings comparable
  if (r.rpe_second.pairs > 0) {
    out += row("RPE per " + seconds, r.rpe_second.translation_m, "m");
    out += row("", r.rpe_second.rotation_deg, "deg");
  }

  // Other components are aligned by themselves
  out += fmt::format("SSE {:.6f} m^2\n", r.ate_m.sse);
  for (const ComponentReport& c : r.components) {
    const std::string share = c.percent ? fmt::format(", {:.1f} % of the frames", *c.percent) : "";
    out += fmt::format("apart from it: component {}, {} poses{}, ATE rmse {:.6f} m by itself\n", c.name,
                       c.poses, share, c.ate_m.rmse);
  }
  for (const std::string& warning : r.warnings) out += "warning: " + warning + "\n";
  return out;
}

}  // namespace plumbline::evaluate
