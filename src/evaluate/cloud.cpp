// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/evaluate/cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "icp.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/geometry/alignment.hpp"
#include "prepare.hpp"
#include "surfaces/measured_surface.hpp"
#include "surfaces/point_index.hpp"

namespace plumbline::evaluate {
namespace {

using geometry::Rigid3;
using Points = std::vector<Eigen::Vector3f>;

constexpr std::array<double, 4> kThresholdsMm = {5.0, 10.0, 20.0, 50.0};
constexpr double kSlackMm = 1e-3;           // for distances that lie on a threshold
constexpr double kConsistencyReach = 0.05;  // m
constexpr std::size_t kMostMeshSamples = 5000000;
constexpr std::size_t kPointsAtOnce = 4096;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// The reference in all its forms.
struct Truth {
  std::unique_ptr<PointIndex> index;  ///< index of the samples; null for a mesh
  std::unique_ptr<MeasuredSurface> surface;
  SurfaceSamples counted;  ///< samples at which completeness is measured
  std::size_t hidden = 0;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< of all of them
};

/// The samples that cameras could see; counts the others.
SurfaceSamples visible_of(SurfaceSamples samples, std::size_t& hidden) {
  SurfaceSamples out;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    if (samples.visible[i] == 0) {
      ++hidden;
      continue;
    }
    out.points.push_back(samples.points[i]);
    if (!samples.normals.empty()) out.normals.push_back(samples.normals[i]);
  }
  return out;
}

core::Result<Truth> make_truth(const Reference& reference, const CloudOptions& options,
                               const core::Executor& executor, CloudReport& report) {
  // A mesh is sampled evenly by area
  Truth truth;
  truth.shift = reference.shift;
  if (!reference.mesh.triangles.empty()) {
    truth.surface = std::make_unique<MeshSurface>(reference.mesh);
    const double coarsest = std::sqrt(surface_area(reference.mesh) / static_cast<double>(kMostMeshSamples));
    if (coarsest > options.mesh_spacing_m) {
      report.warnings.push_back(fmt::format("{}: so large that it is sampled every {:.1f} mm only",
                                            reference.name, 1000.0 * coarsest));
    }

    // A mesh must have an area
    truth.counted = sample_mesh(reference.mesh, std::max(options.mesh_spacing_m, coarsest));
    if (truth.counted.points.empty()) {
      return core::input_error(fmt::format("{}: the mesh has no area", reference.name));
    }

  } else {
    // A cloud is its own samples
    truth.index = std::make_unique<PointIndex>(reference.samples.points);
    const Density density = evaluate::density(*truth.index, executor);
    Points normals = known_normals(reference.samples.normals, *truth.index, executor);
    truth.surface =
        std::make_unique<SampledSurface>(*truth.index, normals, density.cell_m(), options.distance);
    truth.counted = {reference.samples.points, std::move(normals), reference.samples.visible};
  }

  // Hidden surface cannot be mapped
  if (options.visible_only && !truth.counted.visible.empty()) {
    truth.counted = visible_of(std::move(truth.counted), truth.hidden);
    report.visibility_used = true;
    if (truth.counted.points.empty()) {
      return core::input_error(fmt::format(
          "{}: no point is marked visible; switch visible_only off to count all", reference.name));
    }
  }

  // The counts say what completeness refers to
  report.reference_points = truth.counted.points.size();
  report.reference_hidden = truth.hidden;
  return truth;
}

/// Least squares over the matched positions of all robots together, each side less its shift; without
/// trajectories the cloud stays where it is.
core::Result<Rigid3> start_from_trajectories(const std::vector<TrajectoryPair>& pairs,
                                             const Eigen::Vector3d& shift, const Eigen::Vector3d& true_shift,
                                             CloudReport& report) {
  // Poses of equal time, in shifted coordinates
  std::vector<Eigen::Vector3d> source;
  std::vector<Eigen::Vector3d> target;

  // Every robot's path contributes
  for (const TrajectoryPair& pair : pairs) {
    TrajectoryOptions options;
    options.align = TrajectoryAlignment::kNone;
    const auto matched = evaluate_trajectory(pair.estimate, pair.truth, options);
    if (!matched) return tl::unexpected(matched.error());

    // Small coordinates keep their precision
    for (const PoseError& pose : matched->poses) {
      source.push_back(pose.estimate.translation - shift);
      target.push_back(pose.truth.translation - true_shift);
    }
  }

  // Without poses the files' coordinates decide
  if (source.empty()) return Rigid3(Eigen::Matrix3d::Identity(), shift - true_shift);
  if (source.size() < 3) {
    return core::input_error(fmt::format(
        "only {} poses match the truth in time; 3 are needed to start the alignment", source.size()));
  }

  // Rigid alignment of all positions
  const Rigid3 start = geometry::align_points(source, target);
  double squares = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) squares += (start * source[i] - target[i]).squaredNorm();
  report.alignment.trajectory_poses = source.size();
  report.alignment.trajectory_rmse_m = std::sqrt(squares / static_cast<double>(source.size()));
  return start;
}

