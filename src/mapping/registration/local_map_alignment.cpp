// SPDX-License-Identifier: BSD-3-Clause
// Point-to-plane ICP of two surfaces, both ways at once, in PCL's registration loop.
#include "plumbline/mapping/registration/local_map_alignment.hpp"

#include <fmt/format.h>
#include <pcl/registration/icp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "plumbline/cloud/registration/constrained_point_to_plane.hpp"
#include "plumbline/cloud/registration/two_way_correspondences.hpp"

namespace plumbline::mapping {
namespace {

using cloud::PlaneStep;
using cloud::SurfaceCloud;
using cloud::SurfacePoint;
using geometry::Matrix6d;
using geometry::Rigid3;

constexpr int kFewest = 100;  // correspondences
using Icp = pcl::IterativeClosestPointWithNormals<SurfacePoint, SurfacePoint, double>;
using Criteria = pcl::registration::DefaultConvergenceCriteria<double>;

Rigid3 rigid_of(const Eigen::Matrix4d& matrix) {
  return {Eigen::Quaterniond(Eigen::Matrix3d(matrix.topLeftCorner<3, 3>())).normalized().toRotationMatrix(),
          matrix.topRightCorner<3, 1>()};
}

/// Up to `wanted` of these points, as evenly as possible from all directions that surfaces face, spread over
/// the rest.
pcl::Indices spread(const SurfaceCloud& cloud, const pcl::Indices& some, int wanted) {
  std::array<pcl::Indices, 6> ways;
  for (const int i : some) {
    const SurfacePoint& p = cloud[static_cast<std::size_t>(i)];
    ways[static_cast<std::size_t>(cloud::facing(p.getNormalVector3fMap()))].push_back(i);
  }
  std::array<pcl::Indices*, 6> order{};
  for (std::size_t i = 0; i < 6; ++i) order[i] = &ways[i];
  std::stable_sort(order.begin(), order.end(), [](auto* x, auto* y) { return x->size() < y->size(); });
  pcl::Indices result;
  auto left = static_cast<std::size_t>(wanted);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const pcl::Indices& way = *order[i];
    const std::size_t take = std::min(way.size(), left / (order.size() - i));
    for (std::size_t k = 0; k < take; ++k) result.push_back(way[k * way.size() / take]);
    left -= take;
  }
  return result;
}

/// Points of a surface that have a counterpart on another one, and the number of points tested.
struct Overlap {
  pcl::Indices points;
  double share = 0.0;
};
Overlap overlap_of(const cloud::SurfaceSearch& surface, const cloud::SurfaceSearch& other,
                   const Rigid3& other_from_surface, const AlignmentOptions& options) {
  constexpr std::size_t kTried = 3000;
  const SurfaceCloud& cloud = *surface.cloud();
  const Eigen::Matrix3f rotation = other_from_surface.rotation.cast<float>();
  const Eigen::Vector3f translation = other_from_surface.translation.cast<float>();
  Overlap found;

  // A regular sample suffices for the share, and for the points to be matched.
  std::size_t tried = 0;
  for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / kTried, ++tried) {
    SurfacePoint p = cloud[i];
    p.getVector3fMap() = rotation * cloud[i].getVector3fMap() + translation;
    p.getNormalVector3fMap() = rotation * cloud[i].getNormalVector3fMap();

    if (cloud::nearest_facing(*other.tree(), p, static_cast<float>(options.distance_m),
                              static_cast<float>(options.min_cosine)) >= 0) {
      found.points.push_back(static_cast<int>(i));
    }
  }

  found.share =
      static_cast<double>(found.points.size()) / static_cast<double>(std::max<std::size_t>(1, tried));
  return found;
}

class Aligner {
 public:
  Aligner(const cloud::SurfaceSearch& a, const cloud::SurfaceSearch& b, const AlignmentOptions& options)
      : a_(a),
        b_(b),
        options_(options),
        correspondences_(
            std::make_shared<cloud::TwoWayCorrespondences>(a, b, static_cast<float>(options.min_cosine))),
        estimation_(std::make_shared<cloud::ConstrainedPointToPlane>(options.min_information)) {}

  SurfaceAlignment run(const Rigid3& start) {
    constexpr double kFar = 0.3;  // of the distance between matches
    result_.b_from_a = start;
    if (a_.tree() == nullptr || b_.tree() == nullptr) return refuse("the surfaces do not meet");
    if (!settle()) return result_;
    // If the surfaces lay far apart few samples were in reach; now that they meet, more are.
    if (moved_since(start) > kFar * options_.distance_m && !settle()) return result_;
    judge(start);
    return result_;
  }

