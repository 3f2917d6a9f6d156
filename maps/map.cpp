// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/map.hpp"

#include <algorithm>
#include <stdexcept>
#include <type_traits>

#include "plumbline/core/release.hpp"

namespace plumbline::maps {
namespace {

/// Removes the observation by `keyframe`; its feature, or -1.
int take(std::vector<Observation>& observations, KeyframeId keyframe) {
  const auto found = std::find_if(observations.begin(), observations.end(),
                                  [&](const Observation& o) { return o.keyframe == keyframe; });
  if (found == observations.end()) return -1;
  const int feature = found->feature;
  observations.erase(found);
  return feature;
}

/// Elements that `of` gives for any of the keyframes, valid ids only; sorted, without repetition.
template <typename Id, typename Of>
std::vector<Id> of_any(const std::vector<KeyframeId>& keyframes, const Of& of) {
  std::vector<Id> ids;
  for (const KeyframeId keyframe : keyframes) {
    for (const Id id : of(keyframe)) {
      if (id.valid()) ids.push_back(id);
    }
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

}  // namespace

bool seen_by(const std::vector<Observation>& observations, KeyframeId keyframe) {
  return std::any_of(observations.begin(), observations.end(),
                     [&](const Observation& o) { return o.keyframe == keyframe; });
}

KeyframeId Map::next_keyframe_id(std::int32_t robot) const { return keyframes_.next_id(robot); }

KeyframeId Map::add_keyframe(std::shared_ptr<const Keyframe> keyframe,
                             const geometry::Rigid3& camera_from_world) {
  if (keyframe == nullptr || !keyframe->id.valid()) throw std::invalid_argument("add_keyframe: no id");
  const KeyframeId id = keyframe->id;

  // No feature observes a landmark yet
  KeyframeEntry entry;
  if (keyframe->features != nullptr) {
    entry.points.resize(keyframe->features->points.size());
    entry.lines.resize(keyframe->features->lines.size());
  }
  entry.data = std::move(keyframe);
  entry.pose = camera_from_world;
  keyframes_.insert(id, std::move(entry));

  // Patches serve only the most recent keyframes
  erase_patches({id.robot, id.index - kPatchedKeyframes});
  return id;
}

void Map::replace_keyframe(std::shared_ptr<const Keyframe> keyframe) {
  // Observations name features by their number
  KeyframeEntry& entry = keyframes_.at(keyframe->id);
  const auto counts = [](const Keyframe& k) {
    return k.features == nullptr ? std::pair<std::size_t, std::size_t>()
                                 : std::pair(k.features->points.size(), k.features->lines.size());
  };
  if (counts(*keyframe) != counts(*entry.data))
    throw std::invalid_argument("replace_keyframe: it has other features");
  entry.data = std::move(keyframe);
}

void Map::erase_patches(KeyframeId id) {
  // Features are shared with readers of older revisions
  if (!id.valid() || !keyframes_.contains(id)) return;
  std::shared_ptr<const Keyframe>& data = keyframes_.at(id).data;
  if (data->features == nullptr || data->features->patches.empty()) return;
  auto features = std::make_shared<features::FrameFeatures>(*data->features);
  core::release(features->patches);
  auto keyframe = std::make_shared<Keyframe>(*data);
  keyframe->features = std::move(features);
  data = std::move(keyframe);
}

void Map::set_pose(KeyframeId id, const geometry::Rigid3& camera_from_world) {
  keyframes_.at(id).pose = camera_from_world;
}

PointId Map::add_point(std::int32_t robot, MapPoint point) {
  point.id = points_.next_id(robot);
  point.observations.clear();
  const PointId id = point.id;
  points_.insert(id, std::move(point));
  return id;
}

LineId Map::add_line(std::int32_t robot, MapLine line) {
  line.id = lines_.next_id(robot);
  line.observations.clear();
  const LineId id = line.id;
  lines_.insert(id, std::move(line));
  return id;
}

template <typename Id>
void Map::remove(Id id) {
  if (!landmarks(id).contains(id)) return;
  const std::vector<Observation> observations = landmarks(id).at(id).observations;
  for (const Observation& o : observations) unobserve(id, o.keyframe);
  landmarks(id).erase(id);
}
template void Map::remove(PointId id);
template void Map::remove(LineId id);

template <typename Id>
void Map::merge(Id kept, Id gone) {
  if (kept == gone) throw std::invalid_argument("merge: both are one landmark");
  auto& k = landmarks(kept).at(kept);

  // A copy: its observations outlive the landmark
  const auto g = landmarks(gone).at(gone);
  k.visible += g.visible;
  k.found += g.found;
  remove(gone);
  for (const Observation& o : g.observations) observe(kept, o.keyframe, o.feature);

  // Descriptor and direction from all observations
  if constexpr (std::is_same_v<Id, PointId>) {
    if (k.normal.isZero()) k.normal = g.normal;
    refresh_point(kept);
  }
}
template void Map::merge(PointId kept, PointId gone);
template void Map::merge(LineId kept, LineId gone);

/// Adds `change` to the counts of covisible landmarks, on both sides.
void Map::share(const std::vector<Observation>& others, KeyframeId keyframe, int change) {
  KeyframeEntry& entry = keyframes_.at(keyframe);
  for (const Observation& o : others) {
    if (o.keyframe == keyframe) continue;
    KeyframeEntry& other = keyframes_.at(o.keyframe);
    const int shared = (entry.shared[o.keyframe] += change);
    other.shared[keyframe] = shared;
    if (shared == 0) {
      entry.shared.erase(o.keyframe);
      other.shared.erase(keyframe);
    }
  }
}

/// One observation per landmark and keyframe, one landmark per feature.
template <typename Id>
bool Map::observe(Id id, KeyframeId keyframe, int feature, bool aligned) {
  std::vector<Observation>& observations = landmarks(id).at(id).observations;
  Id& slot = keyframes_.at(keyframe).seen(id).at(static_cast<std::size_t>(feature));
  if (slot.valid() || seen_by(observations, keyframe)) return false;
  share(observations, keyframe, +1);
  observations.push_back({keyframe, feature, aligned});
  slot = id;
  return true;
}
template bool Map::observe(PointId id, KeyframeId keyframe, int feature, bool aligned);
template bool Map::observe(LineId id, KeyframeId keyframe, int feature, bool aligned);

/// The inverse of observe(): feature, observation and covisibility.
template <typename Id>
void Map::unobserve(Id id, KeyframeId keyframe) {
  std::vector<Observation>& observations = landmarks(id).at(id).observations;
  const int feature = take(observations, keyframe);
  if (feature < 0) return;
  keyframes_.at(keyframe).seen(id)[static_cast<std::size_t>(feature)] = Id{};
  share(observations, keyframe, -1);
}
template void Map::unobserve(PointId id, KeyframeId keyframe);
template void Map::unobserve(LineId id, KeyframeId keyframe);

PointId Map::point_of(KeyframeId keyframe, int feature) const {
  return keyframes_.at(keyframe).points.at(static_cast<std::size_t>(feature));
}
LineId Map::line_of(KeyframeId keyframe, int feature) const {
  return keyframes_.at(keyframe).lines.at(static_cast<std::size_t>(feature));
}
const std::vector<PointId>& Map::points_of(KeyframeId keyframe) const {
  return keyframes_.at(keyframe).points;
}
const std::vector<LineId>& Map::lines_of(KeyframeId keyframe) const { return keyframes_.at(keyframe).lines; }

std::vector<PointId> Map::points_seen_by(const std::vector<KeyframeId>& keyframes) const {
  return of_any<PointId>(
      keyframes, [&](KeyframeId id) -> const auto& { return points_of(id); });
}
std::vector<LineId> Map::lines_seen_by(const std::vector<KeyframeId>& keyframes) const {
  return of_any<LineId>(
      keyframes, [&](KeyframeId id) -> const auto& { return lines_of(id); });
}

/// Neighbours in the covisibility graph, strongest first.
std::vector<std::pair<KeyframeId, int>> Map::covisible(KeyframeId keyframe, int min_shared) const {
  const auto& shared = keyframes_.at(keyframe).shared;
  std::vector<std::pair<KeyframeId, int>> result(shared.begin(), shared.end());
  std::stable_sort(result.begin(), result.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });

  // The strongest neighbour is kept even below the threshold
  if (result.empty()) return result;
  const int threshold = std::min(min_shared, result.front().second);
  while (result.back().second < threshold) result.pop_back();
  return result;
}

/// The `count` strongest neighbours above the usual threshold.
std::vector<KeyframeId> Map::neighbours(KeyframeId keyframe, std::size_t count) const {
  std::vector<KeyframeId> result;
  if (!has_keyframe(keyframe)) return result;
  for (const auto& [id, shared] : covisible(keyframe, kCovisible)) {
    if (result.size() < count) result.push_back(id);
  }
  return result;
}

int Map::shared(KeyframeId a, KeyframeId b) const {
  const auto& shared = keyframes_.at(a).shared;
  const auto found = shared.find(b);
  return found == shared.end() ? 0 : found->second;
}

void Map::add_edge(const SurfaceEdge& edge) {
  // Both ends share the constraint's number
  if (edge.a == edge.b) throw std::invalid_argument("add_edge: both ends are one keyframe");
  KeyframeEntry& a = keyframes_.at(edge.a);  // both must be there before either is changed
  KeyframeEntry& b = keyframes_.at(edge.b);
  a.edges.push_back(next_edge_);
  b.edges.push_back(next_edge_);
  edges_.emplace(next_edge_++, edge);
}

void Map::replace_edge(std::uint64_t number, const SurfaceEdge& edge) {
  SurfaceEdge& known = edges_.at(number);
  if (known.a != edge.a || known.b != edge.b)
    throw std::invalid_argument("replace_edge: it lies between other keyframes");
  known = edge;
}

void Map::set_loops(std::vector<LoopEdge> loops) {
  for (const LoopEdge& loop : loops) {
    if (loop.a == loop.b) throw std::invalid_argument("set_loops: both ends are one keyframe");
    if (!has_keyframe(loop.a) || !has_keyframe(loop.b))
      throw std::out_of_range("set_loops: no such keyframe");
  }
  loops_ = std::move(loops);
}

std::vector<SurfaceEdge> Map::edges_of(KeyframeId keyframe) const {
  std::vector<SurfaceEdge> result;
  for (std::uint64_t i : keyframes_.at(keyframe).edges) result.push_back(edges_.at(i));
  return result;
}

void Map::refresh_point(PointId id) {
  MapPoint& p = points_.at(id);
  if (p.observations.empty()) return;

  // Mean viewing direction of the observers
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  std::vector<const features::Descriptor256*> descriptors;  // by observation
  for (const Observation& o : p.observations) {
    const KeyframeEntry& entry = keyframes_.at(o.keyframe);
    direction += (p.position - entry.pose.inverse().translation).normalized();
    descriptors.push_back(&entry.data->features->descriptors[static_cast<std::size_t>(o.feature)]);
  }

  if (direction.norm() > 1e-9) p.view_direction = direction.normalized();
  // The descriptor with the least sum of distances to the others.
  int best_sum = -1;
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    const auto* candidate = descriptors[i];
    int sum = 0;
    for (const auto* other : descriptors) sum += features::hamming_distance(*candidate, *other);

    if (best_sum < 0 || sum < best_sum) {
      best_sum = sum;
      p.descriptor = *candidate;
      const Observation& o = p.observations[i];
      p.angle = keyframes_.at(o.keyframe).data->features->points[static_cast<std::size_t>(o.feature)].angle;
      p.angle_keyframe = o.keyframe;
    }
  }
}

}  // namespace plumbline::maps