core::Result<void> align(SurfaceSamples& cloud, const Truth& truth, const CloudOptions& options,
                         const std::vector<TrajectoryPair>& trajectories, const core::Executor& executor,
                         CloudReport& report) {
  // Without alignment the coordinates are taken as given
  report.alignment.align = options.align;
  const bool none = options.align == CloudAlignment::kNone;
  const auto start = start_from_trajectories(none ? std::vector<TrajectoryPair>{} : trajectories, cloud.shift,
                                             truth.shift, report);
  if (!start) return tl::unexpected(start.error());

  // The shifts may still differ
  if (none) {
    if (cloud.shift != truth.shift) move(*start, cloud);
    report.alignment.reference_from_cloud = *start;
    return {};
  }

  // Refinement on the surfaces
  const IcpResult icp = align_icp(cloud.points, *truth.surface, *start,
                                  {options.icp_max_distance_m, options.icp_trim}, executor);
  report.alignment.reference_from_cloud = icp.reference_from_cloud;
  report.alignment.icp_iterations = icp.iterations;
  report.alignment.icp_rmse_mm = 1000.0 * icp.rmse_m;
  report.alignment.icp_overlap = icp.overlap;
  report.alignment.icp_converged = icp.converged;

  // Too little overlap, too little shape, too few iterations
  report.alignment.failed = icp.overlap < 0.3;
  if (report.alignment.failed) {
    report.warnings.push_back(fmt::format(
        "alignment: only {:.0f} % of the cloud found a partner within reach; the numbers are not to be "
        "trusted{}",
        100.0 * icp.overlap, trajectories.empty() ? ", give --trajectory and --truth to start from" : ""));

  } else if (!icp.determined) {
    report.warnings.push_back(
        "alignment: the surfaces do not fix all directions (a single plane?); the others are left as they "
        "started");
  } else if (!icp.converged) {
    report.warnings.push_back("alignment: ICP was still moving when it reached its last iteration");
  }

  // The cloud is compared in the reference's frame
  move(icp.reference_from_cloud, cloud);
  return {};
}

struct Distances {
  std::vector<float> error_m;
  std::vector<double> mm;
  double cosines = 0.0;  ///< sum over pairs within reach whose normals are known
  std::size_t cosine_count = 0;
};

/// Distances from every point of `from`, visited in `order`, to `surface`.
Distances measure(const Points& from, const Points& normals, const std::vector<std::uint32_t>& order,

                  // One result per point, in the order of `from`
                  const MeasuredSurface& surface, const core::Executor& executor) {
  // Normals are optional
  Distances out;
  out.error_m.resize(from.size());
  out.mm.resize(from.size());
  std::vector<float> cosines(normals.empty() ? 0 : from.size(), kNone);

  // Nearby queries share their neighbours in the index
  for_chunks(executor, order.size(), kPointsAtOnce, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const std::uint32_t i = order[k];
      const Foot foot = surface.foot(from[i].cast<double>());
      out.error_m[i] = static_cast<float>(foot.distance);
      out.mm[i] = 1000.0 * foot.distance;

      // Normals are compared only close to the surface
      if (cosines.empty() || normals[i].isZero() || foot.normal.isZero()) continue;
      if (foot.distance > kConsistencyReach) continue;
      cosines[i] = static_cast<float>(std::min(1.0, std::abs(normals[i].cast<double>().dot(foot.normal))));
    }
  });

  // A sum in fixed order gives the same bits
  for (const float c : cosines) {
    if (std::isnan(c)) continue;
    out.cosines += static_cast<double>(c);
    ++out.cosine_count;
  }
  return out;
}