 private:
  /// ICP from the present pose; false: refused.
  bool settle() {
    choose_samples();
    return align(false) && align(true);
  }
  bool align(bool narrow) {
    constexpr double kStill_m = 5e-4;

    // The wide pass brings the surfaces together; the narrow one leaves out matches
    // that were in reach only by chance.
    const double distance = narrow ? 0.5 * options_.distance_m : options_.distance_m;
    const double still = narrow ? kStill_m : 0.02 * options_.distance_m;
    estimation_->setNarrow(narrow);

    Icp icp;
    icp.setInputSource(a_.cloud());
    icp.setInputTarget(b_.cloud());
    icp.setSearchMethodTarget(b_.tree(), true);
    icp.setCorrespondenceEstimation(correspondences_);
    icp.setTransformationEstimation(estimation_);
    icp.setMaxCorrespondenceDistance(distance);
    icp.setMaximumIterations(options_.max_iterations);
    icp.setTransformationEpsilon(still * still);
    icp.setTransformationRotationEpsilon(std::cos(still));

    SurfaceCloud moved;
    icp.align(moved, result_.b_from_a.isometry().matrix());
    result_.b_from_a = rigid_of(icp.getFinalTransformation());
    pcl::transformPointCloudWithNormals(*a_.cloud(), moved,
                                        result_.b_from_a.isometry().matrix().cast<float>().eval());

    // PCL returns only a pose: information, inliers and residual follow from the correspondences there.
    pcl::Correspondences found;
    correspondences_->setInputSource(std::make_shared<SurfaceCloud>(moved));
    correspondences_->determineCorrespondences(found, distance);

    if (found.size() < kFewest) {
      refuse("the surfaces do not meet");
      return false;
    }

    step_ = estimation_->step(moved, *b_.cloud(), found);
    if (icp.getConvergeCriteria()->getConvergenceState() != Criteria::CONVERGENCE_CRITERIA_ITERATIONS)
      return true;
    refuse("it did not converge");
    return false;
  }
  /// Distance by which the middle of the matched samples has moved, metres.
  [[nodiscard]] double moved_since(const Rigid3& start) const {
    return (step_.centre - start * (result_.b_from_a.inverse() * step_.centre)).norm();
  }

  SurfaceAlignment refuse(const char* why) {
    result_.refused = why;
    result_.information.setZero();
    result_.held = 0;
    return result_;
  }

  /// Chooses samples that have a counterpart at the start, so that all of them count even if the surfaces
  /// overlap little.
  void choose_samples() {
    const Overlap of_a = overlap_of(a_, b_, result_.b_from_a, options_);
    const Overlap of_b = overlap_of(b_, a_, result_.b_from_a.inverse(), options_);
    shared_ = std::max(of_a.share, of_b.share);
    pcl::Indices from_a = spread(*a_.cloud(), of_a.points, options_.samples);
    pcl::Indices from_b = spread(*b_.cloud(), of_b.points, options_.samples);
    tried_ = static_cast<double>(from_a.size() + from_b.size());
    correspondences_->setSamples(std::move(from_a), std::move(from_b));
  }

  void judge(const Rigid3& start) {
    set_information();
    result_.inliers = step_.inliers;
    result_.rms = step_.rms;
    result_.overlap = shared_ * static_cast<double>(step_.inliers) / tried_;
    result_.shift_m = moved_since(start);
    result_.turn_rad = geometry::rotation_angle(result_.b_from_a.rotation * start.rotation.transpose());
    if (result_.overlap < options_.min_overlap) {
      result_.refused = fmt::format("{:.2f} of the surface fits", result_.overlap);
    } else if (result_.rms > options_.max_rms) {
      result_.refused = fmt::format("what fits is {:.1f} standard deviations off", result_.rms);
    } else if (result_.shift_m > options_.max_shift_m || result_.turn_rad > options_.max_turn_rad) {
      result_.refused = fmt::format("it moved by {:.2f} m and {:.2f} rad", result_.shift_m, result_.turn_rad);
    } else if (result_.held < 3) {
      result_.refused = fmt::format("the surfaces hold {} directions of 6", result_.held);
    }
  }
  /// Sets the information: in held directions from the matches, scaled by their fit and bounded by the floor;
  /// zero in the others.
  void set_information() {
    const double fit = options_.correlation / std::max(1.0, step_.rms * step_.rms);
    Matrix6d scaled = Matrix6d::Zero();
    result_.held = 0;
    for (int i = 0; i < 6; ++i) {
      if (!step_.held[static_cast<std::size_t>(i)]) continue;
      const double variance = 1.0 / (fit * step_.eigenvalues(i)) + options_.floor_m * options_.floor_m;
      scaled += step_.directions.col(i) * step_.directions.col(i).transpose() / variance;
      ++result_.held;
    }
    // (rho + phi x centre, lever phi) are the scaled numbers of xi = (rho, phi).
    Matrix6d scaled_from_xi = Matrix6d::Identity();
    scaled_from_xi.topRightCorner<3, 3>() = -geometry::skew(step_.centre);
    scaled_from_xi.bottomRightCorner<3, 3>() *= step_.lever;
    result_.information = scaled_from_xi.transpose() * scaled * scaled_from_xi;
  }

