// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <nlohmann/json.hpp>

#include "bindings.hpp"
#include "plumbline/core/config.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "plumbline/maps/stored_run.hpp"

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

std::map<std::int32_t, std::string> names_of(const std::vector<maps::RobotInfo>& robots) {
  std::map<std::int32_t, std::string> names;
  for (const maps::RobotInfo& robot : robots) names[robot.number] = core::printable(robot.name);
  return names;
}

/// Points of the map and who saw them: positions (N x 3, in the result's frame), for each observation the
/// number of its point, its keyframe, that one's frame, its pixel, and the robot's number; names of robots by
/// number.
py::tuple read_landmarks(const fs::path& folder) {
  const auto stored = [&] {
    const py::gil_scoped_release free;
    return value_of(maps::StoredRun::open_main(value_of(maps::find_map(folder))));
  }();
  const maps::Map& map = stored.stored().map;
  const geometry::Rigid3& output_from_map = stored.stored().result.output_from_map;

  // One list per array that is returned
  std::vector<double> positions;
  std::vector<std::int32_t> points;
  std::vector<std::int32_t> keyframes;
  std::vector<std::int64_t> frames;
  std::vector<float> pixels;
  std::vector<std::int32_t> robots;
  std::int32_t number = 0;

  // Landmarks in the frame of the result
  for (const core::PointId id : map.point_ids()) {
    const maps::MapPoint& point = map.point(id);
    const Eigen::Vector3d position = output_from_map * point.position;
    positions.insert(positions.end(), position.data(), position.data() + 3);

    // The keyframes that have observed it
    for (const maps::Observation& seen : point.observations) {
      const maps::Keyframe& keyframe = map.keyframe(seen.keyframe);
      const Eigen::Vector2f& pixel = keyframe.features->points[static_cast<std::size_t>(seen.feature)].pixel;
      points.push_back(number);
      keyframes.push_back(seen.keyframe.index);
      frames.push_back(keyframe.frame_index);
      pixels.insert(pixels.end(), pixel.data(), pixel.data() + 2);
      robots.push_back(seen.keyframe.robot);
    }
    ++number;
  }

  // The arrays take over the lists
  const auto count = static_cast<py::ssize_t>(points.size());
  return py::make_tuple(owned(std::move(positions), {number, 3}), owned(std::move(points), {count}),
                        owned(std::move(keyframes), {count}), owned(std::move(frames), {count}),
                        owned(std::move(pixels), {count, 2}), owned(std::move(robots), {count}),
                        names_of(stored.stored().header.robots));
}

/// Section `run` of a result's config.yaml: what was mapped, as text by key. Empty for other files.
std::map<std::string, std::string> run_settings(const fs::path& file) {
  const core::ConfigNode root = value_of(core::read_yaml(file));
  std::map<std::string, std::string> settings;
  const core::ConfigNode* run = root.find("run");
  if (run == nullptr) return settings;
  for (const auto& [key, value] : run->entries) settings[key] = value.scalar;
  return settings;
}

/// Frame number of each keyframe, by its robot's name and its number.
std::map<std::pair<std::string, std::int32_t>, std::int64_t> keyframe_frames(const fs::path& folder) {
  const maps::StoreReader reader = value_of(maps::StoreReader::open(value_of(maps::find_map(folder)).store));
  const std::map<std::int32_t, std::string> names = names_of(reader.header().robots);
  std::map<std::pair<std::string, std::int32_t>, std::int64_t> frames;
  for (const maps::StoredMap& stored : value_of(reader.load_each())) {
    for (const core::KeyframeId id : stored.map.keyframe_ids())
      frames[{names.at(id.robot), id.index}] = stored.map.keyframe(id).frame_index;
  }
  return frames;
}

/// Covariances (N x 6 x 6) of a robot's poses: of the position (m) and of small turns about the world's axes
/// (rad). That of a frame between keyframes is that of the keyframe before. `robot`: its name; "": the first.
/// None: not known.
py::object pose_covariances(const fs::path& folder, const std::string& robot,
                            const py::array_t<double>& stamps, const py::array_t<double>& poses) {
  constexpr double kRounding_s = 2e-6;  // rounding of the stamps in text files
  const geometry::Trajectory trajectory = trajectory_of(stamps, poses);
  const maps::StoreReader reader = value_of(maps::StoreReader::open(value_of(maps::find_map(folder)).store));

  const std::vector<maps::RobotInfo>& robots = reader.header().robots;
  const auto named = std::find_if(robots.begin(), robots.end(), [&](const maps::RobotInfo& info) {
    return robot.empty() || info.name == robot;
  });
  const auto kept = value_of(reader.attachment(maps::kFusionAttachment));
  if (named == robots.end() || !kept) return py::none();

  std::vector<double> times;
  for (const geometry::StampedPose& pose : trajectory) times.push_back(pose.stamp + kRounding_s);
  const std::vector<geometry::Matrix6d> covariances =
      value_of(maps::fusion_state_of(*kept))
          .covariances_of(std::vector<std::int32_t>(times.size(), named->number), times);
  if (covariances.empty()) return py::none();

  // Kept are those of (rho, phi) in Exp(rho, phi) camera_from_world.
  std::vector<double> values;
  for (std::size_t i = 0; i < times.size(); ++i) {
    geometry::Matrix6d turn = geometry::Matrix6d::Zero();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = trajectory[i].world_from_camera.rotation;
    const geometry::Matrix6d in_world = turn * covariances[i] * turn.transpose();  // symmetric: either order
    values.insert(values.end(), in_world.data(), in_world.data() + 36);
  }
  return owned(std::move(values), {static_cast<py::ssize_t>(times.size()), 6, 6});
}

/// The text of a file, which is JSON within the limits of core::read_json.
std::string read_json(const fs::path& file) { return core::json_text(value_of(core::read_json(file))); }

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
  module.def("pose_covariances", &pose_covariances, py::arg("folder"), py::arg("robot"), py::arg("stamps"),
             py::arg("poses"));
  module.def("run_settings", &run_settings, py::arg("file"));
  module.def("read_json", &read_json, py::arg("file"));
  module.def("robot_folders", &robot_folders, py::arg("folder"));
}

}  // namespace plumbline::python
