// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/evaluate/wall_planes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::evaluate {
namespace {

constexpr double kPatchAlike = 0.985;  // cosine of 10 degrees
constexpr float kPointAlike = 0.866F;  // cosine of 30 degrees
constexpr std::size_t kFewestPatches = 3;
constexpr int kPasses = 10;

struct SharedPlane {
  Eigen::Vector3d normal;
  double offset_m;
};

using Patches = std::vector<WallPatch>;
using PatchIndices = std::vector<std::size_t>;

bool belongs(const WallPatch& patch, const SharedPlane& plane, double slab_m) {
  return patch.normal.dot(plane.normal) > kPatchAlike &&
         std::abs(plane.normal.dot(patch.center) - plane.offset_m) <= slab_m;
}

PatchIndices members(const Patches& patches, const SharedPlane& plane, double slab_m) {
  PatchIndices own;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (belongs(patches[i], plane, slab_m)) own.push_back(i);
  }
  return own;
}

/// The plane that most patches propose.
SharedPlane most_shared(const Patches& patches, double slab_m) {
  SharedPlane best{patches.front().normal, patches.front().normal.dot(patches.front().center)};
  std::size_t most = 0;
  for (const WallPatch& patch : patches) {
    const SharedPlane plane{patch.normal, patch.normal.dot(patch.center)};
    const auto count = static_cast<std::size_t>(std::count_if(
        patches.begin(), patches.end(), [&](const WallPatch& p) { return belongs(p, plane, slab_m); }));
    if (count <= most) continue;
    most = count;
    best = plane;
  }
  return best;
}

SharedPlane fitted(const Patches& patches, const PatchIndices& own, const SharedPlane& before) {
  // Principal axes of the patches' centres
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::size_t i : own) mean += patches[i].center;
  mean /= static_cast<double>(own.size());

  // Scatter about their mean
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::size_t i : own) {
    const Eigen::Vector3d d = patches[i].center - mean;
    scatter += d * d.transpose();
  }

  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  // Patches in a row do not determine the rotation about that row; their own normals do.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();

  if (solver.eigenvalues()[1] > 1e-2 * solver.eigenvalues()[2]) {
    normal = solver.eigenvectors().col(0);
  } else {
    for (const std::size_t i : own) normal += patches[i].normal;
    normal.normalize();
  }

  // The normal keeps its side
  if (normal.dot(before.normal) < 0.0) normal = -normal;
  return {normal, normal.dot(mean)};
}

/// Area, thickness and straightness of one plane, and the RMS of points near it.
WallPlane measured(const SurfaceSamples& cloud, const Patches& own, const SharedPlane& plane, double patch_m,
                   double slab_m) {
  // Thickness is the patches' median
  WallPlane result;
  result.normal = plane.normal;
  result.offset_m = plane.offset_m;
  result.thickness = thickness_of(own);

  // A voxel grid cuts a plane into more pieces if the plane is oblique to it.
  result.area_m2 = static_cast<double>(own.size()) * patch_m * patch_m / plane.normal.lpNorm<1>();

  // Straightness: patches against the plane
  double sum = 0.0;
  for (const WallPatch& patch : own) {
    const double h = plane.normal.dot(patch.center) - plane.offset_m;
    sum += h * h;
  }
  result.straightness_mm = 1000.0 * std::sqrt(sum / static_cast<double>(own.size()));

  // RMS of points that face the same way
  sum = 0.0;
  const Eigen::Vector3f facing = plane.normal.cast<float>();
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const double h = plane.normal.dot(cloud.points[i].cast<double>()) - plane.offset_m;
    if (std::abs(h) > slab_m) continue;
    if (!cloud.normals.empty() && !(cloud.normals[i].dot(facing) > kPointAlike)) continue;
    sum += h * h;
    ++result.points;
  }

  // Without points it stays unknown
  if (result.points > 0) result.slab_rms_mm = 1000.0 * std::sqrt(sum / static_cast<double>(result.points));
  return result;
}

}  // namespace

void WallPlanesOptions::declare(core::OptionTable& table) {
  table.integer("wall_planes", planes, {0, 100}, "",
                "Number of the largest planes that are measured one by one");
  table.number("wall_slab", slab_m, {0.005, 0.5}, "m", "Largest distance of a plane's points from it");
}

std::vector<WallPlane> wall_planes(const SurfaceSamples& cloud, std::vector<WallPatch> patches,
                                   double patch_m, const WallPlanesOptions& options) {
  // The plane with most patches comes first
  std::vector<WallPlane> planes;
  while (static_cast<int>(planes.size()) < options.planes && patches.size() >= kFewestPatches) {
    SharedPlane plane = most_shared(patches, options.slab_m);
    PatchIndices own = members(patches, plane, options.slab_m);

    // Plane and members are refined in turn
    for (int pass = 0; pass < kPasses && own.size() >= kFewestPatches; ++pass) {
      plane = fitted(patches, own, plane);
      PatchIndices again = members(patches, plane, options.slab_m);
      const bool settled = again == own;
      own = std::move(again);
      if (settled) break;
    }
    if (own.size() < kFewestPatches) break;

    // Patches of this plane are not used again
    Patches of_plane;
    Patches rest;
    std::size_t next = 0;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const bool is_own = next < own.size() && own[next] == i;
      next += is_own ? 1 : 0;
      (is_own ? of_plane : rest).push_back(patches[i]);
    }

    planes.push_back(measured(cloud, of_plane, plane, patch_m, options.slab_m));
    patches = std::move(rest);
  }

  // The largest wall comes first
  std::stable_sort(planes.begin(), planes.end(),
                   [](const WallPlane& a, const WallPlane& b) { return a.area_m2 > b.area_m2; });
  return planes;
}

}  // namespace plumbline::evaluate
