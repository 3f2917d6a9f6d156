// SPDX-License-Identifier: BSD-3-Clause
#include "error_cloud.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/viz/color.hpp"
#include "plumbline/viz/snapshot.hpp"

namespace plumbline::cli {
namespace {

/// Upper end of the colours: the 98th percentile, rounded up to 1, 2 or 5 times a power of ten.
double color_end_m(const std::vector<float>& errors) {
  const float most = core::quantile(errors, 0.98);
  if (std::isnan(most)) return 0.001;
  const double wanted = std::max(1e-6, static_cast<double>(most));
  const double decade = std::pow(10.0, std::floor(std::log10(wanted)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= wanted * (1.0 - 1e-9)) return factor * decade;
  }
  return 10.0 * decade;
}

cloud::PlyData as_ply(const evaluate::SurfaceSamples& cloud, const std::vector<float>& error_m,
                      double end_m) {
  // Points, normals and errors by column
  cloud::PlyData ply;

  // One column per axis
  const auto add_vectors = [&ply](const std::vector<Eigen::Vector3f>& vectors,
                                  const std::array<const char*, 3>& names) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<float> column(vectors.size());
      std::transform(vectors.begin(), vectors.end(), column.begin(),
                     [axis](const Eigen::Vector3f& v) { return v[axis]; });
      ply.add(names[static_cast<std::size_t>(axis)], std::move(column));
    }
  };

  // Normals only if they are known
  add_vectors(cloud.points, {"x", "y", "z"});
  if (!cloud.normals.empty()) add_vectors(cloud.normals, {"nx", "ny", "nz"});

  // Colours by error, for viewers
  std::array<std::vector<std::uint8_t>, 3> rgb;
  for (const float e : error_m) {
    const viz::Rgb c = viz::sequential_color(static_cast<double>(e) / end_m);
    rgb[0].push_back(c.r);
    rgb[1].push_back(c.g);
    rgb[2].push_back(c.b);
  }

  // The error in metres, for programs
  ply.add("red", std::move(rgb[0]));
  ply.add("green", std::move(rgb[1]));
  ply.add("blue", std::move(rgb[2]));
  ply.add("error", error_m);
  ply.shift = {cloud.shift.x(), cloud.shift.y(), cloud.shift.z()};
  ply.comments = {"error: distance in metres",
                  fmt::format("colours: 0 (dark blue) to {:g} mm and more (yellow)", 1000.0 * end_m)};
  for (std::string& comment : cloud.frame.comments()) ply.comments.push_back(std::move(comment));
  return ply;
}

/// The scene for the picture; errors in millimetres.
viz::Scene as_scene(const evaluate::SurfaceSamples& cloud, const std::vector<float>& error_m) {
  viz::Scene scene;
  auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZRGBNormal>>();
  points->resize(cloud.points.size());
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    pcl::PointXYZRGBNormal& p = (*points)[i];
    p.getVector3fMap() = cloud.points[i];
    p.getNormalVector3fMap() = cloud.normals.empty() ? Eigen::Vector3f::Zero() : cloud.normals[i];
  }
  scene.cloud = points;
  scene.scalar_label = "error (mm)";
  for (const float e : error_m) scene.scalars.push_back(1000.0F * e);
  return scene;
}

}  // namespace

/// A cloud with errors as colours and as values, and its picture.
core::Result<void> write_error_cloud(const std::filesystem::path& file, const std::string& title,
                                     const evaluate::SurfaceSamples& cloud, const std::vector<float>& error_m,
                                     const ErrorView& view) {
  if (auto made = core::make_folder(file.parent_path()); !made) return made;
  const double end_m = color_end_m(error_m);
  if (auto done = cloud::write_ply(file.string() + ".ply", as_ply(cloud, error_m, end_m)); !done) return done;
  viz::Scene scene = as_scene(cloud, error_m);
  scene.title = title;
  for (const geometry::Trajectory& camera : view.cameras) scene.paths.push_back({"", camera, {90, 94, 102}});
  viz::SnapshotOptions options;
  options.color = viz::ColorMode::kError;
  options.up = view.up;
  options.scalar_range = {0.0, 1000.0 * end_m};
  return viz::render_snapshot(scene, options, file.string() + ".png");
}

}  // namespace plumbline::cli
