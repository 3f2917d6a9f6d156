// SPDX-License-Identifier: BSD-3-Clause
#include "background.hpp"
#include "bindings.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "plumbline/maps/stored_result.hpp"

namespace plumbline::python {
namespace {

namespace fs = std::filesystem;

py::tuple read_trajectory(const fs::path& file) {
  return arrays_of(value_of(dataset::read_trajectory(file)));
}

void write_trajectory(const fs::path& file, const py::array_t<double>& stamps,
                      const py::array_t<double>& poses) {
  value_of(dataset::write_trajectory(file, trajectory_of(stamps, poses)));
}

/// N x 2 x 3: both ends of each line, metres.
py::array_t<double> read_lines(const fs::path& file) {
  const std::vector<maps::LineSegment3> lines = value_of(maps::read_lines_ply(file));
  std::vector<double> ends;
  for (const auto& [a, b] : lines) {
    ends.insert(ends.end(), a.data(), a.data() + 3);
    ends.insert(ends.end(), b.data(), b.data() + 3);
  }
  return owned(std::move(ends), {static_cast<py::ssize_t>(lines.size()), 2, 3});
}

/// Points of the map and who saw them: positions (N x 3, in the result's frame), for each observation the
/// number of its point, its keyframe, that one's frame, and its pixel.
py::tuple read_landmarks(const fs::path& folder) {
  const auto stored = [&] {
    const py::gil_scoped_release free;
    return value_of(maps::StoredResult::open(value_of(maps::find_map(folder))));
  }();
  const maps::Map& map = stored.stored().map;
  const geometry::Rigid3& output_from_map = stored.stored().result.output_from_map;

  std::vector<double> positions;
  std::vector<std::int32_t> points;
  std::vector<std::int32_t> keyframes;
  std::vector<std::int64_t> frames;
  std::vector<float> pixels;
  std::int32_t number = 0;

  for (const core::PointId id : map.point_ids()) {
    const maps::MapPoint& point = map.point(id);
    const Eigen::Vector3d position = output_from_map * point.position;
    positions.insert(positions.end(), position.data(), position.data() + 3);

    for (const maps::Observation& seen : point.observations) {
      const maps::Keyframe& keyframe = map.keyframe(seen.keyframe);
      const Eigen::Vector2f& pixel = keyframe.features->points[static_cast<std::size_t>(seen.feature)].pixel;
      points.push_back(number);
      keyframes.push_back(seen.keyframe.index);
      frames.push_back(keyframe.frame_index);
      pixels.insert(pixels.end(), pixel.data(), pixel.data() + 2);
    }
    ++number;
  }

  const auto count = static_cast<py::ssize_t>(points.size());
  return py::make_tuple(owned(std::move(positions), {number, 3}), owned(std::move(points), {count}),
                        owned(std::move(keyframes), {count}), owned(std::move(frames), {count}),
                        owned(std::move(pixels), {count, 2}));
}

/// Frame number of each keyframe, by its number; empty where there is no map.db.
std::map<std::int32_t, std::int64_t> keyframe_frames(const fs::path& folder) {
  const auto stored = value_of(maps::StoredResult::open(value_of(maps::find_map(folder))));
  std::map<std::int32_t, std::int64_t> frames;
  for (const core::KeyframeId id : stored.stored().map.keyframe_ids())
    frames[id.index] = stored.stored().map.keyframe(id).frame_index;
  return frames;
}

std::vector<fs::path> robot_folders(const fs::path& folder) {
  return value_of(maps::open_result(folder)).robot_folders();
}

}  // namespace

void add_maps(py::module_& module) {
  module.def("read_trajectory", &read_trajectory, py::arg("file"));
  module.def("write_trajectory", &write_trajectory, py::arg("file"), py::arg("stamps"), py::arg("poses"));
  module.def("read_lines", &read_lines, py::arg("file"));
  module.def("read_landmarks", &read_landmarks, py::arg("folder"));
  module.def("keyframe_frames", &keyframe_frames, py::arg("folder"));
  module.def("robot_folders", &robot_folders, py::arg("folder"));
}

}  // namespace plumbline::python
