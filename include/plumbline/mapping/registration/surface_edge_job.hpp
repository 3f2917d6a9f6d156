// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Surface edges of a new keyframe (surface_edge.hpp), measured beside the tracker. All inputs are copied when
// the keyframe is made, so that the edges do not depend on the time of the work.
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/mapping/registration/surface_edge.hpp"

namespace plumbline::mapping {

/// Surface and image data of the new keyframe.
struct NewestSurface {
  core::KeyframeId keyframe;
  cv::Mat depth;                                            ///< CV_32FC1, metres
  geometry::Rigid3 depth_from_camera;                       ///< see align_surface_edge
  std::shared_ptr<const features::PhotometricImage> image;  ///< null: grey values are not aligned
};

/// One neighbour as a candidate for alignment.
struct NeighbourSurface {
  const maps::Keyframe* keyframe = nullptr;  ///< must stay in its map until the edges are taken
  geometry::Rigid3 newest_from_keyframe;
  std::shared_ptr<const features::PhotometricSamples> grey;  ///< null: none are known
};

class SurfaceEdgeJob {
 public:
  /// Begins to align `newest` with its neighbours, in their order, until `most` edges were found.
  SurfaceEdgeJob(NewestSurface newest, std::vector<NeighbourSurface> neighbours, int most,
                 const sensor::Pinhole& camera, const SurfaceEdgeOptions& options,
                 const core::Executor& executor);

  [[nodiscard]] core::KeyframeId keyframe() const { return state_->newest.keyframe; }
  /// The edges; waits for them.
  [[nodiscard]] std::vector<maps::SurfaceEdge> take();

 private:
  struct State {
    NewestSurface newest;
    std::vector<NeighbourSurface> neighbours;
    int most = 0;
    sensor::Pinhole camera;
    SurfaceEdgeOptions options;
    std::vector<maps::SurfaceEdge> edges;
  };
  static void measure(State& state);

  std::unique_ptr<State> state_;
  core::Executor::Job job_;  ///< last: its destructor waits before the rest is destroyed
};

}  // namespace plumbline::mapping
