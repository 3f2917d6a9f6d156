// SPDX-License-Identifier: BSD-3-Clause
// transforms.json (docs.nerf.studio, "data conventions"): pictures and poses in OpenGL's axes.
//
// Its camera looks along -z with y up; its pixels have their middle at (0.5, 0.5), as COLMAP's.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <nlohmann/json.hpp>

#include "formats.hpp"
#include "pictures/model.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/output_file.hpp"
#include "source/export_folder.hpp"

namespace plumbline::exports {
namespace {

using Json = nlohmann::ordered_json;

Json rows_of(const Eigen::Matrix4d& m, int rows) {
  Json json = Json::array();
  for (int r = 0; r < rows; ++r) json.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
  return json;
}

/// Intrinsics; pixels have their middle at (0.5, 0.5).
void put_intrinsics(const sensor::Pinhole& camera, Json& json) {
  json["fl_x"] = camera.fx;
  json["fl_y"] = camera.fy;
  json["cx"] = camera.cx + 0.5;
  json["cy"] = camera.cy + 0.5;
  json["w"] = camera.width;
  json["h"] = camera.height;
}

/// The content of transforms.json.
Json transforms_json(const MapSource& source, const std::vector<Picture>& pictures, bool depth) {
  Json json;
  json["comment"] = source.frame_text() + "; cameras in OpenGL's axes: x right, y up, z backwards";
  json["camera_model"] = "PINHOLE";

  // One camera's intrinsics are given once
  const bool one_camera = source.robots().size() == 1;
  if (one_camera) put_intrinsics(pinhole_of(source, source.robots().front().number), json);
  json["applied_transform"] = rows_of(Eigen::Matrix4d::Identity(), 3);
  json["ply_file_path"] = "points.ply";
  json["frames"] = Json::array();

  // OpenGL's y and z axes point the other way
  for (const Picture& picture : pictures) {
    Eigen::Matrix4d pose = picture.pose.world_from_camera.isometry().matrix();
    pose.col(1) *= -1.0;
    pose.col(2) *= -1.0;

    // Depth only for pictures that have it
    Json frame;
    frame["file_path"] = "images/" + picture.name + ".png";
    if (picture.frame && depth) frame["depth_file_path"] = "depth/" + picture.name + ".png";
    if (!one_camera) put_intrinsics(pinhole_of(source, picture.pose.robot), frame);
    frame["transform_matrix"] = rows_of(pose, 4);
    json["frames"].push_back(std::move(frame));
  }

  return json;
}

/// Points from which splatting starts, as PLY.
core::Result<void> write_start_points(MapSource& source, const std::vector<Picture>& pictures,
                                      const std::filesystem::path& file) {
  const auto points = model_points(source, pictures);
  if (!points) return tl::unexpected(points.error());
  core::OutputFile out(file);
  out.write(fmt::format("ply\nformat binary_little_endian 1.0\ncomment {}\nelement vertex {}\n",
                        source.frame_text(), points->size()));
  out.write(
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n");
  for (const ModelPoint& point : *points) {
    const Eigen::Vector3f p = point.position.cast<float>();
    out.put(std::array<float, 3>{p.x(), p.y(), p.z()});
    out.put(point.color);
  }
  return out.commit();
}

core::Result<ExportSummary> write_nerfstudio(MapSource& source, const std::filesystem::path& output) {
  // OUT/transforms.json stands for its folder.
  const std::filesystem::path folder_name =
      output.filename() == "transforms.json" ? std::filesystem::absolute(output).parent_path() : output;
  ExportSummary summary;
  const std::unique_ptr<Pictures> recordings = open_pictures(source, summary);
  auto pictures = pictures_of(source, recordings.get());
  if (!pictures) return tl::unexpected(pictures.error());

  auto folder = prepare_export(folder_name, source.request().replace);
  if (!folder) return tl::unexpected(folder.error());

  const bool has_depth = source.options().depth && recordings && !recordings->stored();
  auto written = write_start_points(source, *pictures, folder->path() / "points.ply");
  if (written && recordings)
    written = write_pictures(source, *recordings, *pictures, folder->path(), source.options().depth, summary);

  if (written)
    written = core::write_file(folder->path() / "transforms.json",
                               core::json_text(transforms_json(source, *pictures, has_depth)));

  if (written)
    written =
        core::write_file(folder->path() / kExportNote,
                         "A nerfstudio data set that plumbline exported.\n" + source.frame_text() + "\n");
  if (written) written = folder->commit();
  if (!written) return tl::unexpected(written.error());

  summary.written = {folder_name};
  summary.notes.push_back(pictures_text(*pictures));
  return summary;
}

}  // namespace

Format nerfstudio_format() {
  return {
      "nerfstudio",
      {"transforms.json"},
      {Content::kCloud},
      "map.db, recording",
      "nerfstudio's transforms.json",
      "A folder with `transforms.json`, `images/`, `depth/` (16 bit, millimetres; `--depth off` leaves it "
      "out) and `points.ply` to start from. Poses are world_from_camera in OpenGL's axes (x right, y up, z "
      "backwards), the world is the map's (z up), so that `applied_transform` is the identity; the principal "
      "point has half a pixel added as nerfstudio counts pixels. `-o FOLDER/transforms.json`, or `--format "
      "nerfstudio -o FOLDER`. Pictures and points are chosen as for `colmap`.",
      {"every", "sharpest", "dense_points", "depth", "voxel"},
      &write_nerfstudio};
}

}  // namespace plumbline::exports
