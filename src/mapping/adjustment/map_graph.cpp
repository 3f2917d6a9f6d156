// SPDX-License-Identifier: BSD-3-Clause
// Pose graph of a map, and what moves when keyframes do.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "plumbline/geometry/adjoint.hpp"
#include "plumbline/mapping/adjustment/global_adjustment.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Matrix6d;
using geometry::Rigid3;

// Accuracy of relative poses in the map: of keyframes that share many landmarks (with fewer it grows with the
// root), and of consecutive keyframes, which the tracker has seen through. Generous: errors of neighbours are
// alike and add up to drift, which a loop must be allowed to take out.
constexpr double kSigma_m = 0.015;
constexpr double kSigma_rad = 0.01;
constexpr double kMany = 100.0;  // landmarks
constexpr double kNextSigma_m = 0.02;
constexpr double kNextSigma_rad = 0.015;

Matrix6d information_of_shared(int shared) {
  const double grown = std::sqrt(std::max(1.0, kMany / std::max(1, shared)));
  return geometry::information_of(grown * kSigma_m, grown * kSigma_rad);
}

/// Collects edges between pairs of keyframes, each pair once, as the map has them now.
class EdgeCollector {
 public:
  explicit EdgeCollector(const maps::Map& map) : map_(map) {}
  void add(KeyframeId a, KeyframeId b, const Matrix6d& information) {
    if (b < a) std::swap(a, b);
    const auto [found, inserted] = edges_.try_emplace({a, b});
    PoseEdge& edge = found->second;
    if (inserted) {
      edge = {a, b, map_.camera_from_world(b) * map_.camera_from_world(a).inverse(), Matrix6d::Zero(), true};
    }
    if (information.trace() > edge.information.trace()) edge.information = information;
  }
  [[nodiscard]] std::vector<PoseEdge> take() {
    std::vector<PoseEdge> result;
    for (const auto& [pair, edge] : edges_) result.push_back(edge);
    return result;
  }

 private:
  const maps::Map& map_;
  std::map<std::pair<KeyframeId, KeyframeId>, PoseEdge> edges_;
};

/// Covariance of b_from_a if the errors from one keyframe to the next, from `a` to `b`, were independent.
/// `steps`: receives their number.
Matrix6d covariance_of_path(const maps::Map& map, const std::vector<KeyframeId>& ids, KeyframeId a,
                            KeyframeId b, int& steps) {
  // Smaller than that of one edge, because several edges constrain each keyframe.
  const Matrix6d step = geometry::information_of(0.5 * kSigma_m, 0.5 * kSigma_rad).inverse();
  Matrix6d sum = Matrix6d::Zero();
  steps = 0;
  const Rigid3& b_from_world = map.camera_from_world(b);
  for (auto id = std::upper_bound(ids.begin(), ids.end(), a); id != ids.end() && !(b < *id); ++id) {
    if (id->robot != a.robot) continue;
    const Matrix6d carry = geometry::adjoint(b_from_world * map.camera_from_world(*id).inverse());
    sum += carry * step * carry.transpose();
    ++steps;
  }
  return sum;
}

/// Disagreement between an edge from elsewhere and the path that joins its two ends in the map.
struct Discrepancy {
  bool known = false;                ///< both ends of one robot, and the edge may be wrong
  geometry::Vector6d error;          ///< as seen from the later keyframe
  Matrix6d own = Matrix6d::Zero();   ///< covariance of the edge
  Matrix6d path = Matrix6d::Zero();  ///< covariance of the path if its errors were independent
  int steps = 0;
  [[nodiscard]] double chi2(double factor) const {
    return error.dot((own + factor * path).ldlt().solve(error));
  }
};

Discrepancy discrepancy(const maps::Map& map, const std::vector<KeyframeId>& ids, const PoseEdge& e) {
  Discrepancy d;
  d.known = !e.trusted && e.a.robot == e.b.robot;
  if (!d.known) return d;
  const Rigid3 b_from_a = map.camera_from_world(e.b) * map.camera_from_world(e.a).inverse();
  Rigid3 error = b_from_a * e.b_from_a.inverse();
  d.own = (e.information + 1e-6 * Matrix6d::Identity()).inverse();
  if (e.b < e.a) {
    error = b_from_a.inverse() * e.b_from_a;
    const Matrix6d carry = geometry::adjoint(b_from_a.inverse());
    d.own = carry * d.own * carry.transpose();
  }
  d.error = geometry::log_se3(error);
  d.path = covariance_of_path(map, ids, std::min(e.a, e.b), std::max(e.a, e.b), d.steps);
  return d;
}

