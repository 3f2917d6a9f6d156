// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Cloud against surface: accuracy, completeness, precision, recall, F-score (Knapitsch et al., Tanks and
// Temples, SIGGRAPH 2017), normal consistency, wall thickness, density. Definitions and formulas:
// docs/guide/evaluate.md.
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/evaluate/statistics.hpp"
#include "plumbline/evaluate/surface.hpp"
#include "plumbline/evaluate/wall_planes.hpp"
#include "plumbline/evaluate/wall_thickness.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::evaluate {

enum class CloudAlignment {
  kNone,  ///< compared as they are
  kSe3,   ///< start from trajectories if there are any, then trimmed point-to-plane ICP
};

/// Definition of the distance to a sampled surface. Triangles are always measured exactly.
enum class SampleDistance {
  /// To the plane through the nearest sample where samples surround the foot of the perpendicular, so that
  /// sampling density does not enter; to the sample itself at borders and holes. Normals are estimated where
  /// missing.
  kSurface,
  kPoint,  ///< to the nearest sample, as many tools do; has a floor of about half the sampling distance
};

struct CloudOptions {
  CloudAlignment align = CloudAlignment::kNone;
  SampleDistance distance = SampleDistance::kSurface;
  bool visible_only = true;         ///< completeness counts only visible samples, if the reference marks them
  double mesh_spacing_m = 0.01;     ///< a mesh is sampled this densely for completeness
  double icp_max_distance_m = 0.3;  ///< farthest pairs ICP starts with
  double icp_trim = 0.8;            ///< share of the pairs ICP keeps, the nearest ones
  WallThicknessOptions wall;
  WallPlanesOptions planes;
  void declare(core::OptionTable& table);  ///< wall options as wall_patch, wall_cell, ...
};

/// The estimated path of one robot in the cloud's frame and its truth in the reference's frame.
struct TrajectoryPair {
  geometry::Trajectory estimate;
  geometry::Trajectory truth;
};

/// At one distance threshold; 1 micrometre of slack, for distances that lie on the threshold.
struct ThresholdScore {
  double threshold_mm = 0.0;
  double precision = 0.0;  ///< share of cloud points this near to the reference, [0, 1]
  double recall = 0.0;     ///< share of counted reference samples this near to the cloud, [0, 1]
  double f = 0.0;          ///< 2 p r / (p + r)
};

struct CloudAlignmentReport {
  CloudAlignment align = CloudAlignment::kNone;
  geometry::Rigid3 reference_from_cloud;
  std::size_t trajectory_poses = 0;  ///< matched poses behind the start, 0: none were given
  double trajectory_rmse_m = 0.0;
  int icp_iterations = 0;
  double icp_rmse_mm = 0.0;  ///< point to plane, of the pairs kept
  double icp_overlap = 0.0;  ///< share of cloud points with a partner in reach at the end
  bool icp_converged = false;
  bool failed = false;  ///< so few partners that the numbers are not to be trusted
};

struct CloudReport {
  bool has_reference = false;
  std::size_t points = 0;            ///< finite points of the cloud
  std::size_t not_finite = 0;        ///< dropped
  std::size_t reference_points = 0;  ///< reference samples that count for completeness
  std::size_t reference_hidden = 0;  ///< left out: no camera could see them
  bool visibility_used = false;
  Statistics accuracy_mm;          ///< cloud -> surface
  Statistics completeness_mm;      ///< surface -> cloud
  std::vector<ThresholdScore> at;  ///< 5, 10, 20 and 50 mm
  /// Mean |cos| between the normals of a point and its nearest, over both directions and pairs within 50 mm;
  /// only if the cloud has normals.
  std::optional<double> normal_consistency;
  WallThickness wall;
  std::vector<WallPlane> planes;  ///< the largest, largest first
  double density_per_m2 = 0.0;    ///< median of 16 / (pi r16^2), r16 the distance to the 16th neighbour
  double spacing_mm = 0.0;        ///< median distance to the nearest neighbour
  CloudAlignmentReport alignment;
  /// Per point of the cloud as given, NaN where dropped; empty without reference.
  std::vector<float> error_m;
  std::vector<Eigen::Vector3f> reference_samples;  ///< samples at which completeness was measured
  std::vector<Eigen::Vector3f> reference_normals;  ///< normal at each of them, zero = unknown; may be empty
  std::vector<float> reference_error_m;            ///< error at each of them
  std::vector<std::string> warnings;
};

/// `reference` null: wall thickness and density only. `trajectories`: where alignment starts; may be empty.
/// Trajectories, planes and alignment are in the coordinates of the files, `reference_samples` less the
/// reference's shift. Same bytes for any number of threads. Errors (kInput): no finite point in the cloud, a
/// reference without points, or with points that are not finite, or of which none was visible; shifts that
/// no trajectory bridges. kUsage: an option out of range.
core::Result<CloudReport> evaluate_cloud(const SurfaceSamples& cloud, const Reference* reference,
                                         const CloudOptions& options,
                                         const std::vector<TrajectoryPair>& trajectories,
                                         const core::Executor& executor);

/// One JSON object: accuracy_mm, completeness_mm {mean, median, rmse, p90, ...}, at {"10mm": {precision,
/// recall, f}}, normal_consistency, wall_thickness_mm {rms, ...}, density, points, reference_points,
/// alignment.
std::string to_json(const CloudReport& report);
/// A table for people, several lines.
std::string to_text(const CloudReport& report);

}  // namespace plumbline::evaluate
