// SPDX-License-Identifier: BSD-3-Clause
// Symmetric point-to-plane ICP of two surfaces.
#include "plumbline/mapping/local_map_alignment.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "plane_matches.hpp"
#include "surface_voxels.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

/// Up to `wanted` samples, as many as possible from each of the ways a surface may face, spread over the
/// rest.
CoarseSurface spread(const CoarseSurface& samples, int wanted) {
  std::array<std::vector<std::uint32_t>, 6> ways;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ways[facing(samples[i].normal)].push_back(static_cast<std::uint32_t>(i));
  }
  std::array<std::vector<std::uint32_t>*, 6> order{};
  for (std::size_t i = 0; i < 6; ++i) order[i] = &ways[i];
  std::stable_sort(order.begin(), order.end(), [](auto* x, auto* y) { return x->size() < y->size(); });
  CoarseSurface result;
  auto left = static_cast<std::size_t>(wanted);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::vector<std::uint32_t>& way = *order[i];
    const std::size_t take = std::min(way.size(), left / (order.size() - i));
    for (std::size_t k = 0; k < take; ++k) result.push_back(samples[way[k * way.size() / take]]);
    left -= take;
  }
  return result;
}

class Aligner {
 public:
  Aligner(const SurfaceIndex& a, const SurfaceIndex& b, const AlignmentOptions& options)
      : a_(a), b_(b), options_(options), reach_(options.distance_m) {}

  SurfaceAlignment run(const Rigid3& start) {
    result_.b_from_a = start;
    if (!settle()) return result_;
    // Of surfaces that lay far apart few samples were in reach. Now that they meet, more are.
    if (moved_since(start) > kFar * options_.distance_m && !settle()) return result_;
    match(0.5 * options_.distance_m);
    if (matches_.size() < kFewest) return refuse("the surfaces do not meet");
    judge(start);
    return result_;
  }

 private:
  static constexpr std::size_t kFewest = 100;
  static constexpr std::size_t kTried = 3000;  ///< of each surface's samples, when samples are chosen
  static constexpr double kStill_m = 1e-4;
  static constexpr double kFar = 0.3;  ///< of the distance between matches

  /// ICP from where the surfaces lie now; false: refused.
  bool settle() {
    choose_samples();
    double distance = options_.distance_m;
    for (int round = 1; round <= options_.max_iterations; ++round) {
      ++result_.iterations;
      match(distance);
      if (matches_.size() < kFewest) {
        refuse("the surfaces do not meet");
        return false;
      }
      narrow_ = distance <= 0.5 * options_.distance_m;
      const Vector6d step = solve();
      result_.b_from_a = geometry::exp_se3(step) * result_.b_from_a;
      const double moved =
          (step.head<3>() + step.tail<3>().cross(centre_)).norm() + lever_ * step.tail<3>().norm();
      if (narrow_ && moved < kStill_m) return true;
      if (moved < 0.02 * options_.distance_m) distance = 0.5 * options_.distance_m;
    }
    refuse("it did not converge");
    return false;
  }
  /// How far the middle of the matched samples has moved.
  [[nodiscard]] double moved_since(const Rigid3& start) const {
    return (centre_ - start * (result_.b_from_a.inverse() * centre_)).norm();
  }

  SurfaceAlignment refuse(const char* why) {
    result_.refused = why;
    result_.information.setZero();
    result_.held = 0;
    return result_;
  }

  /// Those that have a counterpart at the start, so that all of them count where the surfaces overlap little.
  void choose_samples() {
    const Rigid3 a_from_b = result_.b_from_a.inverse();
    const CoarseSurface near_b = in_reach(a_.samples(), b_, result_.b_from_a);
    const CoarseSurface near_a = in_reach(b_.samples(), a_, a_from_b);
    shared_ = std::max(share(near_b, a_.samples()), share(near_a, b_.samples()));
    from_a_ = spread(near_b, options_.samples);
    from_b_ = spread(near_a, options_.samples);
  }
  [[nodiscard]] CoarseSurface in_reach(const CoarseSurface& samples, const SurfaceIndex& other,
                                       const Rigid3& other_from_sample) const {
    const Eigen::Matrix3f rotation = other_from_sample.rotation.cast<float>();
    const Eigen::Vector3f translation = other_from_sample.translation.cast<float>();
    CoarseSurface result;
    const std::size_t step = 1 + samples.size() / kTried;
    for (std::size_t i = 0; i < samples.size(); i += step) {
      const maps::SurfaceSample& s = samples[i];
      if (other.any(rotation * s.point + translation, rotation * s.normal, static_cast<float>(reach_),
                    static_cast<float>(options_.min_cosine))) {
        result.push_back(s);
      }
    }
    return result;
  }
  static double share(const CoarseSurface& part, const CoarseSurface& whole) {
    const std::size_t tried = (whole.size() + whole.size() / kTried) / (1 + whole.size() / kTried);
    return whole.empty() ? 0.0 : static_cast<double>(part.size()) / static_cast<double>(tried);
  }

