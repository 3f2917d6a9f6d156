// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Shared by the sources of the module plumbline._core, which is thin: the classes that users need are in
// Python, beside it.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <exception>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::python {

namespace py = pybind11;

/// An Error as an exception, which Python sees as plumbline.InputError and so on.
struct Failure : std::exception {
  explicit Failure(core::Error e) : error(std::move(e)) {}
  [[nodiscard]] const char* what() const noexcept override { return error.message.c_str(); }
  core::Error error;
};

template <typename T>
T value_of(core::Result<T> result) {
  if (!result) throw Failure(std::move(result.error()));
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// The image as an array that shares its memory: H x W, or H x W x channels.
py::array array_of(const cv::Mat& image);
/// An array's memory as an image of 8-bit colour (H x W x 3 or H x W) or of depth (H x W, uint16 or float32).
/// It must be contiguous by rows. Throws Failure (kInput) that names `what`, dtype and shape.
cv::Mat color_of(const py::array& array, const std::string& what);
cv::Mat depth_of(const py::array& array, const std::string& what);

/// 4 x 4, row-major.
py::array_t<double> matrix_of(const geometry::Rigid3& pose);
/// Throws Failure (kInput): not a 4 x 4 matrix of a rotation and a translation.
geometry::Rigid3 pose_of(const py::array& matrix, const std::string& what);
/// Stamps (N) and matrices (N x 4 x 4).
py::tuple arrays_of(const geometry::Trajectory& trajectory);
geometry::Trajectory trajectory_of(
    const py::array_t<double, py::array::c_style | py::array::forcecast>& stamps,
    const py::array_t<double, py::array::c_style | py::array::forcecast>& matrices);

/// Moves a vector into an array that Python owns.
template <typename T>
py::array_t<T> owned(std::vector<T> values, std::vector<py::ssize_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), kept->data(), owner);
}

void add_errors(py::module_& module);
void add_cameras(py::module_& module);
void add_recordings(py::module_& module);
void add_runs(py::module_& module);
void add_clouds(py::module_& module);
void add_maps(py::module_& module);
void add_measures(py::module_& module);

}  // namespace plumbline::python