double share_within(const std::vector<double>& mm, double threshold_mm) {
  const auto near =
      std::count_if(mm.begin(), mm.end(), [&](double d) { return d <= threshold_mm + kSlackMm; });
  return static_cast<double>(near) / static_cast<double>(mm.size());
}

/// Distances, and precision, recall and F at each threshold.
void add_scores(const std::vector<double>& cloud_mm, const std::vector<double>& reference_mm,
                CloudReport& report) {
  report.accuracy_mm = summarize(cloud_mm);
  report.completeness_mm = summarize(reference_mm);
  for (const double threshold : kThresholdsMm) {
    ThresholdScore score{threshold, share_within(cloud_mm, threshold), share_within(reference_mm, threshold),
                         0.0};
    const double sum = score.precision + score.recall;
    if (sum > 0.0) score.f = 2.0 * score.precision * score.recall / sum;
    report.at.push_back(score);
  }
}

/// The order in which completeness visits its points: neighbours one after another.
std::vector<std::uint32_t> order_in_space(const Truth& truth) {
  if (truth.index && truth.hidden == 0) return truth.index->order();
  return PointIndex(truth.counted.points).order();
}

void compare(const PreparedCloud& cloud, const Truth& truth, const CloudOptions& options,
             const core::Executor& executor, CloudReport& report) {
  // Only surface distances need normals everywhere
  const PointIndex& index = *cloud.index;
  const bool own_normals = !cloud.samples->normals.empty();
  Points surface_normals = options.distance == SampleDistance::kSurface
                               ? known_normals(cloud.samples->normals, index, executor)
                               : Points(index.size(), Eigen::Vector3f::Zero());
  if (own_normals && options.distance == SampleDistance::kPoint) surface_normals = cloud.samples->normals;
  const SampledSurface cloud_surface(index, std::move(surface_normals), cloud.density.cell_m(),
                                     options.distance);

  // Accuracy: from the cloud to the reference
  const Distances accuracy =
      measure(cloud.samples->points, cloud.samples->normals, index.order(), *truth.surface, executor);

  // Completeness: from the reference to the cloud, with normals only if the cloud has its own
  const auto order = order_in_space(truth);
  const Distances completeness = measure(truth.counted.points, own_normals ? truth.counted.normals : Points{},
                                         order, cloud_surface, executor);
  add_scores(accuracy.mm, completeness.mm, report);

  // Mean of both directions
  if (own_normals && accuracy.cosine_count > 0 && completeness.cosine_count > 0) {
    report.normal_consistency = 0.5 * (accuracy.cosines / static_cast<double>(accuracy.cosine_count) +
                                       completeness.cosines / static_cast<double>(completeness.cosine_count));
  }

  // Errors by point, for coloured clouds
  for (std::size_t i = 0; i < cloud.source.size(); ++i) report.error_m[cloud.source[i]] = accuracy.error_m[i];
  report.reference_samples = truth.counted.points;
  report.reference_normals = truth.counted.normals;
  report.reference_error_m = completeness.error_m;
}

/// Warns if cloud and reference are apart, because the numbers then say nothing about the map.
void warn_when_apart(const CloudOptions& options, CloudReport& report) {
  constexpr double kApartMm = 100.0;
  if (report.accuracy_mm.median < kApartMm) return;
  report.warnings.push_back(fmt::format(
      "half of the cloud lies {:.0f} mm or more from the reference: {}", report.accuracy_mm.median,
      options.align == CloudAlignment::kNone
          ? "the two are hardly in one frame; align them first with --align se3 (and --trajectory EST "
            "--truth GT if that does not suffice)"
          : "the alignment found no good start; give it the cloud's path and its truth with --trajectory EST "
            "--truth GT"));
}

