// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "bindings.hpp"

namespace plumbline::python {
namespace {

[[noreturn]] void refuse(const py::array& array, const std::string& what, const std::string& wanted) {
  const std::vector<py::ssize_t> shape(array.shape(), array.shape() + array.ndim());
  throw Failure({core::ErrorKind::kInput,
                 fmt::format("{}: an array of {} with shape ({}) was given; {} is needed", what,
                             py::str(array.dtype()).cast<std::string>(), fmt::join(shape, ", "), wanted)});
}

/// Rows may have a distance of their own; within a row all lies together.
cv::Mat image_of(const py::array& array, const std::string& what, int type) {
  const py::ssize_t pixel = static_cast<py::ssize_t>(CV_ELEM_SIZE(type));
  const bool packed = array.strides(1) == pixel && array.strides(0) >= pixel * array.shape(1) &&
                      (array.ndim() == 2 || array.strides(2) == array.itemsize());
  if (!packed) {
    throw Failure({core::ErrorKind::kInput,
                   what + ": the array is not contiguous; give numpy.ascontiguousarray(...) of it"});
  }

  auto* data = const_cast<void*>(array.data());
  return cv::Mat(static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)), type, data,
                 static_cast<std::size_t>(array.strides(0)));
}

bool is(const py::array& array, char kind, py::ssize_t size) {
  return array.dtype().kind() == kind && array.itemsize() == size && array.dtype().byteorder() != '>';
}

}  // namespace

/// A NumPy array that shares the image's memory and keeps it alive.
py::array array_of(const cv::Mat& image) {
  auto* kept = new cv::Mat(image);
  const py::capsule owner(kept, [](void* p) { delete static_cast<cv::Mat*>(p); });
  const int depth = kept->depth();
  const py::dtype type = depth == CV_8U    ? py::dtype::of<std::uint8_t>()
                         : depth == CV_16U ? py::dtype::of<std::uint16_t>()
                                           : py::dtype::of<float>();

  // Rows may be padded
  std::vector<py::ssize_t> shape{kept->rows, kept->cols};
  std::vector<py::ssize_t> strides{static_cast<py::ssize_t>(kept->step[0]),
                                   static_cast<py::ssize_t>(kept->elemSize())};
  if (kept->channels() > 1) {
    shape.push_back(kept->channels());
    strides.push_back(static_cast<py::ssize_t>(kept->elemSize1()));
  }
  return py::array(type, shape, strides, kept->data, owner);
}

cv::Mat color_of(const py::array& array, const std::string& what) {
  const bool color = array.ndim() == 3 && array.shape(2) == 3;
  if (!is(array, 'u', 1) || (!color && array.ndim() != 2))
    refuse(array, what, "uint8 of height x width x 3, or of height x width");
  return image_of(array, what, color ? CV_8UC3 : CV_8UC1);
}

cv::Mat depth_of(const py::array& array, const std::string& what) {
  const bool units = is(array, 'u', 2);
  if ((!units && !is(array, 'f', 4)) || array.ndim() != 2)
    refuse(array, what, "uint16 (units of 1 / depth_scale m) or float32 (m) of height x width");
  return image_of(array, what, units ? CV_16UC1 : CV_32FC1);
}

/// The pose as a homogeneous matrix of 4 x 4.
py::array_t<double> matrix_of(const geometry::Rigid3& pose) {
  py::array_t<double> matrix({4, 4});
  auto m = matrix.mutable_unchecked<2>();
  const Eigen::Matrix3d& rotation = pose.rotation;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) m(r, c) = rotation(r, c);
    m(r, 3) = pose.translation(r);
    m(3, r) = 0.0;
  }
  m(3, 3) = 1.0;
  return matrix;
}

/// The pose of a homogeneous matrix of 4 x 4, which must be a rigid motion.
geometry::Rigid3 pose_of(const py::array& given, const std::string& what) {
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(given);
  if (!array || array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4)
    refuse(given, what, "float64 of 4 x 4");
  const auto m = array.unchecked<2>();

  // Rows hold the rotation and the translation
  Eigen::Matrix3d rotation;
  geometry::Rigid3 pose;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) rotation(r, c) = m(r, c);
    pose.translation(r) = m(r, 3);
  }

  // Scaling and mirroring are refused
  constexpr double kSlack = 1e-3;
  const bool is_rotation =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kSlack;
  if (!is_rotation || rotation.determinant() < 0.0 || !pose.translation.allFinite())
    throw Failure(
        {core::ErrorKind::kInput, what + ": the matrix is not a rigid motion (rotation and translation)"});
  return {Eigen::Quaterniond(rotation), pose.translation};
}

/// Stamps (N) and poses (N x 4 x 4) of a trajectory.
py::tuple arrays_of(const geometry::Trajectory& trajectory) {
  const auto count = static_cast<py::ssize_t>(trajectory.size());
  py::array_t<double> stamps(count);
  py::array_t<double> matrices({count, py::ssize_t{4}, py::ssize_t{4}});
  auto stamp = stamps.mutable_unchecked<1>();
  for (py::ssize_t i = 0; i < count; ++i) {
    const geometry::StampedPose& pose = trajectory[static_cast<std::size_t>(i)];
    stamp(i) = pose.stamp;
    const py::array_t<double> matrix = matrix_of(pose.world_from_camera);
    std::copy_n(matrix.data(), 16, matrices.mutable_data(i, 0, 0));
  }
  return py::make_tuple(stamps, matrices);
}

/// A trajectory from stamps (N) and poses (N x 4 x 4) of the same number.
geometry::Trajectory trajectory_of(
    const py::array_t<double, py::array::c_style | py::array::forcecast>& stamps,
    const py::array_t<double, py::array::c_style | py::array::forcecast>& matrices) {
  if (matrices.ndim() != 3 || matrices.shape(1) != 4 || matrices.shape(2) != 4)
    refuse(matrices, "poses", "float64 of N x 4 x 4");
  if (stamps.ndim() != 1 || stamps.shape(0) != matrices.shape(0))
    refuse(stamps, "stamps", fmt::format("float64 with shape ({})", matrices.shape(0)));

  geometry::Trajectory trajectory;
  for (py::ssize_t i = 0; i < stamps.shape(0); ++i) {
    const py::array one = py::reinterpret_borrow<py::object>(matrices)[py::int_(i)];
    trajectory.push_back({stamps.at(i), pose_of(one, fmt::format("poses[{}]", i))});
  }
  return trajectory;
}

}  // namespace plumbline::python
