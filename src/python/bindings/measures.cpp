// SPDX-License-Identifier: BSD-3-Clause
// Evaluation, exports and images of results.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "bindings.hpp"
#include "option_values.hpp"
#include "plumbline/changes/compare.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/evaluate/cloud.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/exports/export.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/session/map.hpp"
#include "plumbline/viz/snapshot.hpp"
#include "watch.hpp"

namespace plumbline::python {
namespace {

namespace fs = std::filesystem;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// JSON, and for each matched pose its stamp and its distance from the truth, metres.
py::tuple evaluate_trajectory(const Doubles& stamps, const Doubles& poses, const Doubles& true_stamps,
                              const Doubles& true_poses, const OptionValues& values) {
  evaluate::TrajectoryOptions options;
  set_options(options, values, "evaluate_trajectory");
  const auto report = value_of(evaluate::evaluate_trajectory(
      trajectory_of(stamps, poses), trajectory_of(true_stamps, true_poses), options));
  std::vector<double> at;
  std::vector<double> errors;
  for (const evaluate::PoseError& pose : report.poses) {
    at.push_back(pose.stamp);
    errors.push_back(pose.distance_m);
  }

  const auto count = static_cast<py::ssize_t>(at.size());
  return py::make_tuple(evaluate::to_json(report), owned(std::move(at), {count}),
                        owned(std::move(errors), {count}));
}

/// Points and, if given, normals; a normal that is not known is zero.
evaluate::SurfaceSamples samples_of(const Doubles& points, const std::optional<Doubles>& normals) {
  evaluate::SurfaceSamples samples;
  for (py::ssize_t i = 0; i < points.shape(0); ++i) {
    samples.points.emplace_back(static_cast<float>(points.at(i, 0)), static_cast<float>(points.at(i, 1)),
                                static_cast<float>(points.at(i, 2)));
    if (!normals) continue;
    const Eigen::Vector3f normal(static_cast<float>(normals->at(i, 0)), static_cast<float>(normals->at(i, 1)),
                                 static_cast<float>(normals->at(i, 2)));
    samples.normals.push_back(normal.allFinite() ? normal : Eigen::Vector3f::Zero());
  }
  return samples;
}

/// JSON, and the error of each point, metres (empty without a reference). The points are less `shift`.
py::tuple evaluate_cloud(const Doubles& points, const std::array<double, 3>& shift,
                         const std::optional<Doubles>& normals, const fs::path& reference,
                         const std::vector<std::pair<fs::path, fs::path>>& paths, const OptionValues& values,
                         int threads) {
  // Options are checked before the files are read
  evaluate::CloudOptions options;
  set_options(options, values, "evaluate_cloud");
  evaluate::SurfaceSamples samples = samples_of(points, normals);
  samples.shift = {shift[0], shift[1], shift[2]};
  evaluate::CloudReport report;

  // Python may run other threads meanwhile
  {
    const py::gil_scoped_release free;
    evaluate::Reference truth;
    if (!reference.empty()) truth = value_of(evaluate::load_reference(reference));
    std::vector<evaluate::TrajectoryPair> pairs;
    for (const auto& [estimate, true_path] : paths) {
      pairs.push_back(
          {value_of(dataset::read_trajectory(estimate)), value_of(dataset::read_trajectory(true_path))});
    }

    // The error of every point needs a reference
    const core::Executor executor(threads);
    report = value_of(
        evaluate::evaluate_cloud(samples, reference.empty() ? nullptr : &truth, options, pairs, executor));
  }
  const auto count = static_cast<py::ssize_t>(report.error_m.size());
  return py::make_tuple(evaluate::to_json(report), owned(std::move(report.error_m), {count}));
}

/// Files that were written, and notes.
py::tuple write_export(const fs::path& input, const fs::path& output, const std::string& format,
                       const std::string& what, const OptionValues& values, bool replace, int threads) {
  // Options given by the user
  exports::ExportRequest request;
  request.input = input;
  request.output = output;
  request.format = format;
  request.replace = replace;

  // Without a name it is the cloud
  request.content = what == "mesh"         ? exports::Content::kMesh
                    : what == "trajectory" ? exports::Content::kTrajectory
                    : what == "keyframes"  ? exports::Content::kKeyframes
                    : what == "lines"      ? exports::Content::kLines
                                           : exports::Content::kCloud;
  set_options(request.options, values, "export");
  for (const auto& [key, value] : values) request.given.insert(key);

  // Other Python threads run during the export
  const py::gil_scoped_release free;
  const core::Executor executor(threads);
  Watch log;
  const fs::path pipelines = value_of(find_pipelines());

  // Some formats need the images of the recordings
  request.open = [&](const exports::RecordingName& name) {
    dataset::OpenOptions open;
    open.camera = name.camera;
    open.format = name.format.empty() ? "auto" : name.format;
    open.cameras_folder = pipelines / "cameras";
    return pipeline::open_input(name.input, open, pipelines / "scenes", executor, log);
  };

  const exports::ExportSummary summary = value_of(exports::write_export(request, executor, log, nullptr));

  // Python objects need the interpreter's lock again
  const py::gil_scoped_acquire held;
  return py::make_tuple(summary.written, summary.notes);
}

/// Writes a comparison of two maps.
void compare(const fs::path& before, const fs::path& after, const fs::path& output, bool given_order,
             const OptionValues& values, bool replace, int threads) {
  changes::CompareRequest request;
  request.before = before;
  request.after = after;
  request.output = output;
  request.replace = replace;
  request.order = given_order ? changes::Order::kGiven : changes::Order::kStamps;
  set_options(request.options, values, "compare");
  const py::gil_scoped_release free;
  Watch log;
  value_of(changes::compare_maps(request, core::Executor(threads), log, nullptr));
}

/// A result's cloud, paths and, if wanted, lines; `frame`: theirs.
viz::Scene scene_of(const fs::path& input, bool lines, cloud::CloudFrame& frame) {
  viz::Scene scene;

  // A single cloud has no paths
  if (fs::is_regular_file(input) && input.extension() != ".db") {
    const cloud::CloudFile file = value_of(cloud::read_cloud(input, cloud::LargeCoordinates::kShifted));
    scene.cloud = file.cloud;
    frame = maps::frame_of_cloud(input, file.frame);
    return scene;
  }

  // A result has paths, and lines on request
  const maps::MapPlace place = value_of(maps::find_map(input));
  const cloud::CloudFile file = value_of(maps::read_map_cloud(place, core::Executor(1)));
  scene.cloud = file.cloud;
  frame = file.frame;

  if (!place.result) return scene;
  for (const fs::path& folder : place.result->robot_folders())
    scene.paths.emplace_back().trajectory = value_of(dataset::read_trajectory(folder / "trajectory.txt"));
  if (!lines) return scene;
  for (const auto& [a, b] : value_of(maps::read_lines_ply(place.result->lines())))
    scene.segments.push_back({a, b});
  return scene;
}

/// Colour image, H x W x 3, red first.
py::array render(const fs::path& input, const std::string& title, bool lines, const OptionValues& values,
                 const fs::path& picture) {
  viz::SnapshotOptions options;
  set_options(options, values, "render");
  cv::Mat image;
  {
    const py::gil_scoped_release free;
    cloud::CloudFrame frame;
    viz::Scene scene = scene_of(input, lines, frame);
    scene.title = title;
    if (frame.up() == cloud::Up::kZ) options.up = Eigen::Vector3d::UnitZ();
    value_of(viz::render_snapshot(scene, options, picture));
    image = value_of(dataset::read_image(picture));
  }
  return array_of(image);
}

}  // namespace

void add_measures(py::module_& module) {
  module.def("evaluate_trajectory", &evaluate_trajectory, py::arg("stamps"), py::arg("poses"),
             py::arg("true_stamps"), py::arg("true_poses"), py::arg("options"));
  module.def("evaluate_cloud", &evaluate_cloud, py::arg("points"), py::arg("shift"), py::arg("normals"),
             py::arg("reference"), py::arg("paths"), py::arg("options"), py::arg("threads"));
  module.def("write_export", &write_export, py::arg("input"), py::arg("output"), py::arg("format"),
             py::arg("what"), py::arg("options"), py::arg("replace"), py::arg("threads"));
  module.def("compare", &compare, py::arg("before"), py::arg("after"), py::arg("output"),
             py::arg("given_order"), py::arg("options"), py::arg("replace"), py::arg("threads"));
  module.def("render", &render, py::arg("input"), py::arg("title"), py::arg("lines"), py::arg("options"),
             py::arg("picture"));
}

}  // namespace plumbline::python
