// SPDX-License-Identifier: BSD-3-Clause
// output: the files of the result folder.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <sstream>
#include <system_error>
#include <vector>

#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/line_export.hpp"
#include "plumbline/viz/snapshot.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

const std::vector<viz::View> kViews{viz::View::kIso,  viz::View::kTop,  viz::View::kBottom, viz::View::kFront,
                                    viz::View::kBack, viz::View::kLeft, viz::View::kRight};

class OutputStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean("ply", ply_, "Write map.ply");
    table.boolean("pcd", pcd_, "Write map.pcd");
    table.boolean("lines", lines_, "Write lines.ply, the 3D line landmarks");
    table.text("views", views_,
               "Pictures in snapshots/: any of iso top bottom front back left right; empty: none");
    table.integer("width", width_px_, {64, 8192}, "px", "Width of the pictures");
    table.integer("height", height_px_, {64, 8192}, "px", "Height of the pictures");
  }

  void check(const CheckContext& /*context*/, const core::ConfigMark& mark, const std::string& path,
             core::ConfigProblems& problems) override {
    std::istringstream words(views_);
    std::vector<std::string> names;
    for (const viz::View view : kViews) names.push_back(viz::view_name(view));
    for (std::string word; words >> word;) {
      const auto found = std::find(names.begin(), names.end(), word);
      if (found != names.end()) {
        chosen_.push_back(kViews[static_cast<std::size_t>(found - names.begin())]);
        continue;
      }
      const std::string near = core::did_you_mean(word, names);
      problems.push_back(
          {mark, path + ".views",
           fmt::format("there is no view '{}' (allowed: iso, top, bottom, front, back, left, right{})", word,
                       near.empty() ? "" : "; did you mean " + near + "?")});
    }
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    return {};
  }
  core::Result<void> process(StageIo& /*io*/) override { return {}; }  // all its inputs come at the end

  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("map");
    const auto dense = io.input<DenseCloud>("cloud");
    const std::filesystem::path& folder = context_->output_folder;
    const std::vector<std::function<core::Result<void>()>> steps{
        [&] { return ply_ ? cloud::write_ply(folder / "map.ply", *dense->cloud) : core::Result<void>(); },
        [&] { return pcd_ ? cloud::write_pcd(folder / "map.pcd", *dense->cloud) : core::Result<void>(); },
        [&] {
          return lines_ ? maps::write_lines_ply(folder / "lines.ply", map->lines) : core::Result<void>();
        },
        [&] { return dataset::write_trajectory(folder / "trajectory.txt", map->trajectory); },
        [&] { return dataset::write_trajectory(folder / "keyframes.txt", keyframe_trajectory(*map)); },
        [&] { return write_frames(folder / "frames.csv", *map, io.frame()); },
        [&] { return write_snapshots(folder / "snapshots", *map, *dense); },
    };
    for (const auto& step : steps) {
      if (auto written = step(); !written) return written;
    }
    return {};
  }

 private:
  static geometry::Trajectory keyframe_trajectory(const MapResult& map) {
    geometry::Trajectory poses;
    for (const KeyframePose& keyframe : map.keyframes)
      poses.push_back({keyframe.stamp, keyframe.world_from_camera});
    return poses;
  }

  /// One line for every frame of the run, the unreadable ones too.
  static core::Result<void> write_frames(const std::filesystem::path& file, const MapResult& map,
                                         std::size_t frames) {
    const auto commas = std::count(map.frame_columns.begin(), map.frame_columns.end(), ',');
    const std::string nothing(static_cast<std::size_t>(commas), ',');
    core::OutputFile out(file);
    out.write("frame,state," + map.frame_columns + "\n");
    auto row = map.frames.begin();
    for (std::size_t f = 0; f < frames; ++f) {
      if (row != map.frames.end() && row->frame == f) {
        out.write(fmt::format("{},{},{}\n", f, row->state, row->columns));
        ++row;
      } else {
        out.write(fmt::format("{},unreadable,{}\n", f, nothing));
      }
    }
    return out.commit();
  }

  core::Result<void> write_snapshots(const std::filesystem::path& folder, const MapResult& map,
                                     const DenseCloud& dense) const {
    if (chosen_.empty()) return {};
    std::error_code ec;
    std::filesystem::create_directories(folder, ec);
    if (ec)
      return core::output_error(fmt::format("{}: cannot be created ({})", folder.string(), ec.message()));
    viz::Scene scene;
    scene.cloud = dense.cloud;
    scene.title = context_->source->name();
    viz::CameraPath path;
    path.trajectory = map.trajectory;
    scene.paths.push_back(std::move(path));
    for (const viz::View view : chosen_) {
      viz::SnapshotOptions options;
      options.view = view;
      options.width_px = width_px_;
      options.height_px = height_px_;
      auto drawn = viz::render_snapshot(scene, options, folder / (viz::view_name(view) + ".png"));
      if (!drawn) return drawn;
    }
    return {};
  }

  bool ply_ = true;
  bool pcd_ = true;
  bool lines_ = true;
  std::string views_ = "iso top front";
  int width_px_ = 1600;
  int height_px_ = 1200;
  std::vector<viz::View> chosen_;
  const RunContext* context_ = nullptr;
};

}  // namespace

StageType output_stage() {
  return {"output",
          "Writes the result folder: clouds, trajectories, lines, tables and pictures",
          Mode::kSerial,
          {{"map", map_port()}, {"cloud", cloud_port()}},
          {},
          [] { return std::make_unique<OutputStage>(); },
          true};
}

}  // namespace plumbline::pipeline