/// Factor by which the covariance of the map's own edges must grow to explain the measured edges. Errors of
/// neighbours are correlated, so drift grows with the path rather than with its root: if all are equal the
/// variance after n steps is n times that of independent ones. The median over the measured edges is used, so
/// that wrong ones do not decide it.
double drift_factor(const std::vector<Discrepancy>& discrepancies) {
  std::vector<double> factors;
  for (const Discrepancy& d : discrepancies) {
    if (d.known) factors.push_back(std::clamp(d.chi2(1.0) / 6.0, 1.0, std::max(1.0, 1.0 * d.steps)));
  }
  if (factors.empty()) return 1.0;
  const auto middle = factors.begin() + static_cast<std::ptrdiff_t>((factors.size() - 1) / 2);
  std::nth_element(factors.begin(), middle, factors.end());
  return *middle;
}

/// Edges from elsewhere that stay out of the graph: an edge that no drift explains would tear it before the
/// others could show that it is wrong.
struct Gating {
  double drift_factor = 1.0;
  std::vector<double> chi2;   ///< of each edge; 0: there is nothing to compare it with
  std::vector<bool> refused;  ///< by edge
};

Gating gate_edges(const maps::Map& map, const std::vector<KeyframeId>& ids,
                  const std::vector<PoseEdge>& extra, bool robust) {
  std::vector<Discrepancy> discrepancies;
  for (const PoseEdge& e : extra) {
    if (!map.has_keyframe(e.a) || !map.has_keyframe(e.b))
      throw std::out_of_range("solve_map_graph: no such keyframe");
    discrepancies.push_back(discrepancy(map, ids, e));
  }
  Gating result;
  result.drift_factor = drift_factor(discrepancies);
  const double gate = optimize::chi_square_gate(6);
  for (const Discrepancy& d : discrepancies) {
    result.chi2.push_back(d.known ? d.chi2(result.drift_factor) : 0.0);
    result.refused.push_back(robust && result.chi2.back() > gate);
  }
  return result;
}

/// The summary has verdicts on the edges in the graph, those from elsewhere first: it gets them on all from
/// elsewhere.
void add_verdicts(const Gating& gating, optimize::PoseGraphSummary& summary) {
  std::vector<optimize::EdgeVerdict> verdicts(gating.refused.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    if (gating.refused[i]) {
      verdicts[i] = {gating.chi2[i], 6, 0.0, true};
      ++summary.rejected;
    } else if (!summary.edges.empty()) {
      verdicts[i] = summary.edges[next++];
    }
  }
  summary.edges = std::move(verdicts);
}

/// A pose graph of a map's keyframes, by id.
class GraphBuilder {
 public:
  GraphBuilder(const maps::Map& map, KeyframeId anchor) : ids_(map.keyframe_ids()) {
    for (const KeyframeId id : ids_) {
      index_[id] = static_cast<int>(graph_.poses.size());
      graph_.poses.push_back({map.camera_from_world(id), id == anchor});
    }
  }
  void add(const PoseEdge& e, const Matrix6d& information) {
    graph_.edges.push_back({index_.at(e.a), index_.at(e.b), e.b_from_a, information, e.trusted});
  }
  [[nodiscard]] optimize::PoseGraph& graph() { return graph_; }
  [[nodiscard]] KeyframePoses poses() const {
    KeyframePoses poses;
    for (std::size_t i = 0; i < ids_.size(); ++i)
      poses.emplace_back(ids_[i], graph_.poses[i].camera_from_world);
    return poses;
  }

 private:
  std::vector<KeyframeId> ids_;
  std::map<KeyframeId, int> index_;
  optimize::PoseGraph graph_;
};

/// Mean of the positions to which a landmark's keyframes would move it.
Eigen::Vector3d carried(const Eigen::Vector3d& p, const std::vector<maps::Observation>& seen,
                        const std::map<KeyframeId, Rigid3>& new_from_old) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const maps::Observation& o : seen) {
    const auto found = new_from_old.find(o.keyframe);
    sum += found == new_from_old.end() ? p : found->second * p;
  }
  return sum / static_cast<double>(seen.size());
}

}  // namespace

