// SPDX-License-Identifier: BSD-3-Clause
// Two views of one place registered with PCL's loop: voxel-filtered surfaces, correspondences both ways, and
// steps in the directions that the surfaces hold. These classes work in any program that uses PCL.
//
//   register_clouds INPUT PIPELINES FRAME
//
// Registers the depth image of frame 0 with that of FRAME, from a start that is 3 cm and 1 degree off, and
// prints how far the result is from the truth.
#include <pcl/registration/icp.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/registration/constrained_point_to_plane.hpp"
#include "plumbline/cloud/registration/two_way_correspondences.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/sensor/depth_noise.hpp"

using namespace plumbline;

namespace {

/// Points with normals, and their standard deviation as curvature, one for each 3 cm.
cloud::SurfaceSearch surface_of(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera) {
  cloud::SurfaceCloud points;
  const cloud::CloudPtr image = cloud::organised_cloud(frame, camera);
  for (const cloud::Point& p : *image) {
    cloud::SurfacePoint point;
    point.getVector3fMap() = p.getVector3fMap();
    point.getNormalVector3fMap() = p.getNormalVector3fMap();
    point.curvature = static_cast<float>(sensor::depth_sigma(static_cast<double>(p.z)));
    points.push_back(point);
  }
  return cloud::SurfaceSearch(
      std::make_shared<cloud::SurfaceCloud>(cloud::voxel_filtered(points, 0.03F, false)));
}

pcl::Indices every(const cloud::SurfaceSearch& surface, std::size_t step) {
  pcl::Indices indices;
  for (std::size_t i = 0; i < surface.cloud()->size(); i += step) indices.push_back(static_cast<int>(i));
  return indices;
}

/// Prints the message; returns the exit code that the program uses for this kind of error.
int fail(const core::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return static_cast<int>(error.kind);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: register_clouds INPUT PIPELINES FRAME\n");
    return 2;
  }

  const std::filesystem::path pipelines = argv[2];
  const auto other = static_cast<std::size_t>(std::atoi(argv[3]));
  const core::Executor executor;
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  dataset::OpenOptions options;
  options.cameras_folder = pipelines / "cameras";
  const auto source = pipeline::open_input(argv[1], options, pipelines / "scenes", executor, *log);
  if (!source) return fail(source.error());

  const auto first = (*source)->read(0);
  if (!first) return fail(first.error());

  const auto second = (*source)->read(other);
  if (!second) return fail(second.error());

  const auto truth = (*source)->truth();
  const auto at_first = truth ? geometry::pose_at(*truth, first->stamp, 0.05) : std::nullopt;
  const auto at_second = truth ? geometry::pose_at(*truth, second->stamp, 0.05) : std::nullopt;
  if (!at_first || !at_second) {
    std::fprintf(stderr, "%s: the recording tells no truth of these frames to start near\n", argv[1]);
    return 3;
  }

  const cloud::SurfaceSearch a = surface_of(*first, (*source)->camera().color);
  const cloud::SurfaceSearch b = surface_of(*second, (*source)->camera().color);
  const geometry::Rigid3 true_b_from_a = at_second->inverse() * *at_first;
  const geometry::Rigid3 start =
      geometry::Rigid3(geometry::exp_so3({0.0, 0.0175, 0.0}), {0.03, 0.0, 0.0}) * true_b_from_a;

  const auto correspondences = std::make_shared<cloud::TwoWayCorrespondences>(a, b, 0.8F);
  correspondences->setSamples(every(a, 4), every(b, 4));
  const auto estimation = std::make_shared<cloud::ConstrainedPointToPlane>(0.02);

  pcl::IterativeClosestPointWithNormals<cloud::SurfacePoint, cloud::SurfacePoint, double> icp;
  icp.setInputSource(a.cloud());
  icp.setInputTarget(b.cloud());
  icp.setSearchMethodTarget(b.tree(), true);
  icp.setCorrespondenceEstimation(correspondences);
  icp.setTransformationEstimation(estimation);
  icp.setMaximumIterations(30);
  icp.setTransformationEpsilon(1e-8);

  geometry::Rigid3 b_from_a = start;
  cloud::SurfaceCloud aligned;
  for (const bool narrow : {false, true}) {
    estimation->setNarrow(narrow);
    icp.setMaxCorrespondenceDistance(narrow ? 0.05 : 0.10);
    icp.align(aligned, b_from_a.isometry().matrix());
    const Eigen::Matrix4d found = icp.getFinalTransformation();
    b_from_a = geometry::Rigid3(found.topLeftCorner<3, 3>(), found.topRightCorner<3, 1>());
  }

  pcl::Correspondences pairs;
  correspondences->setInputSource(std::make_shared<cloud::SurfaceCloud>(aligned));
  correspondences->determineCorrespondences(pairs, 0.05);

  const auto held = estimation->step(aligned, *b.cloud(), pairs).held;
  const Eigen::Vector3d in_view(0.0, 0.0, 2.0);
  std::printf(
      "%zu and %zu points hold %d directions of 6; 2 m in front of the camera %.1f mm off, %.1f mm at the "
      "start\n",
      a.cloud()->size(), b.cloud()->size(), static_cast<int>(std::count(held.begin(), held.end(), true)),
      1e3 * (b_from_a * in_view - true_b_from_a * in_view).norm(),
      1e3 * (start * in_view - true_b_from_a * in_view).norm());
  return 0;
}