/// Planes and alignment in the coordinates of the files, which were less a shift till now.
void add_shifts(const Eigen::Vector3d& shift, const Eigen::Vector3d& true_shift, CloudReport& report) {
  for (WallPlane& plane : report.planes) plane.offset_m += plane.normal.dot(shift);
  Rigid3& moved = report.alignment.reference_from_cloud;
  moved.translation += true_shift - moved.rotation * shift;
}

}  // namespace

/// The options of evaluate cloud.
void CloudOptions::declare(core::OptionTable& table) {
  table.choice(
      "align", align, {{"none", CloudAlignment::kNone}, {"se3", CloudAlignment::kSe3}},
      "Alignment of the cloud with the reference: none, or from the trajectories if given, then by ICP");
  table.choice(
      "distance", distance, {{"surface", SampleDistance::kSurface}, {"point", SampleDistance::kPoint}},
      "Distance to a sampled surface: to the plane through the nearest sample, or to the sample itself");
  table.boolean(
      "visible_only", visible_only,
      "Completeness counts only samples that cameras could see, if the reference has the property visible");
  table.number("mesh_spacing", mesh_spacing_m, {1e-4, 1.0}, "m", "Spacing of samples on a reference mesh");
  table.number("icp_max_distance", icp_max_distance_m, {1e-3, 100.0}, "m",
               "Largest distance of pairs in the first step of ICP");
  table.number("icp_trim", icp_trim, {0.1, 1.0}, "", "Share of the nearest pairs that ICP keeps");
  wall.declare(table);
  planes.declare(table);
}

core::Result<CloudReport> evaluate_cloud(const SurfaceSamples& cloud, const Reference* reference,
                                         const CloudOptions& options,
                                         const std::vector<TrajectoryPair>& trajectories,
                                         const core::Executor& executor) {
  // Frames must agree unless trajectories align them
  if (const auto ok = check(options); !ok) return tl::unexpected(ok.error());
  if (reference != nullptr) {
    if (const auto ok = check(*reference); !ok) return tl::unexpected(ok.error());
    const bool placed = options.align != CloudAlignment::kNone && !trajectories.empty();
    const auto fits =
        placed ? core::Result<void>()
               : cloud::check_one_frame("the cloud", cloud.shift, reference->name, reference->shift);
    if (!fits) return tl::unexpected(fits.error());
  }

  // Points that are not finite are left out
  CloudReport report;
  auto prepared = prepare(cloud, executor, report);
  if (!prepared) return tl::unexpected(prepared.error());

  // The reference, sampled and indexed
  std::optional<Truth> truth;
  if (reference != nullptr) {
    auto made = make_truth(*reference, options, executor, report);
    if (!made) return tl::unexpected(made.error());
    truth = std::move(*made);
  }

  // Wall thickness needs no reference
  std::vector<WallPatch> patches =
      wall_patches(*prepared->samples, prepared->density.spacing_m, options.wall, executor);
  report.wall = thickness_of(patches);
  report.planes = wall_planes(*prepared->samples, std::move(patches), options.wall.patch_m, options.planes);
  if (report.wall.patches == 0) {
    report.warnings.push_back("no flat patch was found that is dense enough: wall thickness is not known");
  }

  // Nothing more can be measured without a reference
  if (!truth) {
    add_shifts(cloud.shift, cloud.shift, report);
    return report;
  }

  // Alignment comes before all distances
  report.has_reference = true;
  report.error_m.assign(cloud.points.size(), kNone);
  if (const auto ok = align(*prepared->samples, *truth, options, trajectories, executor, report); !ok)
    return tl::unexpected(ok.error());

  // A moved cloud needs a new index
  if (options.align != CloudAlignment::kNone || cloud.shift != truth->shift)
    prepared->index = std::make_unique<PointIndex>(prepared->samples->points);
  compare(*prepared, *truth, options, executor, report);
  warn_when_apart(options, report);
  add_shifts(cloud.shift, truth->shift, report);
  return report;
}

}  // namespace plumbline::evaluate