  /// Samples of a on the planes of b, then samples of b on the planes of a.
  void match(double distance) {
    matches_.clear();
    const Rigid3& b_from_a = result_.b_from_a;
    const Rigid3 a_from_b = b_from_a.inverse();
    const auto reach = static_cast<float>(distance);
    const auto cosine = static_cast<float>(options_.min_cosine);
    for (const maps::SurfaceSample& s : from_a_) {
      const Eigen::Vector3d p = b_from_a * s.point.cast<double>();
      const Eigen::Vector3d n = b_from_a.rotation * s.normal.cast<double>();
      const maps::SurfaceSample* q = b_.nearest(p.cast<float>(), n.cast<float>(), reach, cosine);
      if (q == nullptr) continue;
      const Eigen::Vector3d normal = q->normal.cast<double>();
      matches_.add(p, normal, normal.dot(p - q->point.cast<double>()), variance(s, *q));
    }
    for (const maps::SurfaceSample& s : from_b_) {
      const Eigen::Vector3d q = s.point.cast<double>();
      const Eigen::Vector3d in_a = a_from_b * q;
      const Eigen::Vector3d n = a_from_b.rotation * s.normal.cast<double>();
      const maps::SurfaceSample* p = a_.nearest(in_a.cast<float>(), n.cast<float>(), reach, cosine);
      if (p == nullptr) continue;
      const Eigen::Vector3d normal = b_from_a.rotation * p->normal.cast<double>();
      matches_.add(q, normal, normal.dot(b_from_a * p->point.cast<double>() - q), variance(s, *p));
    }
  }
  static double variance(const maps::SurfaceSample& x, const maps::SurfaceSample& y) {
    const auto of_x = static_cast<double>(x.sigma);
    const auto of_y = static_cast<double>(y.sigma);
    return of_x * of_x + of_y * of_y;
  }

  /// One Gauss-Newton step, in the directions that the surfaces hold. Rotations are taken about the middle of
  /// the matches and scaled by their spread, so that all six numbers are metres.
  Vector6d solve() {
    centre_ = matches_.middle();
    lever_ = std::max(0.1, matches_.spread(centre_));
    // What most matches agree on; at least what the depth noise explains.
    const MatchLoss loss{std::max(1.0, 1.4826 * matches_.median_error()), narrow_};
    const MatchEquations equations = matches_.equations(centre_, lever_, loss);
    inliers_ = equations.inliers;
    rms_ = inliers_ > 0 ? std::sqrt(equations.squares / inliers_) : 0.0;
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(equations.h);
    eigenvalues_ = eigen.eigenvalues();
    directions_ = eigen.eigenvectors();
    Vector6d step = Vector6d::Zero();
    for (int i = 0; i < 6; ++i) {
      held_[static_cast<std::size_t>(i)] = eigenvalues_(i) > options_.min_hold * equations.weights;
      if (!held_[static_cast<std::size_t>(i)]) continue;
      step -= directions_.col(i) * (directions_.col(i).dot(equations.g) / eigenvalues_(i));
    }
    step.tail<3>() /= lever_;
    step.head<3>() -= step.tail<3>().cross(centre_);
    return step;
  }

