// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "bindings.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "plumbline/session/background.hpp"
#include "plumbline/session/filter_chains.hpp"

namespace plumbline::python {
namespace {

/// A cloud with its columns; arrays of it share its memory and keep it alive.
struct PointCloud {
  cloud::CloudPtr cloud;
  cloud::CloudColumns columns;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  cloud::CloudFrame frame = {};
};
using PointCloudPtr = std::shared_ptr<PointCloud>;

/// `count` values of T at `offset` in every point; 1: one number a point.
template <typename T>
py::array column(const PointCloudPtr& self, std::size_t offset, py::ssize_t count, py::ssize_t step) {
  const auto owner = py::cast(self);
  const auto points = static_cast<py::ssize_t>(self->cloud->size());
  std::vector<py::ssize_t> shape{points};
  std::vector<py::ssize_t> strides{static_cast<py::ssize_t>(sizeof(cloud::Point))};
  if (count > 1) {
    shape.push_back(count);
    strides.push_back(step);
  }
  auto* data = reinterpret_cast<std::byte*>(self->cloud->points.data()) + offset;
  return py::array(py::dtype::of<T>(), shape, strides, data, owner);
}

template <typename T>
py::array values(const PointCloudPtr& self, std::vector<T>& column) {
  return py::array(py::dtype::of<T>(), {static_cast<py::ssize_t>(column.size())},
                   {static_cast<py::ssize_t>(sizeof(T))}, column.data(), py::cast(self));
}

/// x, y, z, nx, ny, nz, r, g, b at their places in memory.
py::array structured(const PointCloudPtr& self) {
  using P = cloud::Point;
  const auto f = py::dtype::of<float>();

  // NumPy's description of the fields
  const auto u = py::dtype::of<std::uint8_t>();
  py::list names;
  py::list formats;
  py::list offsets;

  const std::vector<std::tuple<const char*, py::dtype, std::size_t>> fields = {
      {"x", f, offsetof(P, x)},         {"y", f, offsetof(P, y)},         {"z", f, offsetof(P, z)},
      {"nx", f, offsetof(P, normal_x)}, {"ny", f, offsetof(P, normal_y)}, {"nz", f, offsetof(P, normal_z)},
      {"r", u, offsetof(P, r)},         {"g", u, offsetof(P, g)},         {"b", u, offsetof(P, b)}};
  for (const auto& [name, format, offset] : fields) {
    names.append(name);
    formats.append(format);
    offsets.append(offset);
  }

  // The array shares the points' memory
  const py::dtype type(names, formats, offsets, static_cast<py::ssize_t>(sizeof(P)));
  return py::array(type, {static_cast<py::ssize_t>(self->cloud->size())},
                   {static_cast<py::ssize_t>(sizeof(P))}, self->cloud->points.data(), py::cast(self));
}

/// The columns that the cloud has, as arrays by name.
py::dict columns(const PointCloudPtr& self) {
  py::dict all;
  cloud::CloudColumns& c = self->columns;
  if (!c.confidence.empty()) all["confidence"] = values(self, c.confidence);
  if (!c.observations.empty()) all["observations"] = values(self, c.observations);
  if (!c.robot.empty()) all["robot"] = values(self, c.robot);
  for (auto& other : c.others) all[py::str(other.name)] = values(self, other.values);
  return all;
}

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;
using ByteArray = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;

void check_rows(const py::array& array, py::ssize_t count, const char* what) {
  if (array.ndim() == 2 && array.shape(1) == 3 && (count < 0 || array.shape(0) == count)) return;
  const std::string rows = count < 0 ? "N" : std::to_string(count);
  throw Failure(
      {core::ErrorKind::kInput, std::string(what) + ": the array must have shape (" + rows + ", 3)"});
}

template <typename T>
std::vector<T> vector_of(const py::handle& given, std::size_t count, const std::string& name) {
  const auto array = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(given);
  if (!array || array.ndim() != 1 || static_cast<std::size_t>(array.shape(0)) != count)
    throw Failure({core::ErrorKind::kInput, "columns: '" + name + "' must have one number for each point"});
  return {array.data(), array.data() + count};
}

/// Columns by name; unknown names become columns of numbers.
cloud::CloudColumns columns_of(const py::dict& given, std::size_t count) {
  cloud::CloudColumns columns;
  for (const auto& [key, value] : given) {
    const std::string name = py::str(key);
    if (name == "confidence") {
      columns.confidence = vector_of<float>(value, count, name);
    } else if (name == "observations") {
      columns.observations = vector_of<std::uint32_t>(value, count, name);
    } else if (name == "robot") {
      columns.robot = vector_of<std::uint8_t>(value, count, name);
    } else {
      columns.others.push_back({name, vector_of<float>(value, count, name)});
    }
  }
  return columns;
}

/// A cloud from NumPy arrays; points without colour are white.
PointCloudPtr make_cloud(const FloatArray& points, const std::optional<ByteArray>& colors,
                         const std::optional<FloatArray>& normals, const py::dict& given) {
  check_rows(points, -1, "points");
  const py::ssize_t count = points.shape(0);
  if (colors) check_rows(*colors, count, "colors");
  if (normals) check_rows(*normals, count, "normals");

  // Points of the arrays' rows
  auto self = std::make_shared<PointCloud>();
  self->cloud = std::make_shared<cloud::Cloud>();
  self->cloud->resize(static_cast<std::size_t>(count));

  for (py::ssize_t i = 0; i < count; ++i) {
    cloud::Point& p = (*self->cloud)[static_cast<std::size_t>(i)];
    p.x = points.at(i, 0);
    p.y = points.at(i, 1);
    p.z = points.at(i, 2);
    p.r = colors ? colors->at(i, 0) : 255;
    p.g = colors ? colors->at(i, 1) : 255;

    p.b = colors ? colors->at(i, 2) : 255;

    // NaN stands for an unknown normal
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    p.normal_x = normals ? normals->at(i, 0) : kNone;
    p.normal_y = normals ? normals->at(i, 1) : kNone;
    p.normal_z = normals ? normals->at(i, 2) : kNone;
  }
  self->columns = columns_of(given, static_cast<std::size_t>(count));
  return self;
}

PointCloudPtr read_cloud(const std::filesystem::path& file) {
  const py::gil_scoped_release free;
  cloud::CloudFile read = value_of(cloud::read_cloud(file, cloud::LargeCoordinates::kShifted));
  return std::make_shared<PointCloud>(PointCloud{std::move(read.cloud), std::move(read.columns), read.shift,
                                                 maps::frame_of_cloud(file, read.frame)});
}

void write_cloud(const PointCloudPtr& self, const std::filesystem::path& file) {
  const py::gil_scoped_release free;
  value_of(cloud::write_cloud(file, *self->cloud, self->columns, self->shift, self->frame.comments()));
}

/// The filtered cloud, and for each filter: type, numbers of points before and after.
py::tuple filter(const PointCloudPtr& self, const std::string& chain, int threads) {
  auto result = std::make_shared<PointCloud>();
  std::vector<cloud::FilterReport> reports;

  // Other Python threads run while the filters work
  {
    const py::gil_scoped_release free;
    const session::OpenCvThreads one;
    const core::Executor executor(threads);
    const cloud::FilterChain loaded = value_of(session::load_chain(chain, cloud::builtin_filters()));
    cloud::CloudColumns made = self->columns;
    cloud::FilterContext context;

    context.executor = &executor;
    context.shift = result->shift = self->shift;
    result->frame = self->frame;
    context.columns = &self->columns;
    context.made_columns = &made;
    context.frame = &result->frame;
    value_of(loaded.ready(context));
    result->cloud = value_of(loaded.apply(self->cloud, context, &reports));
    result->columns = std::move(made);
  }

  // Number of points after every filter
  py::list steps;
  for (const cloud::FilterReport& report : reports)
    steps.append(py::make_tuple(report.type, report.points_in, report.points_out));
  return py::make_tuple(result, steps);
}

}  // namespace

void add_clouds(py::module_& module) {
  using P = cloud::Point;
  constexpr auto kFloat = static_cast<py::ssize_t>(sizeof(float));

  py::class_<PointCloud, PointCloudPtr>(module, "PointCloud")
      .def(py::init(&make_cloud), py::arg("points"), py::arg("colors"), py::arg("normals"),
           py::arg("columns"))
      .def_static("read", &read_cloud, py::arg("file"))
      .def("write", &write_cloud, py::arg("file"))
      .def("filter", &filter, py::arg("chain"), py::arg("threads"))
      .def("__len__", [](const PointCloud& c) { return c.cloud->size(); })

      .def_property_readonly(
          "points", [](const PointCloudPtr& c) { return column<float>(c, offsetof(P, x), 3, kFloat); })
      .def_property_readonly(
          "normals",
          [](const PointCloudPtr& c) { return column<float>(c, offsetof(P, normal_x), 3, kFloat); })
      .def_property_readonly(
          "colors", [](const PointCloudPtr& c) { return column<std::uint8_t>(c, offsetof(P, r), 3, -1); })

      .def_property_readonly("array", &structured)
      .def_property_readonly("columns", &columns)
      .def_property_readonly("shift", [](const PointCloud& c) {
        return owned(std::vector<double>(c.shift.data(), c.shift.data() + 3), {3});
      });
}

}  // namespace plumbline::python
