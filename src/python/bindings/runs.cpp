// SPDX-License-Identifier: BSD-3-Clause
// map, fuse, and the mapper that frames are fed to.
#include <chrono>

#include "background.hpp"
#include "bindings.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/live_frames.hpp"
#include "plumbline/pipeline/fuse_maps.hpp"
#include "plumbline/pipeline/observer.hpp"

namespace plumbline::python {
namespace {

namespace fs = std::filesystem;

void fill(pipeline::RunRequest& request, const fs::path& output, const std::string& pipeline,
          const std::vector<std::string>& overrides, const fs::path& pipelines, bool replace) {
  request.output = output;
  request.pipeline = pipeline;
  request.overrides = overrides;
  request.pipelines_folder = pipelines;
  request.replace = replace;
}

std::unique_ptr<Background> start_map(const std::vector<std::string>& inputs, const fs::path& output,
                                      const std::string& pipeline, const std::vector<std::string>& overrides,
                                      const fs::path& pipelines, const std::string& camera,
                                      const std::string& format, double from_s, std::optional<double> to_s,
                                      int every, const std::string& poses,
                                      const std::map<std::string, std::string>& topics, int threads,
                                      bool replace, bool resume, const fs::path& known_map,
                                      const fs::path& into) {
  pipeline::MapRequest request;
  fill(request, output, pipeline, overrides, pipelines, replace);
  if (inputs.empty()) throw Failure({core::ErrorKind::kUsage, "inputs: name a recording"});
  request.input = inputs.front();
  request.others.assign(inputs.begin() + 1, inputs.end());
  request.open = open_options(pipelines, camera, format, from_s, to_s, every, poses, topics);
  request.resume = resume;
  request.known_map = known_map;
  request.into = into;

  return std::make_unique<Background>(
      [request, threads](core::Log& log, const core::StopToken& stop, const pipeline::Progress& progress) {
        const core::Executor executor(threads);
        return pipeline::map_recording(request, executor, log, stop, progress);
      });
}

std::unique_ptr<Background> start_fuse(const std::vector<fs::path>& maps, const fs::path& output,
                                       const std::string& pipeline, const std::vector<std::string>& overrides,
                                       const fs::path& pipelines, const std::string& anchor, int threads,
                                       bool replace) {
  pipeline::FuseRequest request;
  fill(request, output, pipeline, overrides, pipelines, replace);
  request.maps = maps;
  request.anchor = anchor;
  return std::make_unique<Background>(
      [request, threads](core::Log& log, const core::StopToken& stop, const pipeline::Progress& progress) {
        const core::Executor executor(threads);
        return pipeline::fuse_stored_maps(request, executor, log, stop, progress);
      });
}

/// Collects the tracker's poses for waiting callers.
class Poses : public pipeline::RunObserver {
 public:
  void processed(const pipeline::LivePose& pose) override {
    const std::lock_guard lock(mutex_);
    poses_.push_back(pose);
    changed_.notify_all();
  }

  /// None if the pose has not come within so many seconds.
  std::optional<pipeline::LivePose> get(std::size_t index, double seconds) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return index < poses_.size(); });
    return index < poses_.size() ? std::optional(poses_[index]) : std::nullopt;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<pipeline::LivePose> poses_;
};

/// A run whose frames are fed.
class MapperRun {
 public:
  MapperRun(const sensor::Camera& camera, const fs::path& output, const std::string& pipeline,
            const std::vector<std::string>& overrides, const fs::path& pipelines, const std::string& name,
            int threads, bool replace)
      : live_(std::make_shared<dataset::LiveFrames>(camera, dataset::LiveFramesOptions{name})),
        poses_(std::make_shared<Poses>()) {
    pipeline::MapRequest request;
    fill(request, output, pipeline, overrides, pipelines, replace);
    request.input = name;
    request.live = live_;
    request.observer = poses_;
    run_ = std::make_unique<Background>(
        [request, threads](core::Log& log, const core::StopToken& stop, const pipeline::Progress& progress) {
          const core::Executor executor(threads);
          return pipeline::map_recording(request, executor, log, stop, progress);
        });
  }