  const cloud::SurfaceSearch& a_;
  const cloud::SurfaceSearch& b_;
  const AlignmentOptions& options_;
  std::shared_ptr<cloud::TwoWayCorrespondences> correspondences_;
  std::shared_ptr<cloud::ConstrainedPointToPlane> estimation_;
  SurfaceAlignment result_;
  PlaneStep step_;
  double tried_ = 1.0;   ///< samples that look for a partner
  double shared_ = 0.0;  ///< of the smaller surface, near the other one at the start
};

}  // namespace

cloud::SurfaceSearch search_of(const CoarseSurface& surface) {
  auto cloud = std::make_shared<SurfaceCloud>();
  for (const maps::SurfaceSample& s : surface)
    cloud->push_back(cloud::surface_point(s.point, s.normal, s.sigma));
  return cloud::SurfaceSearch(cloud);
}

void AlignmentOptions::declare(core::OptionTable& table) {
  table.integer("icp.samples", samples, {100, 100000}, "", "Number of samples of each local map to match");
  table.number("icp.distance", distance_m, {0.01, 1.0}, "m",
               "Largest distance of matched samples in the first step; it falls to half");
  table.integer("icp.iterations", max_iterations, {1, 1000}, "",
                "Largest number of iterations of each alignment");
  table.number("icp.min_overlap", min_overlap, {0.0, 1.0}, "",
               "Smallest share of the surface that must fit for an alignment to be used");
  table.number("icp.max_rms", max_rms, {0.1, 100.0}, "",
               "Largest RMS of the fitting surface, standard deviations of the depth noise");
  table.number("icp.max_shift", max_shift_m, {0.0, 10.0}, "m", "Largest shift by an alignment");
  table.number("icp.max_turn", max_turn_rad, {0.0, 3.2}, "rad", "Largest rotation by an alignment");
  table.number(
      "icp.min_information", min_information, {0.0, 0.3}, "",
      "A direction is held when its share of the normals, squared, is larger: a corridor's length, with "
      "little along it, is not");
}

SurfaceAlignment align_surfaces(const cloud::SurfaceSearch& a, const cloud::SurfaceSearch& b,
                                const Rigid3& b_from_a, const AlignmentOptions& options) {
  return Aligner(a, b, options).run(b_from_a);
}

std::vector<SurfaceAlignment> align_pairs(const maps::Map& map, const std::vector<LocalMap>& local_maps,
                                          const std::vector<LocalMapPair>& pairs,
                                          const AlignmentOptions& options, const core::Executor& executor) {
  std::vector<std::optional<cloud::SurfaceSearch>> searches(local_maps.size());
  executor.parallel_for(local_maps.size(),
                        [&](std::size_t i) { searches[i] = search_of(local_maps[i].surface); });
  std::vector<SurfaceAlignment> alignments(pairs.size());
  executor.parallel_for(pairs.size(), [&](std::size_t i) {
    const LocalMapPair& pair = pairs[i];
    const Rigid3 b_from_a = map.camera_from_world(local_maps[pair.b].anchor) *
                            map.camera_from_world(local_maps[pair.a].anchor).inverse();
    alignments[i] = align_surfaces(*searches[pair.a], *searches[pair.b], b_from_a, options);
  });
  return alignments;
}

std::vector<PoseEdge> to_edges(const std::vector<LocalMap>& local_maps,
                               const std::vector<LocalMapPair>& pairs,
                               const std::vector<SurfaceAlignment>& alignments) {
  std::vector<PoseEdge> edges;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!alignments[i].refused.empty()) continue;
    edges.push_back({local_maps[pairs[i].a].anchor, local_maps[pairs[i].b].anchor, alignments[i].b_from_a,
                     alignments[i].information, false});
  }
  return edges;
}

}  // namespace plumbline::mapping
