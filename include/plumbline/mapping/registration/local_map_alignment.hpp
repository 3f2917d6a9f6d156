// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Local maps and their relative poses. A local map is the fused surface of a few consecutive keyframes; local
// maps that overlap, revisits included, are aligned by point-to-plane ICP, both ways at once, weighted with
// the depth noise. Directions that the surfaces do not hold (along a corridor, within a wall) are not moved
// and get no information.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "plumbline/cloud/registration/surface_cloud.hpp"
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::mapping {

/// Surface of one keyframe (its camera frame) or of one local map (its anchor's): about one sample per voxel
/// and direction.
using CoarseSurface = std::vector<maps::SurfaceSample>;

/// Thins a keyframe's cloud (frame of the depth camera, normals towards it; points without normal are passed
/// over) with cloud::voxel_filtered, in the frame that its sensor pose leads to: the colour camera's.
CoarseSurface coarse_surface(const cloud::Cloud& camera_cloud, double voxel_m);

struct LocalMapOptions {
  int keyframes = 6;        ///< in one local map at most
  double distance_m = 0.4;  ///< from a local map's first keyframe; beyond, the next local map begins
  double angle_rad = 0.6;
  double voxel_m = 0.03;
  void declare(core::OptionTable& table);
};

struct LocalMap {
  core::KeyframeId anchor;                ///< the middle one of `members`
  std::vector<core::KeyframeId> members;  ///< by id
  CoarseSurface surface;                  ///< anchor's camera frame
};

/// Cuts each robot's keyframes, by id, into local maps. Keyframes without a surface are skipped. Surfaces
/// are fused in parallel; the same for any number of threads.
std::vector<LocalMap> make_local_maps(const maps::Map& map,
                                      const std::map<core::KeyframeId, CoarseSurface>& surfaces,
                                      const LocalMapOptions& options, const core::Executor& executor);

/// The surface with its search tree, in the form that PCL's registration needs.
cloud::SurfaceSearch search_of(const CoarseSurface& surface);

struct AlignmentOptions {
  int samples = 900;         ///< of each surface that are matched, spread over the directions they face
  double distance_m = 0.10;  ///< between matched samples at first; falls to half
  int max_iterations = 20;
  double min_cosine = 0.8;   ///< between the normals of matched samples
  double min_overlap = 0.3;  ///< share of the samples that must fit
  double max_rms = 5.0;      ///< largest RMS residual of these, in standard deviations
  double max_shift_m = 0.3;  ///< alignments that move further are rejected
  double max_turn_rad = 0.2;
  double min_information = 0.02;  ///< share of the normals, squared, that a direction needs to count as held
  double correlation = 0.15;      ///< samples count by this much: noise of neighbours is alike
  double floor_m = 0.0012;        ///< smallest standard deviation of an alignment with this sensor
  void declare(core::OptionTable& table);
};

/// Relative pose b_from_a estimated from the two surfaces.
struct SurfaceAlignment {
  geometry::Rigid3 b_from_a;
  geometry::Matrix6d information = geometry::Matrix6d::Zero();  ///< of log(estimate * b_from_a^-1)
  int held = 0;  ///< directions of six that the surfaces hold: the rank of `information`
  int inliers = 0;
  double overlap = 0.0;  ///< share of the surface with more of it in the other's reach that fits
  double rms = 0.0;      ///< of the inliers, in standard deviations
  double shift_m = 0.0;  ///< motion of the middle of the matched samples
  double turn_rad = 0.0;
  int iterations = 0;
  std::string refused;  ///< why it must not be used; empty: it may
};

/// pcl::IterativeClosestPointWithNormals from `b_from_a`, with correspondences both ways
/// (cloud::TwoWayCorrespondences) and steps in the directions that the surfaces hold
/// (cloud::ConstrainedPointToPlane); once within the distance, once within half of it. Deterministic.
SurfaceAlignment align_surfaces(const cloud::SurfaceSearch& a, const cloud::SurfaceSearch& b,
                                const geometry::Rigid3& b_from_a, const AlignmentOptions& options);

struct PairOptions {
  double min_overlap = 0.25;  ///< share of the smaller local map's coarse voxels that both fill
  int per_map = 8;            ///< pairs of each local map at most, those that overlap most first
  double voxel_m = 0.2;       ///< coarse, so that local maps that drifted apart are still found
  void declare(core::OptionTable& table);
};

struct LocalMapPair {
  std::size_t a = 0;  ///< index into the local maps, a < b
  std::size_t b = 0;
  double overlap = 0.0;
};

/// Which local maps overlap at their present poses, whenever they were made; by a, then b.
std::vector<LocalMapPair> overlapping_pairs(const maps::Map& map, const std::vector<LocalMap>& local_maps,
                                            const PairOptions& options, const core::Executor& executor);

/// Alignments of `pairs`, in their order, from the present poses. Side by side; the same for any number of
/// threads.
std::vector<SurfaceAlignment> align_pairs(const maps::Map& map, const std::vector<LocalMap>& local_maps,
                                          const std::vector<LocalMapPair>& pairs,
                                          const AlignmentOptions& options, const core::Executor& executor);

/// Edges between the anchors, of the alignments that may be used.
std::vector<PoseEdge> to_edges(const std::vector<LocalMap>& local_maps,
                               const std::vector<LocalMapPair>& pairs,
                               const std::vector<SurfaceAlignment>& alignments);

}  // namespace plumbline::mapping
