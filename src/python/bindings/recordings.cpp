// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "bindings.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/live_frames.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/session/background.hpp"
#include "plumbline/session/map.hpp"
#include "watch.hpp"

namespace plumbline::python {
namespace {

/// An open recording with what it needs to read.
class Recording {
 public:
  Recording(const std::string& input, const RecordingOptions& options, int threads) : executor_(threads) {
    const session::OpenCvThreads one;
    const std::filesystem::path pipelines = value_of(find_pipelines());
    source_ = value_of(pipeline::open_input(input, value_of(session::open_options(options, pipelines)),
                                            pipelines / "scenes", executor_, log_));
  }

  [[nodiscard]] const dataset::FrameSource& source() const { return *source_; }
  /// Messages that were not returned yet.
  std::vector<LogLine> messages() { return log_.take(); }

 private:
  Watch log_;
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

std::unique_ptr<Recording> open(const std::string& input, const RecordingOptions& options, int threads) {
  const py::gil_scoped_release free;
  return std::make_unique<Recording>(input, options, threads);
}

}  // namespace

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
  module.def("open", &open, py::arg("input"), py::arg("options"), py::arg("threads"));
}

}  // namespace plumbline::python
