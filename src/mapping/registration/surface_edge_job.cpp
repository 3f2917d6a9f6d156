// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/registration/surface_edge_job.hpp"

#include <utility>

namespace plumbline::mapping {

SurfaceEdgeJob::SurfaceEdgeJob(NewestSurface newest, std::vector<NeighbourSurface> neighbours, int most,
                               const sensor::Pinhole& camera, const SurfaceEdgeOptions& options,
                               const core::Executor& executor)
    : state_(std::make_unique<State>(
          State{std::move(newest), std::move(neighbours), most, camera, options, {}})),
      job_(executor.submit([state = state_.get()] { measure(*state); })) {}

void SurfaceEdgeJob::measure(State& state) {
  const NewestSurface& newest = state.newest;
  for (const NeighbourSurface& neighbour : state.neighbours) {
    if (static_cast<int>(state.edges.size()) >= state.most) break;
    const auto edge = align_surface_edge(
        *neighbour.keyframe, newest.keyframe, newest.depth, neighbour.newest_from_keyframe,
        newest.depth_from_camera, state.camera, state.options, {neighbour.grey.get(), newest.image.get()});
    if (edge) state.edges.push_back(*edge);
  }
}

std::vector<maps::SurfaceEdge> SurfaceEdgeJob::take() {
  job_.wait();
  return std::move(state_->edges);
}

}  // namespace plumbline::mapping
