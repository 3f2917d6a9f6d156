// SPDX-License-Identifier: BSD-3-Clause
// Bindings of map, fuse, adjust, and of the mapper that is given its frames one by one.
#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <memory>
#include <tuple>

#include "bindings.hpp"
#include "plumbline/adjust/adjust.hpp"
#include "plumbline/session/background.hpp"
#include "plumbline/session/mapper.hpp"
#include "watch.hpp"

namespace plumbline::python {
namespace {

namespace fs = std::filesystem;
using Seconds = double;

/// The options' messages and progress go to a new Watch.
std::shared_ptr<Watch> watched(RunOptions& options) {
  auto watch = std::make_shared<Watch>();
  options.log = watch;
  options.progress = [shown = watch.get()](std::size_t frames, std::size_t total) {
    shown->frames = frames;
    shown->total = total;
  };
  return watch;
}

/// A run in the background.
class Run {
 public:
  template <typename Options, typename Work>
  Run(Options options, const Work& work) : watch(watched(options)), stop(options.stop) {
    run_ = std::make_unique<session::Background>(stop, [options, work] { return work(options); });
  }
  ~Run() {
    const py::gil_scoped_release free;
    run_.reset();
  }

  [[nodiscard]] bool done() const { return run_->done(); }
  bool wait(Seconds most) { return run_->wait(most); }
  std::string reason() { return value_of(run_->result()).reason; }

  std::shared_ptr<Watch> watch;
  core::StopToken stop;

 private:
  std::unique_ptr<session::Background> run_;
};

/// A run whose frames are fed.
class MapperRun {
 public:
  MapperRun(const sensor::Camera& camera, const fs::path& output, MapperOptions options)
      : watch(watched(options)),
        stop(options.stop),
        mapper_(std::make_unique<Mapper>(value_of(Mapper::start(camera, output, options)))) {}
  ~MapperRun() {
    const py::gil_scoped_release free;
    mapper_.reset();
  }

  /// The frame's number.
  std::size_t push(double stamp, std::optional<double> depth_stamp, const py::array& color,
                   const py::array& depth, const py::object& odometry) {
    Frame frame{stamp, depth_stamp, color_of(color, "color"), depth_of(depth, "depth"), std::nullopt};
    if (!odometry.is_none()) frame.odometry = pose_of(py::array(odometry), "odometry");
    const py::gil_scoped_release free;
    return value_of(mapper_->push(frame)).value();
  }

  /// state, pose or None, whether it is a keyframe; None: not yet.
  py::object pose(std::size_t index, Seconds most) {
    const auto pose = [&] {
      const py::gil_scoped_release free;
      return mapper_->pose(index, most);
    }();
    if (!pose) return py::none();
    py::object matrix = py::none();
    if (pose->world_from_camera) matrix = matrix_of(*pose->world_from_camera);
    return py::make_tuple(pose->state, matrix, pose->keyframe.valid());
  }

  [[nodiscard]] bool wait_for_room(Seconds most) const { return mapper_->wait_for_room(most); }
  [[nodiscard]] std::size_t waiting() const { return mapper_->waiting(); }
  void close() { mapper_->close(); }
  void abandon() { mapper_->cancel(); }
  [[nodiscard]] bool done() const { return mapper_->wait(0.0); }
  bool wait(Seconds most) { return mapper_->wait(most); }
  std::string reason() { return value_of(mapper_->finish()).verdict().reason; }

  std::shared_ptr<Watch> watch;
  core::StopToken stop;