std::vector<PoseEdge> map_edges(const maps::Map& map, int min_shared, int max_neighbours) {
  EdgeCollector edges(map);
  KeyframeId last;
  for (const KeyframeId id : map.keyframe_ids()) {
    // The first keyframe of a component was not tracked from the one before it, so
    // their relative pose is unknown.
    const bool begins_component = !map.parent(id).valid();
    if (last.valid() && last.robot == id.robot && !begins_component) {
      edges.add(last, id, geometry::information_of(kNextSigma_m, kNextSigma_rad));
    }

    last = id;

    // Edges to the strongest covisible neighbours preserve the shape that earlier adjustments gave the map.
    int neighbours = 0;
    for (const auto& [other, shared] : map.covisible(id, min_shared)) {
      if (shared < min_shared || ++neighbours > max_neighbours) break;
      edges.add(id, other, information_of_shared(shared));
    }

    // Aligned surfaces relate keyframes that share too few landmarks, such as in rooms without texture.
    for (const maps::SurfaceEdge& edge : map.edges_of(id)) {
      if (edge.b == id) edges.add(edge.a, id, geometry::information_of(kNextSigma_m, kNextSigma_rad));
    }
  }

  return edges.take();
}

Matrix6d path_covariance(const maps::Map& map, KeyframeId a, KeyframeId b) {
  if (b < a) {
    const Matrix6d carry = geometry::adjoint(map.camera_from_world(b) * map.camera_from_world(a).inverse());
    return carry * path_covariance(map, b, a) * carry.transpose();
  }
  int steps = 0;
  return covariance_of_path(map, map.keyframe_ids(), a, b, steps);
}

std::vector<PoseEdge> loop_edges(const maps::Map& map) {
  std::vector<PoseEdge> edges;
  for (const maps::LoopEdge& loop : map.loops()) {
    edges.push_back({loop.a, loop.b, loop.b_from_a, loop.information, false});
  }
  return edges;
}

void set_loops(maps::Map& map, const std::vector<PoseEdge>& edges) {
  std::vector<maps::LoopEdge> loops;
  for (const PoseEdge& e : edges) loops.push_back({e.a, e.b, e.b_from_a, e.information});
  map.set_loops(std::move(loops));
}

KeyframePoses solve_trusted_graph(const maps::Map& map, const std::vector<PoseEdge>& edges) {
  GraphBuilder graph(map, map.keyframe_ids().front());
  for (const PoseEdge& e : edges) graph.add(e, e.information);
  if (!optimize::solve_pose_graph(graph.graph(), false).usable) return {};
  return graph.poses();
}

MapGraphResult solve_map_graph(const maps::Map& map, const std::vector<PoseEdge>& extra, bool robust,
                               KeyframeId anchor) {
  MapGraphResult result;
  const std::vector<KeyframeId> ids = map.keyframe_ids();
  if (ids.empty()) {
    result.summary.message = "the map is empty";
    return result;
  }

  if (!anchor.valid()) anchor = ids.front();
  GraphBuilder graph(map, anchor);

  // Edges that no drift explains are left out beforehand: they would tear the graph before the others
  // could show that they are wrong.
  const Gating gating = gate_edges(map, ids, extra, robust);
  for (std::size_t i = 0; i < extra.size(); ++i) {
    if (!gating.refused[i]) graph.add(extra[i], extra[i].information);
  }

  // The map's own edges are loosened until they allow for the measured drift; rigid ones
  // would prevent loops from closing.
  for (const PoseEdge& e : map_edges(map)) graph.add(e, e.information / gating.drift_factor);
  result.summary = optimize::solve_pose_graph(graph.graph(), robust);
  add_verdicts(gating, result.summary);
  result.poses = graph.poses();
  return result;
}

void move_keyframes(maps::Map& map, const KeyframePoses& poses) {
  std::map<KeyframeId, Rigid3> new_from_old;
  for (const auto& [id, pose] : poses) {
    new_from_old[id] = pose.inverse() * map.camera_from_world(id);
    map.set_pose(id, pose);
  }
  for (const core::PointId id : map.point_ids()) {
    maps::MapPoint& point = map.point(id);
    if (!point.observations.empty())
      point.position = carried(point.position, point.observations, new_from_old);
  }
  for (const core::LineId id : map.line_ids()) {
    maps::MapLine& line = map.line(id);
    if (line.observations.empty()) continue;
    line.start = carried(line.start, line.observations, new_from_old);
    line.end = carried(line.end, line.observations, new_from_old);
  }
}

}  // namespace plumbline::mapping
