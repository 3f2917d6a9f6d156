// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <mutex>
#include <optional>

#include "background.hpp"
#include "bindings.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/live_frames.hpp"
#include "plumbline/pipeline/input.hpp"

namespace plumbline::python {
namespace {

/// An open recording with what it needs to read.
class Recording {
 public:
  Recording(const std::string& input, const dataset::OpenOptions& options,
            const std::filesystem::path& scenes, int threads)
      : executor_(threads) {
    const OpenCvThreads one;
    source_ = value_of(pipeline::open_input(input, options, scenes, executor_, log_));
  }

  [[nodiscard]] const dataset::FrameSource& source() const { return *source_; }
  /// Messages that were not returned yet.
  std::vector<LogLine> messages() { return log_.take(); }

 private:
  QueueLog log_;
  core::Executor executor_;
  std::unique_ptr<dataset::FrameSource> source_;
};

std::size_t checked(const Recording& recording, std::size_t index) {
  if (index >= recording.source().size()) throw py::index_error("no such frame");
  return index;
}

/// index, stamp, depth_stamp, color, depth, odometry or None.
py::tuple read(const Recording& recording, std::size_t index) {
  sensor::RgbdFrame frame = [&] {
    const py::gil_scoped_release free;
    return value_of(recording.source().read(checked(recording, index)));
  }();
  py::object odometry = py::none();
  if (frame.odometry) odometry = matrix_of(*frame.odometry);
  return py::make_tuple(index, frame.stamp, frame.depth_stamp, array_of(frame.color), array_of(frame.depth),
                        odometry);
}

/// The same, not rectified.
py::tuple stored(const Recording& recording, std::size_t index) {
  const dataset::LiveFrame frame = [&] {
    const py::gil_scoped_release free;
    return value_of(dataset::stored_frame(recording.source(), checked(recording, index)));
  }();
  return py::make_tuple(index, frame.stamp, frame.depth_stamp.value_or(frame.stamp), array_of(frame.color),
                        array_of(frame.depth), py::none());
}

py::array_t<double> stamps(const Recording& recording) {
  std::vector<double> all;
  for (std::size_t i = 0; i < recording.source().size(); ++i) all.push_back(recording.source().info(i).stamp);
  const auto count = static_cast<py::ssize_t>(all.size());
  return owned(std::move(all), {count});
}

std::unique_ptr<Recording> open(const std::string& input, const std::filesystem::path& pipelines,
                                const std::string& camera, const std::string& format, double from_s,
                                std::optional<double> to_s, int every, const std::string& poses, int threads,
                                const std::map<std::string, std::string>& topics) {
  const dataset::OpenOptions options =
      open_options(pipelines, camera, format, from_s, to_s, every, poses, topics);
  const py::gil_scoped_release free;
  return std::make_unique<Recording>(input, options, pipelines / "scenes", threads);
}

}  // namespace

dataset::OpenOptions open_options(const std::filesystem::path& pipelines, const std::string& camera,
                                  const std::string& format, double from_s, std::optional<double> to_s,
                                  int every, const std::string& poses,
                                  const std::map<std::string, std::string>& topics) {
  dataset::OpenOptions options;
  options.format = format;
  options.camera = camera;

  options.cameras_folder = pipelines / "cameras";
  options.from_s = from_s;
  if (to_s) options.to_s = *to_s;
  options.every = every;
  options.poses = poses == "given"    ? dataset::PoseUse::kGiven
                  : poses == "ignore" ? dataset::PoseUse::kIgnore
                                      : dataset::PoseUse::kPrior;

  for (const auto& [what, topic] : topics) {
    std::string* name = what == "color"        ? &options.topics.color
                        : what == "depth"      ? &options.topics.depth
                        : what == "info"       ? &options.topics.info
                        : what == "depth_info" ? &options.topics.depth_info
                                               : nullptr;

    if (name == nullptr) {
      throw Failure({core::ErrorKind::kUsage,
                     "topics: there is no '" + what + "' (allowed: color, depth, info, depth_info)"});
    }
    *name = topic;
  }
  return options;
}

void add_recordings(py::module_& module) {
  py::class_<Recording>(module, "Recording")
      .def("__len__", [](const Recording& r) { return r.source().size(); })
      .def("read", &read, py::arg("index"))
      .def("stored", &stored, py::arg("index"))
      .def("messages", &Recording::messages)
      .def_property_readonly("name", [](const Recording& r) { return r.source().name(); })
      .def_property_readonly("format", [](const Recording& r) { return r.source().format(); })
      .def_property_readonly("camera", [](const Recording& r) { return r.source().camera(); })
      .def_property_readonly("stamps", &stamps)
      .def_property_readonly("truth", [](const Recording& r) -> py::object {
        const auto truth = r.source().truth();
        return truth ? py::object(arrays_of(*truth)) : py::object(py::none());
      });
  module.def("open", &open, py::arg("input"), py::arg("pipelines"), py::arg("camera"), py::arg("format"),
             py::arg("from_s"), py::arg("to_s"), py::arg("every"), py::arg("poses"), py::arg("threads"),
             py::arg("topics"));
}

}  // namespace plumbline::python