 private:
  std::unique_ptr<Mapper> mapper_;
};

std::unique_ptr<Run> start_map(const std::string& input, const fs::path& output, const MapOptions& options) {
  return std::make_unique<Run>(options,
                               [=](const MapOptions& own) { return session::run_map(input, output, own); });
}

std::unique_ptr<Run> start_fuse(const std::vector<fs::path>& maps, const fs::path& output,
                                const FuseOptions& options) {
  return std::make_unique<Run>(options,
                               [=](const FuseOptions& own) { return session::run_fuse(maps, output, own); });
}

/// Lengths as (p, q, metres, sigma), points as (p, world, sigma).
using GivenLength = std::tuple<Eigen::Vector3d, Eigen::Vector3d, double, double>;
using GivenPoint = std::tuple<Eigen::Vector3d, Eigen::Vector3d, double>;

std::unique_ptr<Run> start_adjust(const fs::path& map, const fs::path& output,
                                  const std::vector<GivenLength>& lengths,
                                  const std::vector<GivenPoint>& points, int epsg, const fs::path& tags,
                                  const fs::path& edits, const FuseOptions& options) {
  adjust::AdjustRequest request;
  request.epsg = epsg;
  request.tags = tags;
  request.edits = edits;
  for (const auto& [p, q, length, sigma] : lengths) {
    adjust::Control& control = request.control.emplace_back();
    control.name = fmt::format("length {:g} m", length);
    control.p = p;
    control.q = q;
    control.length_m = length;
    control.sigma_m = sigma;
  }
  for (const auto& [p, world, sigma] : points) {
    adjust::Control& control = request.control.emplace_back();
    control.kind = adjust::ControlKind::kPoint;
    control.name = fmt::format("point {}", request.control.size() - lengths.size());
    control.p = p;
    control.world = world;
    control.sigma_m = sigma;
  }
  return std::make_unique<Run>(
      options, [=](const FuseOptions& own) { return session::run_adjust(map, output, request, own); });
}

/// Calls of the thread that waits for a run.
template <typename Class>
void add_waiting(py::class_<Class>& run) {
  const py::call_guard<py::gil_scoped_release> free;
  run.def_property_readonly("done", &Class::done)
      .def_property_readonly(
          "progress",
          [](const Class& r) { return std::make_tuple(r.watch->frames.load(), r.watch->total.load()); })
      .def("request_stop", [](const Class& r) { r.stop.request_stop(); })
      .def("messages", [](const Class& r) { return r.watch->take(); })
      .def("wait", &Class::wait, free, py::arg("seconds"))
      .def("reason", &Class::reason, free);
}

void add_options(py::module_& module) {
  // Options of all runs
  py::class_<RunOptions>(module, "RunOptions")
      .def_readwrite("pipeline", &RunOptions::pipeline)
      .def_readwrite("set", &RunOptions::set)
      .def_readwrite("replace", &RunOptions::replace)
      .def_readwrite("threads", &RunOptions::threads);

  // Options of a recording, shared by mapping and its readers
  py::class_<RecordingOptions>(module, "RecordingOptions")
      .def(py::init<>())
      .def_readwrite("camera", &RecordingOptions::camera)
      .def_readwrite("format", &RecordingOptions::format)
      .def_readwrite("from_s", &RecordingOptions::from_s)
      .def_readwrite("to_s", &RecordingOptions::to_s)
      .def_readwrite("every", &RecordingOptions::every)
      .def_readwrite("poses", &RecordingOptions::poses)
      .def_readwrite("topics", &RecordingOptions::topics);

  // Mapping a recording
  py::class_<MapOptions, RunOptions, RecordingOptions>(module, "MapOptions")
      .def(py::init<>())
      .def_readwrite("others", &MapOptions::others)
      .def_readwrite("resume", &MapOptions::resume)
      .def_readwrite("known_map", &MapOptions::known_map)
      .def_readwrite("into", &MapOptions::into)
      .def_readwrite("rig", &MapOptions::rig);

  // Fusion and live mapping
  py::class_<FuseOptions, RunOptions>(module, "FuseOptions")
      .def(py::init<>())
      .def_readwrite("anchor", &FuseOptions::anchor)
      .def_readwrite("rig", &FuseOptions::rig);
  py::class_<MapperOptions, RunOptions>(module, "MapperOptions")
      .def(py::init<>())
      .def_readwrite("name", &MapperOptions::name)
      .def_readwrite("queue", &MapperOptions::queue);
}

}  // namespace

void add_runs(py::module_& module) {
  // Both kinds of runs share progress, waiting and stopping
  add_options(module);
  py::class_<Run> run(module, "Run");
  add_waiting(run);
  py::class_<MapperRun> mapper(module, "MapperRun");
  add_waiting(mapper);

  // The mapper is fed frame by frame
  mapper
      .def(py::init<const sensor::Camera&, const fs::path&, const MapperOptions&>(), py::arg("camera"),
           py::arg("output"), py::arg("options"))
      .def("push", &MapperRun::push, py::arg("stamp"), py::arg("depth_stamp"), py::arg("color"),
           py::arg("depth"), py::arg("odometry"))

      .def("pose", &MapperRun::pose, py::arg("index"), py::arg("seconds"))
      .def("wait_for_room", &MapperRun::wait_for_room, py::call_guard<py::gil_scoped_release>(),
           py::arg("seconds"))
      .def_property_readonly("waiting", &MapperRun::waiting)
      .def("close", &MapperRun::close)
      .def("abandon", &MapperRun::abandon);

  // Runs of recordings and maps that exist
  module.def("start_map", &start_map, py::arg("input"), py::arg("output"), py::arg("options"));
  module.def("start_adjust", &start_adjust, py::arg("map"), py::arg("output"), py::arg("lengths"),
             py::arg("points"), py::arg("epsg"), py::arg("tags"), py::arg("edits"), py::arg("options"));
  module.def("start_fuse", &start_fuse, py::arg("maps"), py::arg("output"), py::arg("options"));
}

}  // namespace plumbline::python
