// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/result_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <system_error>

#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/maps/output_folder.hpp"

namespace plumbline::maps {

/// One folder per robot; a single robot's path is in the result itself.
std::vector<std::filesystem::path> ResultFolder::robot_folders() const {
  std::vector<std::filesystem::path> folders;
  std::error_code ec;
  for (std::filesystem::directory_iterator it(folder / "robots", ec), end; !ec && it != end;
       it.increment(ec)) {
    if (std::filesystem::is_regular_file(it->path() / "trajectory.txt", ec)) folders.push_back(it->path());
  }
  std::sort(folders.begin(), folders.end());
  if (folders.empty()) folders.push_back(folder);
  return folders;
}

/// The folder, or why it is no result.
core::Result<ResultFolder> open_result(const std::filesystem::path& folder) {
  if (folder.empty()) return core::usage_error("the path of the result is empty");
  std::error_code ec;
  if (std::filesystem::is_regular_file(folder, ec)) {
    return core::input_error(
        fmt::format("{}: is a file; give the result folder of plumbline map", folder.string()));
  }
  if (!std::filesystem::is_directory(folder, ec)) {
    return core::input_error(
        fmt::format("{}: no such folder; give the result folder of plumbline map", folder.string()));
  }
  if (!is_result_folder(folder)) {
    return core::input_error(fmt::format(
        "{}: is not a result of plumbline map (summary.json or config.yaml is missing)", folder.string()));
  }
  return ResultFolder{folder};
}

cloud::CloudFrame frame_of_result(const ResultFolder& result) {
  const auto summary = core::read_json(result.summary());
  const nlohmann::ordered_json::json_pointer place("/frame/up");
  if (!summary || !summary->is_object() || !summary->contains(place) || !summary->at(place).is_string())
    return {};
  return cloud::frame_with(summary->at(place) == "none" ? cloud::Up::kMinusY : cloud::Up::kZ);
}

/// The reference frame of a map cloud; a cloud without a note has that of its result folder.
cloud::CloudFrame frame_of_cloud(const std::filesystem::path& file, const cloud::CloudFrame& said) {
  if (said.known() || file.filename().string().rfind("map", 0) != 0) return said;

  // The result may be one or two folders up
  std::filesystem::path folder = std::filesystem::absolute(file).lexically_normal().parent_path();
  if (folder.filename() == "levels") folder = folder.parent_path();
  if (folder.parent_path().filename() == "components") folder = folder.parent_path().parent_path();
  return is_result_folder(folder) ? frame_of_result(ResultFolder{folder}) : said;
}

/// The fused cloud, PLY before PCD.
core::Result<cloud::CloudFile> read_result_cloud(const ResultFolder& result) {
  std::error_code ec;
  const bool pcd = !std::filesystem::exists(result.ply(), ec) && std::filesystem::exists(result.pcd(), ec);
  const std::filesystem::path name = pcd ? result.pcd() : result.ply();
  auto file = cloud::read_cloud(name);
  if (file) file->frame = frame_of_cloud(name, file->frame);
  return file;
}

/// The segments of lines.ply.
core::Result<std::vector<LineSegment3>> read_lines_ply(const std::filesystem::path& file) {
  const auto data = cloud::read_ply(file);
  if (!data) return tl::unexpected(data.error());
  const std::vector<float>* x = data->floats("x");
  const std::vector<float>* y = data->floats("y");
  const std::vector<float>* z = data->floats("z");
  if (x == nullptr || y == nullptr || z == nullptr) {
    return core::input_error(fmt::format("{}: the vertices have no x, y, z", file.string()));
  }
  const auto vertex = [&](std::uint32_t i) -> Eigen::Vector3d {  // an expression would outlive its vector
    return Eigen::Vector3f((*x)[i], (*y)[i], (*z)[i]).cast<double>();
  };
  std::vector<LineSegment3> lines;
  for (const auto& [a, b] : data->edges) lines.emplace_back(vertex(a), vertex(b));
  return lines;
}

/// The path as a chain of edges between its positions.
core::Result<void> write_trajectory_ply(const std::filesystem::path& file,
                                        const geometry::Trajectory& trajectory) {
  std::array<std::vector<float>, 3> xyz;
  cloud::PlyData data;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const Eigen::Vector3f p = trajectory[i].world_from_camera.translation.cast<float>();
    for (int axis = 0; axis < 3; ++axis) xyz[static_cast<std::size_t>(axis)].push_back(p[axis]);
    const auto index = static_cast<std::uint32_t>(i);
    if (i > 0) data.edges.push_back({index - 1, index});
  }
  data.add("x", std::move(xyz[0]));
  data.add("y", std::move(xyz[1]));
  data.add("z", std::move(xyz[2]));
  return cloud::write_ply(file, data);
}

}  // namespace plumbline::maps
