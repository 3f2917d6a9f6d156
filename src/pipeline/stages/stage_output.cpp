// SPDX-License-Identifier: BSD-3-Clause
// output: the files of the result folder.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>
#include <vector>

#include "options/exports_option.hpp"
#include "plumbline/cloud/fusion/dense_fusion.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/csv.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/line_export.hpp"
#include "plumbline/pipeline/observer.hpp"
#include "plumbline/viz/snapshot.hpp"
#include "results/frame_rows.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

const std::vector<viz::View> kViews{viz::View::kIso,  viz::View::kTop,  viz::View::kBottom, viz::View::kFront,
                                    viz::View::kBack, viz::View::kLeft, viz::View::kRight};

class OutputStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean("ply", ply_, "Write map.ply");
    table.boolean("pcd", pcd_, "Write map.pcd");
    table.integer("levels", levels_, {0, 6}, "",
                  "Number of coarser clouds in levels/, each with twice the voxel size of the previous one");
    table.boolean("lines", lines_, "Write lines.ply, the 3D line landmarks");
    table.text("views", views_,
               "Pictures in snapshots/: any of iso top bottom front back left right; empty: none",
               core::EmptyValue::kAllowed);
    table.integer("width", width_px_, {64, 8192}, "px", "Width of the pictures");
    table.integer("height", height_px_, {64, 8192}, "px", "Height of the pictures");
    exports_.declare(table);
  }

  void check(const CheckContext& /*context*/, const core::ConfigMark& mark, const std::string& path,
             core::ConfigProblems& problems) override {
    exports_.check(path, problems);
    std::istringstream words(views_);
    std::vector<std::string> names;
    for (const viz::View view : kViews) names.push_back(viz::view_name(view));
    for (std::string word; words >> word;) {
      const auto found = std::find(names.begin(), names.end(), word);
      if (found != names.end()) {
        chosen_.push_back(kViews[static_cast<std::size_t>(found - names.begin())]);
        continue;
      }
      problems.push_back(
          {mark, path + ".views", fmt::format("there is no view '{}'{}", word, core::hint(word, names))});
    }
  }

  [[nodiscard]] std::vector<std::string> files() const override {
    std::vector<std::string> files{"trajectory.txt", "keyframes.txt", "keyframes.csv", "frames.csv"};
    if (ply_) files.emplace_back("map.ply");
    if (pcd_) files.emplace_back("map.pcd");
    if (lines_) files.emplace_back("lines.ply");
    if (levels_ > 0) files.emplace_back("levels/map_*mm.ply");
    for (const viz::View view : chosen_) files.push_back("snapshots/" + viz::view_name(view) + ".png");
    for (const std::string& file : exports_.files()) files.push_back(file);
    return files;
  }

  [[nodiscard]] const std::vector<exports::ExportRequest>* wanted_exports() const override {
    return &exports_.requests();
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    const auto dense = io.input<DenseCloud>("cloud");
    const auto given = io.input<MapResult>("map");
    if (given->map != nullptr) path_ = maps::check_path(given->frame_poses, *given->map);
    if (context_->hooks.observer != nullptr) tell_observer(*given, *dense);

    // The observer followed the run in the frame of the map; files are in the frame of the results.
    const MapResult map = moved(*given, dense->output_from_map);
    const std::filesystem::path& folder = context_->output_folder;
    const cloud::CloudColumns& columns = dense->columns;
    const core::Result<void> nothing;

    const std::vector<std::function<core::Result<void>()>> steps{
        [&] { return ply_ ? cloud::write_ply(folder / "map.ply", *dense->cloud, columns) : nothing; },
        [&] { return pcd_ ? cloud::write_pcd(folder / "map.pcd", *dense->cloud, columns) : nothing; },
        [&] { return write_levels(folder / "levels", *dense); },
        [&] { return lines_ ? maps::write_lines_ply(folder / "lines.ply", map.lines) : nothing; },
        [&] { return write_trajectories(folder, map); },
        [&] { return write_keyframes(folder / "keyframes.csv", map); },
        [&] {
          return map.frames.empty()
                     ? nothing
                     : write_frame_rows(folder / "frames.csv", map.frame_columns, map.frames, io.frame());
        },
        [&] { return write_components(*given, *dense); },
    };

    // Files are written while this thread draws the pictures. The error that is reported is the first one in
    // the list, not the first in time.
    std::vector<core::Result<void>> written(steps.size());
    std::vector<core::Executor::Job> jobs;
    for (std::size_t i = 0; i < steps.size(); ++i)
      jobs.push_back(context_->executor->submit([&, i] { written[i] = steps[i](); }));
    auto drawn = write_snapshots(folder / "snapshots", map, *dense);

    for (core::Executor::Job& job : jobs) job.wait();
    for (const auto& one : written) {
      if (!one) return one;
    }

    return drawn;
  }

  void report(Json& summary) const override {
    Json& path = summary["path"];
    path["largest_step_m"] = rounded(path_.largest_m);
    path["largest_step_rad"] = rounded(path_.largest_rad);
    for (const maps::PathStep& step : path_.tears) {
      path["tears"].push_back({{"stamp", step.stamp},
                               {"robot", step.to.robot},
                               {"from_keyframe", step.from.index},
                               {"to_keyframe", step.to.index},
                               {"off_m", rounded(step.off_m)},
                               {"off_rad", rounded(step.off_rad)}});
    }
  }

  void doubt(const Json& /*summary*/, std::vector<Doubt>& reasons) const override {
    if (path_.tears.empty()) return;
    const auto& worst = *std::max_element(path_.tears.begin(), path_.tears.end(),
                                          [](const auto& a, const auto& b) { return a.off_m < b.off_m; });
    reasons.push_back(
        {Doubt::About::kTornMap,
         fmt::format(
             "the map is torn: at {:.3f} s, between keyframes {} and {}, the path jumps by {:.1f} cm "
             "and {:.1f} degrees that the tracker did not see{}",
             worst.stamp, worst.from.index, worst.to.index, 100.0 * worst.off_m, worst.off_rad * 180.0 / M_PI,
             path_.tears.size() > 1 ? fmt::format("; {} such places in all", path_.tears.size()) : "")});
  }

 private:
  void tell_observer(const MapResult& map, const DenseCloud& dense) const {
    std::vector<geometry::Trajectory> paths;
    const std::size_t robots = std::max<std::size_t>(map.robots.size(), 1);
    for (std::size_t r = 0; r < robots; ++r)
      paths.push_back(trajectory_of(map, map.robots.empty() ? 0 : map.robots[r].number));
    context_->hooks.observer->finished(paths, dense.output_from_map.inverse(), *dense.cloud);
  }

  /// Poses and lines in the output's frame.
  static MapResult moved(MapResult map, const geometry::Rigid3& output_from_map) {
    maps::move(map, output_from_map);
    for (auto& [start, end] : map.lines) {
      start = output_from_map * start;
      end = output_from_map * end;
    }
    return map;
  }

  /// Components that never joined, each in a folder and a frame of its own.
  core::Result<void> write_components(const MapResult& given, const DenseCloud& dense) const {
    for (std::size_t i = 0; i < given.apart.size(); ++i) {
      const DenseCloud& own = *dense.apart[i];
      const MapResult map = moved(*given.apart[i], own.output_from_map);
      const std::filesystem::path folder = context_->output_folder / "components" / map.name;
      if (auto made = core::make_folder(folder); !made) return made;

      // Components get the basic files only: other clouds, tables and pictures are of the main map.
      if (ply_) {
        if (auto written = cloud::write_ply(folder / "map.ply", *own.cloud, own.columns); !written)
          return written;
      }

      if (lines_) {
        if (auto written = maps::write_lines_ply(folder / "lines.ply", map.lines); !written) return written;
      }
      if (auto written = dataset::write_trajectory(folder / "trajectory.txt", map.trajectory); !written)
        return written;

      auto written = dataset::write_trajectory(folder / "keyframes.txt", maps::trajectory(map.keyframes));
      if (!written) return written;
    }

    return {};
  }

  core::Result<void> write_levels(const std::filesystem::path& folder, const DenseCloud& dense) const {
    if (levels_ == 0) return {};
    if (auto made = core::make_folder(folder); !made) return made;
    double voxel_m = dense.voxel_m;
    for (int level = 0; level < levels_; ++level) {
      voxel_m *= 2.0;
      const cloud::FusedCloud coarse = cloud::coarser(*dense.cloud, dense.columns, voxel_m);
      const std::string name = fmt::format("map_{:g}mm.ply", std::round(1e6 * voxel_m) / 1e3);
      if (auto written = cloud::write_ply(folder / name, *coarse.cloud, coarse.columns); !written)
        return written;
    }
    return {};
  }

  /// True if the run was given several robots, even if one alone is in the map.
  [[nodiscard]] bool several() const {
    return context_->input.robots != nullptr && context_->input.robots->size() > 1;
  }

  /// Several robots: each that is in the map in its own folder.
  [[nodiscard]] core::Result<void> write_trajectories(const std::filesystem::path& folder,
                                                      const MapResult& map) const {
    if (!several()) {
      auto written = dataset::write_trajectory(folder / "trajectory.txt", map.trajectory);
      return written ? dataset::write_trajectory(folder / "keyframes.txt", maps::trajectory(map.keyframes))
                     : written;
    }
    for (const RobotInfo& robot : map.robots) {
      const std::filesystem::path own = folder / "robots" / robot.name;
      if (auto made = core::make_folder(own); !made) return made;
      auto written = dataset::write_trajectory(own / "trajectory.txt", trajectory_of(map, robot.number));
      if (!written) return written;
      written =
          dataset::write_trajectory(own / "keyframes.txt", maps::trajectory(map.keyframes, robot.number));
      if (!written) return written;
    }
    return {};
  }

  /// Empty: not known.
  static std::string sigma_cell(double sigma, int decimals) {
    return std::isfinite(sigma) ? fmt::format("{:.{}f}", sigma, decimals) : "";
  }

  /// Writes each keyframe's pose, its accuracy relative to the first one, and its numbers of constraints.
  static core::Result<void> write_keyframes(const std::filesystem::path& file, const MapResult& map) {
    std::map<std::int32_t, std::string> names;
    for (const RobotInfo& robot : map.robots) names[robot.number] = robot.name;
    core::OutputFile out(file);
    out.write("robot,keyframe,stamp,tx,ty,tz,qx,qy,qz,qw,sigma_position,sigma_rotation,points,lines,edges\n");

    // Pose, and its accuracy where it is known.
    for (std::size_t i = 0; i < map.keyframes.size(); ++i) {
      const maps::KeyframePose& keyframe = map.keyframes[i];
      const Eigen::Vector3d& t = keyframe.world_from_camera.translation;
      const Eigen::Quaterniond q = keyframe.world_from_camera.quaternion();
      out.write(fmt::format("{},{},{:.6f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},",
                            core::csv_field(names[keyframe.id.robot]), keyframe.id.index, keyframe.stamp,
                            t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()));

      const std::vector<mapping::KeyframeAccuracy>& all = map.accuracy.keyframes;
      const auto* known = all.empty() ? nullptr : &all[i];
      out.write(known ? fmt::format("{},{},{},{},{}\n", sigma_cell(known->sigma_position_m(), 6),
                                    sigma_cell(known->sigma_rotation_rad(), 7), known->points, known->lines,
                                    known->edges)
                      : ",,,,\n");
    }
    return out.commit();
  }

  core::Result<void> write_snapshots(const std::filesystem::path& folder, const MapResult& map,
                                     const DenseCloud& dense) const {
    if (chosen_.empty()) return {};
    if (auto made = core::make_folder(folder); !made) return made;

    viz::Scene scene;
    scene.cloud = dense.cloud;
    scene.title = context_->input.source != nullptr ? context_->input.source->name() : "fused maps";

    // The paths of several robots need names and colours, which add_robots() gives them.
    if (map.robots.size() < 2) {
      viz::CameraPath path;
      path.trajectory = map.trajectory;
      scene.paths.push_back(std::move(path));
    }

    add_robots(map, dense, scene);
    std::vector<viz::Snapshot> snapshots;
    const auto add = [&](const std::string& name, viz::View view, viz::ColorMode color) {
      snapshots.push_back({picture_options(view, color, dense), folder / (name + ".png")});
    };

    // Colours by robot show which part of a merged map each robot has seen.
    for (const viz::View view : chosen_) {
      if (map.robots.size() > 1 && !dense.columns.robot.empty())
        add("robots_" + viz::view_name(view), view, viz::ColorMode::kRobot);
      add(viz::view_name(view), view, viz::ColorMode::kRgb);
    }

    return viz::render_snapshots(scene, snapshots, *context_->executor);
  }

  /// Adds the paths of several robots, and the robot that saw each point.
  static void add_robots(const MapResult& map, const DenseCloud& dense, viz::Scene& scene) {
    if (map.robots.size() < 2) return;
    for (const RobotInfo& robot : map.robots) {
      const auto number = static_cast<std::size_t>(robot.number);
      viz::CameraPath path;
      path.name = robot.name;
      path.color = viz::category_color(number);
      path.trajectory = trajectory_of(map, robot.number);
      scene.paths.push_back(std::move(path));
      if (scene.robot_names.size() <= number) scene.robot_names.resize(number + 1);
      scene.robot_names[number] = robot.name;
    }
    scene.scalars.assign(dense.columns.robot.begin(), dense.columns.robot.end());
  }

  [[nodiscard]] viz::SnapshotOptions picture_options(viz::View view, viz::ColorMode color,
                                                     const DenseCloud& dense) const {
    viz::SnapshotOptions options;
    options.view = view;
    options.color = color;
    if (dense.upright) options.up = Eigen::Vector3d::UnitZ();
    options.width_px = width_px_;
    options.height_px = height_px_;
    return options;
  }

  bool ply_ = true;
  bool pcd_ = true;
  int levels_ = 0;
  bool lines_ = true;
  std::string views_ = "iso top front";
  ExportsOption exports_;
  int width_px_ = 1600;
  int height_px_ = 1200;
  std::vector<viz::View> chosen_;
  const RunContext* context_ = nullptr;
  maps::PathCheck path_;
};

}  // namespace

StageType output_stage() {
  return stage_type<OutputStage>("output",
                                 "Writes the result folder: clouds, trajectories, lines, tables and pictures",
                                 Mode::kSerial, {{"map", map_port()}, {"cloud", cloud_port()}}, {}, true);
}

}  // namespace plumbline::pipeline