  ~MapperRun() { live_->abandon(); }

  /// The frame's number.
  std::size_t push(double stamp, std::optional<double> depth_stamp, const py::array& color,
                   const py::array& depth, const py::object& odometry) {
    dataset::LiveFrame frame{stamp, depth_stamp, color_of(color, "color"), depth_of(depth, "depth"),
                             std::nullopt};
    if (!odometry.is_none()) frame.odometry = pose_of(py::array(odometry), "odometry");
    const py::gil_scoped_release free;
    value_of(live_->push(frame));
    return fed_++;
  }

  /// state, pose or None, whether it is a keyframe; None: not yet.
  py::object pose(std::size_t index, double seconds) {
    const auto pose = [&] {
      const py::gil_scoped_release free;
      return poses_->get(index, seconds);
    }();
    if (!pose) return py::none();
    py::object matrix = py::none();
    if (pose->world_from_camera) matrix = matrix_of(*pose->world_from_camera);
    return py::make_tuple(pose->state, matrix, pose->keyframe.valid());
  }

  [[nodiscard]] bool wait_for_room(std::size_t most, double seconds) const {
    const py::gil_scoped_release free;
    return live_->wait_for_room(most, seconds);
  }

  [[nodiscard]] std::size_t waiting() const { return live_->waiting(); }
  void close() const { live_->close(); }
  void abandon() const { live_->abandon(); }
  [[nodiscard]] Background& run() { return *run_; }

 private:
  std::shared_ptr<dataset::LiveFrames> live_;
  std::shared_ptr<Poses> poses_;
  std::size_t fed_ = 0;
  std::unique_ptr<Background> run_;  ///< last: ends before the rest does
};

}  // namespace

void add_runs(py::module_& module) {
  py::class_<Background>(module, "Background")
      .def_property_readonly("done", &Background::done)
      .def_property_readonly("progress", &Background::progress)
      .def("request_stop", &Background::request_stop)
      .def("messages", &Background::messages)
      .def("wait", &Background::wait, py::arg("seconds"))
      .def("reason", &Background::reason);

  py::class_<MapperRun>(module, "MapperRun")
      .def(py::init<const sensor::Camera&, const fs::path&, const std::string&,
                    const std::vector<std::string>&, const fs::path&, const std::string&, int, bool>(),
           py::arg("camera"), py::arg("output"), py::arg("pipeline"), py::arg("overrides"),
           py::arg("pipelines"), py::arg("name"), py::arg("threads"), py::arg("replace"))
      .def("push", &MapperRun::push, py::arg("stamp"), py::arg("depth_stamp"), py::arg("color"),
           py::arg("depth"), py::arg("odometry"))

      .def("pose", &MapperRun::pose, py::arg("index"), py::arg("seconds"))
      .def("wait_for_room", &MapperRun::wait_for_room, py::arg("most"), py::arg("seconds"))
      .def_property_readonly("waiting", &MapperRun::waiting)
      .def("close", &MapperRun::close)
      .def("abandon", &MapperRun::abandon)
      .def_property_readonly("run", &MapperRun::run, py::return_value_policy::reference_internal);

  module.def("start_map", &start_map, py::arg("inputs"), py::arg("output"), py::arg("pipeline"),
             py::arg("overrides"), py::arg("pipelines"), py::arg("camera"), py::arg("format"),
             py::arg("from_s"), py::arg("to_s"), py::arg("every"), py::arg("poses"), py::arg("topics"),
             py::arg("threads"), py::arg("replace"), py::arg("resume"), py::arg("known_map"),
             py::arg("into"));
  module.def("start_fuse", &start_fuse, py::arg("maps"), py::arg("output"), py::arg("pipeline"),
             py::arg("overrides"), py::arg("pipelines"), py::arg("anchor"), py::arg("threads"),
             py::arg("replace"));
}

}  // namespace plumbline::python
