// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <utility>

#include "plumbline/features/measurement.hpp"
#include "plumbline/geometry/velocity.hpp"
#include "plumbline/mapping/adjustment/map_recalibration.hpp"
#include "plumbline/mapping/adjustment/observation_noise.hpp"
#include "plumbline/optimize/pose_graph.hpp"
#include "plumbline/optimize/pose_solver.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

constexpr std::size_t kLeastPoints = 12;  // fewer leave the pose as it was corrected

/// The landmarks that a frame saw, as the present camera measured them.
std::vector<optimize::PointTerm> terms_of(const maps::SeenPoints& seen, const maps::Map& map,
                                          const sensor::ImageModel& model, const Rigid3& camera_from_world,
                                          const geometry::Vector6d& velocity) {
  static const ObservationNoise noise;

  // The stored pixels are raw, so the rolling shutter is corrected in full. Depths are already corrected for
  // the delay that was assumed then, so only its change counts.
  const geometry::Vector6d shutter = model.camera().readout_s.value_or(0.0) * velocity;
  const double late_s = model.camera().depth_delay_s - seen.depth_delay_s;

  std::vector<optimize::PointTerm> terms;
  for (const maps::SeenPoint& s : seen.points) {
    const maps::MapPoint* point = map.find(s.point);
    if (point == nullptr) continue;

    const auto feature =
        features::feature_of({s.pixel.cast<double>(), static_cast<double>(s.depth)}, shutter, model);

    optimize::PointTerm term;
    term.world = point->position;
    term.pixel = feature.pixel;
    term.pixel_sigma = static_cast<double>(s.sigma_px);

    // The depth image was taken at another time, when the camera's motion had changed the depth of the point.
    if (feature.depth > 0.0) {
      const double rate = features::depth_rate(camera_from_world * point->position,
                                               camera_from_world.rotation * point->normal, velocity);
      term.depth = feature.depth - late_s * rate;
      term.depth_sigma = noise.depth_factor * sensor::depth_sigma(term.depth);
    }
    terms.push_back(term);
  }

  return terms;
}

/// A corrected pose is as uncertain as half of its correction, and never less than the noise.
optimize::PosePrior prior_of(const Rigid3& camera_from_world, const Rigid3& correction) {
  constexpr double kLeastSigma_m = 0.001;
  constexpr double kLeastSigma_rad = 0.0005;
  const geometry::Vector6d moved = geometry::log_se3(correction);
  const double sigma_m = std::max(kLeastSigma_m, 0.5 * moved.head<3>().norm());
  const double sigma_rad = std::max(kLeastSigma_rad, 0.5 * moved.tail<3>().norm());

  optimize::PosePrior prior;
  prior.camera_from_world = camera_from_world;
  prior.information.diagonal().head<3>().setConstant(1.0 / (sigma_m * sigma_m));
  prior.information.diagonal().tail<3>().setConstant(1.0 / (sigma_rad * sigma_rad));
  return prior;
}

/// Prior of the pose of a frame relative to its keyframe, from the landmarks that it saw and its
/// corrected pose.
optimize::GraphEdge belief_of(const maps::FramePose& frame, const Rigid3& before,
                              const sensor::ImageModel& model, const maps::Map& map,
                              const geometry::Vector6d& velocity) {
  const Rigid3& reference_from_world = map.camera_from_world(frame.reference);
  const Rigid3 start = frame.camera_from_reference * reference_from_world;

  optimize::PoseProblem problem;
  problem.camera = model.image();
  if (frame.seen != nullptr) problem.points = terms_of(*frame.seen, map, model, start, velocity);
  if (problem.points.size() < kLeastPoints) problem.points.clear();
  problem.prior = prior_of(start, frame.camera_from_reference * before.inverse());
  const optimize::PoseSummary solved = optimize::solve_pose(problem, start, {});

  optimize::GraphEdge belief;
  belief.b_from_a = solved.camera_from_world * reference_from_world.inverse();
  belief.information = solved.information + problem.prior->information;
  return belief;
}

/// The tracker's own step from the frame before, which is known better than either pose.
optimize::GraphEdge step_of(const maps::FramePose& frame) {
  constexpr double kLeastSigma_m = 0.0002;
  const double sigma_m = std::max(kLeastSigma_m, frame.step_sigma_m);
  optimize::GraphEdge step;
  step.b_from_a = *frame.camera_from_previous;
  step.information.diagonal().head<3>().setConstant(1.0 / (sigma_m * sigma_m));
  step.information.diagonal().tail<3>().setConstant(4.0 / (sigma_m * sigma_m));
  return step;
}

bool has_pose(const maps::FramePose& frame, const maps::Map& map) {
  return frame.tracked && map.has_keyframe(frame.reference);
}

/// Graph of the frames between fixed keyframes: priors relative to these, and the steps from frame to frame.
struct FrameChain {
  optimize::PoseGraph graph;
  std::vector<int> nodes;  ///< node of each frame; a frame that became a keyframe has that one's; -1: no pose
};

FrameChain chain_of(const std::vector<maps::FramePose>& frames, const maps::Map& map,
                    const std::vector<optimize::GraphEdge>& beliefs) {
  FrameChain chain;
  std::map<core::KeyframeId, int> keyframes;
  for (const core::KeyframeId id : map.keyframe_ids()) {
    keyframes[id] = static_cast<int>(chain.graph.poses.size());
    chain.graph.poses.push_back({map.camera_from_world(id), true});
  }

  const auto tie = [&chain](optimize::GraphEdge edge, int a, int b) {
    edge.a = a;
    edge.b = b;
    chain.graph.edges.push_back(edge);
  };

  int previous = -1;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    int node = has_pose(frames[i], map) ? keyframes.at(frames[i].reference) : -1;

    // Its prior relative to the keyframe.
    if (maps::is_between_keyframes(frames[i], map)) {
      const int keyframe = std::exchange(node, static_cast<int>(chain.graph.poses.size()));
      chain.graph.poses.push_back({beliefs[i].b_from_a * map.camera_from_world(frames[i].reference), false});
      tie(beliefs[i], keyframe, node);
    }

    // Its step from the previous frame.
    if (node >= 0 && previous >= 0 && node != previous && frames[i].camera_from_previous)
      tie(step_of(frames[i]), previous, node);
    chain.nodes.push_back(node);
    previous = node;
  }

  return chain;
}

}  // namespace

void solve_frames_again(const sensor::ImageModel& model, const maps::Map& map,
                        const std::vector<maps::FramePose>& before, const geometry::Trajectory& path_before,
                        const core::Executor& executor, std::vector<maps::FramePose>& frames) {
  // Each frame is first solved alone, against the landmarks, as a measurement relative to its keyframe.
  std::vector<optimize::GraphEdge> beliefs(frames.size());
  executor.parallel_for(frames.size(), [&](std::size_t i) {
    if (!maps::is_between_keyframes(frames[i], map)) return;
    beliefs[i] = belief_of(frames[i], before[i].camera_from_reference, model, map,
                           geometry::velocity_at(path_before, frames[i].stamp));
  });

  // The tracker's steps then connect neighbouring frames, so that the path stays
  // smooth where landmarks are few.
  FrameChain chain = chain_of(frames, map, beliefs);
  if (!optimize::solve_pose_graph(chain.graph, false).usable) return;

  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!maps::is_between_keyframes(frames[i], map)) continue;
    const auto node = static_cast<std::size_t>(chain.nodes[i]);
    frames[i].camera_from_reference =
        chain.graph.poses[node].camera_from_world * map.camera_from_world(frames[i].reference).inverse();
  }
}

}  // namespace plumbline::mapping
