// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>

#include "io/cloud_table.hpp"
#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/core/git_lfs.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::cloud {

core::Result<CloudFile> read_ply_cloud(const std::filesystem::path& file, LargeCoordinates large) {
  auto ply = read_ply(file, large == LargeCoordinates::kShifted);
  if (!ply) return tl::unexpected<core::Error>(ply.error());

  // Meaning of each column, by its name
  std::vector<Meaning> meanings;
  std::vector<std::string> names;
  for (const auto& column : ply->columns) {
    meanings.push_back(meaning_of(column.name));
    names.push_back(column.name);
  }

  CloudBuilder builder(meanings, names, ply->vertex_count);
  if (!builder.has_position())
    return core::input_error(file.string() + ": has no x, y and z; it is not a point cloud");

  for (std::size_t c = 0; c < meanings.size(); ++c) {
    if (meanings[c] == Meaning::kNone || meanings[c] == Meaning::kPackedColor) continue;
    const bool color =
        meanings[c] == Meaning::kRed || meanings[c] == Meaning::kGreen || meanings[c] == Meaning::kBlue;

    auto& values = ply->columns[c].values;
    if (auto* bytes = std::get_if<std::vector<std::uint8_t>>(&values)) {
      for (std::size_t i = 0; i < bytes->size(); ++i) builder.set(i, meanings[c], c, (*bytes)[i]);
    } else if (auto* floats = std::get_if<std::vector<float>>(&values)) {
      // Colours written as floats go from 0 to 1 in most programs.
      const bool share =
          color && std::all_of(floats->begin(), floats->end(), [](float v) { return !(v > 1.0F); });
      for (std::size_t i = 0; i < floats->size(); ++i) {
        builder.set(i, meanings[c], c, static_cast<double>((*floats)[i]) * (share ? 255.0 : 1.0));
      }
    }

    values = std::vector<float>();  // the column is in the cloud now
  }

  CloudFile result = builder.finish();
  result.shift = Eigen::Map<const Eigen::Vector3d>(ply->shift.data());
  result.frame = frame_in(ply->comments);

  return result;
}

void change_shift(Cloud& cloud, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  if (from == to) return;

  // In double, since shifts are large
  const Eigen::Vector3d step = from - to;
  for (Point& p : cloud.points) {
    p.x = static_cast<float>(static_cast<double>(p.x) + step.x());
    p.y = static_cast<float>(static_cast<double>(p.y) + step.y());
    p.z = static_cast<float>(static_cast<double>(p.z) + step.z());
  }
  cloud.sensor_origin_.head<3>() = (cloud.sensor_origin_.head<3>().cast<double>() + step).cast<float>();
}

core::Result<void> check_one_frame(const std::string& name, const Eigen::Vector3d& shift,
                                   const std::string& other_name, const Eigen::Vector3d& other_shift) {
  constexpr double kFloatsHold_m = 10000.0;
  const double apart_m = (shift - other_shift).norm();

  // Farther apart, one shift cannot serve both
  if (apart_m <= kFloatsHold_m) return {};
  return core::input_error(fmt::format(
      "{} and {} lie {:.0f} km apart, and floats are exact to a millimetre only within 10 km; bring "
      "both into one frame first, with the filter transform",
      name, other_name, apart_m / 1000.0));
}

core::Result<CloudFile> read_cloud(const std::filesystem::path& file, LargeCoordinates large) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return core::input_error(file.string() + ": does not exist");
  if (std::filesystem::is_directory(file, error)) {
    return core::input_error(file.string() + ": is a folder, a cloud file is needed");
  }
  if (core::is_lfs_pointer(file)) return core::input_error(file.string() + ": " + core::kLfsPointer);

  // The ending decides the format
  const std::string ending = core::ending_of(file);
  if (ending == ".ply") return read_ply_cloud(file, large);
  if (ending == ".pcd") return read_pcd_cloud(file, large);
  if (ending == ".xyz" || ending == ".txt" || ending == ".csv" || ending == ".asc" || ending == ".pts") {
    return read_text_cloud(file, large);
  }
  return core::input_error(fmt::format(
      "{}: ending '{}' is not one that clouds are read from; use .ply, .pcd, .xyz, .txt, .csv, .asc or .pts",
      file.string(), ending));
}

}  // namespace plumbline::cloud
