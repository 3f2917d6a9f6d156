// SPDX-License-Identifier: BSD-3-Clause
// COLMAP's sparse model (colmap.github.io/format.html): for Gaussian splatting, MVS, and COLMAP itself.
//
// COLMAP puts the centre of the top left pixel at (0.5, 0.5), we at (0, 0): half a pixel is added to the
// principal point and to every place in a picture. Poses are camera_from_world.
#include <fmt/format.h>

#include <limits>

#include "formats.hpp"
#include "pictures/model.hpp"
#include "plumbline/core/output_file.hpp"
#include "source/export_folder.hpp"

namespace plumbline::exports {
namespace {

constexpr double kHalfPixel = 0.5;
constexpr int kColmapPinhole = 1;
constexpr std::uint64_t kNoPoint = std::numeric_limits<std::uint64_t>::max();

/// A place in a picture, and the 3D point that it shows.
struct ColmapSpot {
  double x = 0.0;
  double y = 0.0;
  std::uint64_t point = kNoPoint;
};

struct ColmapModel {
  std::vector<maps::RobotInfo> robots;
  std::vector<Picture> pictures;
  std::vector<ModelPoint> points;
  std::vector<std::vector<ColmapSpot>> spots;  ///< by picture, by feature
};

std::uint32_t camera_id(std::int32_t robot) { return static_cast<std::uint32_t>(robot + 1); }

/// Features of each keyframe's picture, with the landmarks that they show.
std::vector<std::vector<ColmapSpot>> spots_of(const maps::Map& map, const ColmapModel& model) {
  std::vector<std::vector<ColmapSpot>> spots(model.pictures.size());
  for (std::size_t i = 0; i < model.pictures.size(); ++i) {
    const core::KeyframeId keyframe = model.pictures[i].pose.keyframe;
    if (!keyframe.valid()) continue;
    for (const auto& feature : map.keyframe(keyframe).features->points)
      spots[i].push_back({feature.pixel.x() + kHalfPixel, feature.pixel.y() + kHalfPixel, kNoPoint});
  }

  // COLMAP counts points from one
  for (std::size_t p = 0; p < model.points.size(); ++p) {
    for (const ModelPoint::Sight& sight : model.points[p].track)
      spots[sight.picture][static_cast<std::size_t>(sight.feature)].point = p + 1;
  }
  return spots;
}

/// Writes cameras, images and points as COLMAP's binary files.
core::Result<void> write_colmap_binary(const std::filesystem::path& folder, const ColmapModel& model) {
  core::OutputFile cameras(folder / "cameras.bin");
  cameras.put(std::uint64_t{model.robots.size()});

  // The principal point moves by half a pixel
  for (const maps::RobotInfo& robot : model.robots) {
    const sensor::Pinhole& c = robot.camera.color;
    cameras.put(camera_id(robot.number));
    cameras.put(kColmapPinhole);
    cameras.put(std::array<std::uint64_t, 2>{static_cast<std::uint64_t>(c.width),
                                             static_cast<std::uint64_t>(c.height)});
    cameras.put(std::array<double, 4>{c.fx, c.fy, c.cx + kHalfPixel, c.cy + kHalfPixel});
  }

  // Images with their features
  core::OutputFile images(folder / "images.bin");
  images.put(std::uint64_t{model.pictures.size()});

  for (std::size_t i = 0; i < model.pictures.size(); ++i) {
    const geometry::Rigid3 pose = model.pictures[i].pose.world_from_camera.inverse();
    const Eigen::Quaterniond q = pose.quaternion();
    images.put(static_cast<std::uint32_t>(i + 1));
    images.put(std::array<double, 7>{q.w(), q.x(), q.y(), q.z(), pose.translation.x(), pose.translation.y(),
                                     pose.translation.z()});
    images.put(camera_id(model.pictures[i].pose.robot));
    images.write(model.pictures[i].name + ".png");
    images.put('\0');
    images.put(std::uint64_t{model.spots[i].size()});

    // Features without a point have the number -1
    for (const ColmapSpot& spot : model.spots[i]) {
      images.put(std::array<double, 2>{spot.x, spot.y});
      images.put(spot.point);
    }
  }

  // Points with their tracks
  core::OutputFile points(folder / "points3D.bin");
  points.put(std::uint64_t{model.points.size()});

  for (std::size_t p = 0; p < model.points.size(); ++p) {
    const ModelPoint& point = model.points[p];
    points.put(std::uint64_t{p + 1});
    points.put(std::array<double, 3>{point.position.x(), point.position.y(), point.position.z()});
    points.put(point.color);
    points.put(point.error_px);
    points.put(std::uint64_t{point.track.size()});

    // The track: image and feature of each observation
    for (const ModelPoint::Sight& sight : point.track) {
      points.put(static_cast<std::uint32_t>(sight.picture + 1));
      points.put(static_cast<std::uint32_t>(sight.feature));
    }
  }

  // A file that cannot be written fails the model
  if (auto done = cameras.commit(); !done) return done;
  if (auto done = images.commit(); !done) return done;
  return points.commit();
}

/// Writes cameras, images and points as COLMAP's text files.
core::Result<void> write_colmap_text(const std::filesystem::path& folder, const ColmapModel& model,
                                     const std::string& frame) {
  core::OutputFile cameras(folder / "cameras.txt");
  cameras.write("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
  for (const maps::RobotInfo& robot : model.robots) {
    const sensor::Pinhole& c = robot.camera.color;
    cameras.write(fmt::format("{} PINHOLE {} {} {} {} {} {}\n", camera_id(robot.number), c.width, c.height,
                              c.fx, c.fy, c.cx + kHalfPixel, c.cy + kHalfPixel));
  }

  // Images take two rows each
  core::OutputFile images(folder / "images.txt");
  images.write(
      fmt::format("# {}\n# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
                  "# POINTS2D[] as (X, Y, POINT3D_ID)\n",
                  frame));

  for (std::size_t i = 0; i < model.pictures.size(); ++i) {
    const geometry::Rigid3 pose = model.pictures[i].pose.world_from_camera.inverse();
    const Eigen::Quaterniond q = pose.quaternion();
    const Eigen::Vector3d& t = pose.translation;
    images.write(fmt::format("{} {} {} {} {} {} {} {} {} {}.png\n", i + 1, q.w(), q.x(), q.y(), q.z(), t.x(),
                             t.y(), t.z(), camera_id(model.pictures[i].pose.robot), model.pictures[i].name));

    // The second row: features and their points
    const char* between = "";
    for (const ColmapSpot& spot : model.spots[i]) {
      images.write(spot.point == kNoPoint ? fmt::format("{}{} {} -1", between, spot.x, spot.y)
                                          : fmt::format("{}{} {} {}", between, spot.x, spot.y, spot.point));
      between = " ";
    }

    images.write("\n");
  }

  // Points with their tracks
  core::OutputFile points(folder / "points3D.txt");
  points.write("# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n");

  for (std::size_t p = 0; p < model.points.size(); ++p) {
    const ModelPoint& point = model.points[p];
    const Eigen::Vector3d& x = point.position;
    points.write(fmt::format("{} {} {} {} {} {} {} {}", p + 1, x.x(), x.y(), x.z(), point.color[0],
                             point.color[1], point.color[2], point.error_px));
    for (const ModelPoint::Sight& sight : point.track)
      points.write(fmt::format(" {} {}", sight.picture + 1, sight.feature));
    points.write("\n");
  }

  // A file that cannot be written fails the model
  if (auto done = cameras.commit(); !done) return done;
  if (auto done = images.commit(); !done) return done;
  return points.commit();
}

/// Writes a model with the pictures, or with poses only if there are none.
core::Result<ExportSummary> write_colmap(MapSource& source, const std::filesystem::path& output) {
  const auto store = source.store("the tracks of landmarks");
  if (!store) return tl::unexpected(store.error());

  // Pictures may be missing, poses may not
  ExportSummary summary;
  const std::unique_ptr<Pictures> recordings = open_pictures(source, summary);
  auto pictures = pictures_of(source, recordings.get());
  if (!pictures) return tl::unexpected(pictures.error());

  // Cameras, pictures and points of the model
  ColmapModel model;
  model.robots = source.robots();
  model.pictures = std::move(*pictures);
  auto points = model_points(source, model.pictures);
  if (!points) return tl::unexpected(points.error());
  model.points = std::move(*points);
  model.spots = spots_of((*store)->stored().map, model);

  // The folder appears only when it is complete
  auto folder = prepare_export(output, source.request().replace);
  if (!folder) return tl::unexpected(folder.error());

  const std::filesystem::path sparse = folder->path() / "sparse" / "0";
  auto written = core::make_folder(sparse);
  if (written) {
    written = source.options().text ? write_colmap_text(sparse, model, source.frame_text())
                                    : write_colmap_binary(sparse, model);
  }

  // Undistorted pictures next to the model
  if (written && recordings)
    written = write_pictures(source, *recordings, model.pictures, folder->path(), false, summary);

  // The note marks the folder as an export
  if (written) {
    written = core::write_file(
        folder->path() / kExportNote,
        fmt::format("A COLMAP model that plumbline exported.\n{}; poses are camera_from_world, "
                    "the middle of the top left pixel is at (0.5, 0.5)\n",
                    source.frame_text()));
  }

  if (written) written = folder->commit();
  if (!written) return tl::unexpected(written.error());

  // The summary tells how many poses have a picture
  summary.written = {output};
  summary.notes.push_back(fmt::format("{}, {} points", pictures_text(model.pictures), model.points.size()));
  return summary;
}

}  // namespace

Format colmap_format() {
  return {
      "colmap",
      {},
      {Content::kCloud},
      "map.db, recording",
      "COLMAP model for Gaussian splatting and MVS",
      "A folder with `sparse/0` (`--text on`: text files) and `images/`, undistorted and numbered. Poses are "
      "camera_from_world; half a pixel is added to the principal point and to every 2D point, as COLMAP has "
      "the middle of the top left pixel at (0.5, 0.5). Points are the landmarks that at least two keyframes "
      "see, with their tracks and the cloud's colours; `--dense-points 100000` takes points of the cloud "
      "instead, which have no tracks. Pictures are the keyframes'; `--every N` adds every N-th tracked "
      "frame, `--sharpest on` takes the sharpest picture near each keyframe, which suits splatting better "
      "(only keyframes have tracks). The recording is found by the map, or given with `--recording`, one for "
      "each robot; if it is missing, the model has only poses, and the program says so.",
      {"text", "every", "sharpest", "dense_points", "voxel"},
      &write_colmap};
}

}  // namespace plumbline::exports