  void judge(const Rigid3& start) {
    const Eigen::Vector3d before = start * (result_.b_from_a.inverse() * centre_);
    solve();
    set_information();
    result_.inliers = inliers_;
    result_.rms = rms_;
    const double tried = static_cast<double>(from_a_.size() + from_b_.size());
    result_.overlap = shared_ * static_cast<double>(inliers_) / tried;
    result_.shift_m = (centre_ - before).norm();
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
  /// In the directions that are held: what the matches say, scaled by how well they fit, no better than the
  /// floor. Nothing in the others.
  void set_information() {
    const double fit = options_.correlation / std::max(1.0, rms_ * rms_);
    Matrix6d scaled = Matrix6d::Zero();
    result_.held = 0;
    for (int i = 0; i < 6; ++i) {
      if (!held_[static_cast<std::size_t>(i)]) continue;
      const double variance = 1.0 / (fit * eigenvalues_(i)) + options_.floor_m * options_.floor_m;
      scaled += directions_.col(i) * directions_.col(i).transpose() / variance;
      ++result_.held;
    }
    // (rho + phi x centre, lever phi) are the scaled numbers of xi = (rho, phi).
    Matrix6d scaled_from_xi = Matrix6d::Identity();
    scaled_from_xi.topRightCorner<3, 3>() = -geometry::skew(centre_);
    scaled_from_xi.bottomRightCorner<3, 3>() *= lever_;
    result_.information = scaled_from_xi.transpose() * scaled * scaled_from_xi;
  }

  const SurfaceIndex& a_;
  const SurfaceIndex& b_;
  const AlignmentOptions& options_;
  CoarseSurface from_a_;
  CoarseSurface from_b_;
  SurfaceAlignment result_;
  PlaneMatches matches_;  ///< in b's frame
  double reach_;
  double shared_ = 0.0;  ///< of the smaller surface, near the other one at the start
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double lever_ = 1.0;
  int inliers_ = 0;
  double rms_ = 0.0;
  bool narrow_ = false;
  Vector6d eigenvalues_ = Vector6d::Zero();
  Matrix6d directions_ = Matrix6d::Identity();
  std::array<bool, 6> held_{};
};

}  // namespace

void AlignmentOptions::declare(core::OptionTable& table) {
  table.integer("icp.samples", samples, {100, 100000}, "", "Samples of each local map that are matched");
  table.number("icp.distance", distance_m, {0.01, 1.0}, "m",
               "Matched samples are this near at first; it falls to half");
  table.integer("icp.iterations", max_iterations, {1, 1000}, "", "Iterations of each alignment at most");
  table.number("icp.min_overlap", min_overlap, {0.0, 1.0}, "",
               "Share of the surface that must fit for an alignment to be used");
  table.number("icp.max_rms", max_rms, {0.1, 100.0}, "",
               "How well these must fit, standard deviations of the depth noise");
  table.number("icp.max_shift", max_shift_m, {0.0, 10.0}, "m", "Alignments that move further are not used");
  table.number("icp.max_turn", max_turn_rad, {0.0, 3.2}, "rad", "Alignments that turn more are not used");
  table.number(
      "icp.min_hold", min_hold, {0.0, 0.3}, "",
      "A direction is held when its share of the normals, squared, is larger: a corridor's length, with "
      "little along it, is not");
  table.number("icp.correlation", correlation, {1e-4, 1.0}, "",
               "By how much samples count: the noise of neighbours is alike");
  table.number("icp.floor", floor_m, {0.0, 0.1}, "m", "What no alignment of this sensor knows better");
}

SurfaceAlignment align_surfaces(const SurfaceIndex& a, const SurfaceIndex& b, const Rigid3& b_from_a,
                                const AlignmentOptions& options) {
  return Aligner(a, b, options).run(b_from_a);
}

std::vector<SurfaceAlignment> align_pairs(const maps::Map& map, const std::vector<LocalMap>& local_maps,
                                          const std::vector<LocalMapPair>& pairs,
                                          const AlignmentOptions& options, const core::Executor& executor) {
  std::vector<std::unique_ptr<SurfaceIndex>> indices(local_maps.size());
  executor.parallel_for(local_maps.size(), [&](std::size_t i) {
    indices[i] = std::make_unique<SurfaceIndex>(local_maps[i].surface, options.distance_m);
  });
  std::vector<SurfaceAlignment> alignments(pairs.size());
  executor.parallel_for(pairs.size(), [&](std::size_t i) {
    const LocalMapPair& pair = pairs[i];
    const Rigid3 b_from_a = map.camera_from_world(local_maps[pair.b].anchor) *
                            map.camera_from_world(local_maps[pair.a].anchor).inverse();
    alignments[i] = align_surfaces(*indices[pair.a], *indices[pair.b], b_from_a, options);
  });
  executor.parallel_for(indices.size(), [&](std::size_t i) { indices[i].reset(); });
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
