// SPDX-License-Identifier: BSD-3-Clause
#include "bindings.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/camera_file.hpp"
#include "plumbline/session/map.hpp"

namespace plumbline::python {
namespace {

/// A camera of the given intrinsics; wrong ones are refused at once.
sensor::Camera make_camera(int width, int height, double fx, double fy, double cx, double cy,
                           double depth_scale, double fps) {
  sensor::Camera camera;
  camera.name = "camera";
  camera.color = {width, height, fx, fy, cx, cy};
  camera.depth_scale = depth_scale;
  camera.fps = fps;
  const std::string problem = sensor::camera_problem(camera);
  if (!problem.empty()) throw Failure({core::ErrorKind::kUsage, "camera: " + problem});
  return camera;
}

py::array_t<double> intrinsics(const sensor::Camera& camera) {
  py::array_t<double> matrix({3, 3});
  const sensor::Pinhole& c = camera.color;
  const double values[9] = {c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0};
  std::copy_n(values, 9, matrix.mutable_data());
  return matrix;
}

}  // namespace

void add_cameras(py::module_& module) {
  using sensor::Camera;
  py::class_<Camera>(module, "Camera")
      .def(py::init(&make_camera), py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"),
           py::arg("cx"), py::arg("cy"), py::kw_only(), py::arg("depth_scale") = 5000.0,
           py::arg("fps") = 30.0)
      .def_static(
          "_find", [](const std::string& name) { return value_of(plumbline::find_camera(name)); },
          py::arg("name_or_file"))

      .def_static(
          "from_yaml",
          [](const std::string& text) { return value_of(sensor::parse_camera(text, "camera.yaml")); },
          py::arg("text"))
      .def("to_yaml", [](const Camera& camera) { return sensor::to_yaml(camera); })
      .def_property_readonly("name", [](const Camera& c) { return c.name; })
      .def_property_readonly("width", [](const Camera& c) { return c.color.width; })

      .def_property_readonly("height", [](const Camera& c) { return c.color.height; })
      .def_property_readonly("fx", [](const Camera& c) { return c.color.fx; })
      .def_property_readonly("fy", [](const Camera& c) { return c.color.fy; })
      .def_property_readonly("cx", [](const Camera& c) { return c.color.cx; })
      .def_property_readonly("cy", [](const Camera& c) { return c.color.cy; })

      .def_property_readonly("matrix", &intrinsics)
      .def_property_readonly("depth_scale", [](const Camera& c) { return c.depth_scale; })
      .def_property_readonly("fps", [](const Camera& c) { return c.fps; })
      .def_property_readonly("distorted", [](const Camera& c) { return c.distorted(); })
      .def("__repr__", [](const Camera& c) {
        return "Camera(" + std::to_string(c.color.width) + ", " + std::to_string(c.color.height) +
               ", fx=" + std::to_string(c.color.fx) + ", fy=" + std::to_string(c.color.fy) + ")";
      });
}

}  // namespace plumbline::python
