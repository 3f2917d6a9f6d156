// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The map itself: keyframes, point and line landmarks, their observations and covisibility. Data and its
// rules; estimation lives elsewhere. One writer at a time; a const Map may be read by many threads.
#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "plumbline/core/ids.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/id_map.hpp"

namespace plumbline::maps {

using core::KeyframeId;
using core::LineId;
using core::PointId;

/// Smallest number of landmarks that covisible keyframes share (section 3.3 of the paper).
constexpr int kCovisible = 20;

/// A piece of surface that a keyframe's depth image measured, in the keyframe's camera frame.
struct SurfaceSample {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();    ///< metres
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, towards the camera
  float sigma = 0.01F;                                ///< metres, along the normal
};

/// Measurements of a keyframe; they never change after creation, except that old patches are
/// dropped (kPatchedKeyframes).
struct Keyframe {
  KeyframeId id;
  std::int64_t frame_index = -1;
  double stamp = 0.0;      ///< seconds
  double turn_rate = 0.0;  ///< rad/s: how fast the camera turned; 0 when it takes all rows at once: no shear
  /// The keyframe that the tracker followed when this one was made (invalid: it began a map), and the
  /// relative pose that the tracker measured.
  KeyframeId reference;
  geometry::Rigid3 camera_from_reference;
  /// Standard deviation of that where it is known worst; half as much in radians.
  double reference_sigma_m = 0.0;
  std::shared_ptr<const features::FrameFeatures> features;
  std::vector<SurfaceSample> surface;  ///< well spread over directions and over the image
};

/// Feature `feature` of keyframe `keyframe`.
struct Observation {
  KeyframeId keyframe;
  int feature : 31;
  /// True if the feature's pixel is that of the landmark's own point, to about a tenth of a pixel (its first
  /// feature, and those that were aligned with its patch); false if it is just some corner there.
  bool aligned : 1;
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
  Observation(KeyframeId by = {}, int number = -1, bool is_aligned = false)
      : keyframe(by), feature(number), aligned(is_aligned) {}
#pragma GCC diagnostic pop
};
static_assert(sizeof(Observation) == 12, "a map has thousands of them for each keyframe");

/// True if one of the observations is this keyframe's.
bool seen_by(const std::vector<Observation>& observations, KeyframeId keyframe);

/// Number of keyframes of each robot, the newest ones, that keep the patches of their corners.
constexpr int kPatchedKeyframes = 200;

struct MapPoint {
  PointId id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world, metres
  features::Descriptor256 descriptor{};                ///< the most typical of its observations
  float angle = 0.0F;                                  ///< of that observation, degrees in its image
  KeyframeId angle_keyframe;                           ///< keyframe in whose image the angle was measured
  int reference_octave = 0;                            ///< octave of its first observation
  Eigen::Vector3d view_direction = Eigen::Vector3d::UnitZ();  ///< mean direction from the cameras to it, unit
  /// Normal of the surface it lies on, towards the camera that measured it; world, unit; zero: unknown.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double reference_distance = 1.0;  ///< metres from the camera of its first observation
  std::vector<Observation> observations;
  int visible = 0;  ///< frames whose view contained it
  int found = 0;    ///< frames that matched it
};

struct MapLine {
  LineId id;
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< world, metres
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  features::LineDescriptor descriptor{};
  std::vector<Observation> observations;
  int visible = 0;
  int found = 0;
};

/// Relative pose of two keyframes. The information is of xi = log(b_from_a_estimate * b_from_a^-1).
struct KeyframeEdge {
  KeyframeId a;
  KeyframeId b;
  geometry::Rigid3 b_from_a;
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
};
/// Edge from the alignment of their surfaces; singular where these do not constrain all directions.
using SurfaceEdge = KeyframeEdge;
/// A place that was seen again, according to its landmarks.
using LoopEdge = KeyframeEdge;

/// The next ids, for each robot that has or had such objects.
struct NextIds {
  std::vector<KeyframeId> keyframes;
  std::vector<PointId> points;
  std::vector<LineId> lines;
  std::uint64_t edge = 0;
};

/// Revision of a map, to find out later what has changed since. The default is before anything was added.
struct MapRevision {
  std::uint64_t points = 0;
  std::uint64_t lines = 0;
  std::uint64_t edges = 0;
};

/// Landmarks whose ids share a page of IdMap; all that exist, possibly none.
template <typename Landmark>
struct LandmarkPage {
  std::int32_t robot = 0;
  std::int32_t page = 0;
  std::vector<Landmark> landmarks;  ///< by id
};

/// Parts of a map; everything else (covisibility, children) follows from them. For stores.
struct MapParts {
  struct KeyframePart {
    std::shared_ptr<const Keyframe> data;
    geometry::Rigid3 camera_from_world;
    KeyframeId parent;  ///< invalid: a root
  };
  std::vector<KeyframePart> keyframes;
  std::vector<MapPoint> points;  ///< with ids and observations, as all here
  std::vector<MapLine> lines;
  std::vector<std::pair<std::uint64_t, SurfaceEdge>> edges;  ///< by order of creation
  std::vector<LoopEdge> loops;
  NextIds next;
};

/// Changes of a map since an earlier revision, for a copy that follows the map at a cost that depends on the
/// changes only.
struct MapChanges {
  bool whole = false;                             ///< since before anything was there
  std::vector<MapParts::KeyframePart> keyframes;  ///< all of them: poses move
  std::vector<LandmarkPage<MapPoint>> points;     ///< pages that were touched
  std::vector<LandmarkPage<MapLine>> lines;
  std::vector<std::pair<std::uint64_t, std::int32_t>> edge_names;  ///< all: number and robot of a
  std::vector<std::pair<std::uint64_t, SurfaceEdge>> edges;        ///< new ones
  std::vector<LoopEdge> loops;                                     ///< all
  std::size_t point_count = 0;
  std::size_t line_count = 0;
  NextIds next;
};

class Map {
 public:
  Map() = default;
  /// The map that had these parts, with all its ids and orders. Throws std::invalid_argument if they
  /// contradict each other: a repeated id, a reference to something missing, two landmarks of one feature.
  explicit Map(MapParts parts);
  [[nodiscard]] NextIds next_ids() const;
  [[nodiscard]] MapRevision now() const { return {points_.revision(), lines_.revision(), next_edge_}; }
  [[nodiscard]] MapChanges changes_since(const MapRevision& revision) const;

  // Keyframes. camera_from_world of each is an estimate that set_pose replaces.
  KeyframeId add_keyframe(std::shared_ptr<const Keyframe> keyframe,
                          const geometry::Rigid3& camera_from_world);
  /// Replaces the keyframe with the same id by one that was recomputed from the same measurements: as many
  /// features, in the same order (else std::invalid_argument).
  void replace_keyframe(std::shared_ptr<const Keyframe> keyframe);
  [[nodiscard]] KeyframeId next_keyframe_id(std::int32_t robot) const;
  [[nodiscard]] bool has_keyframe(KeyframeId id) const { return keyframes_.contains(id); }
  [[nodiscard]] const Keyframe& keyframe(KeyframeId id) const { return *keyframes_.at(id).data; }
  [[nodiscard]] const geometry::Rigid3& camera_from_world(KeyframeId id) const {
    return keyframes_.at(id).pose;
  }
  void set_pose(KeyframeId id, const geometry::Rigid3& camera_from_world);
  [[nodiscard]] std::vector<KeyframeId> keyframe_ids() const { return keyframes_.ids(); }
  [[nodiscard]] std::size_t keyframe_count() const { return keyframes_.size(); }

  // Spanning tree: the parent of every keyframe but a root shared much with it when it was made. Attaches a
  // new keyframe to the one that shares most with it; if none does, to the robot's previous one.
  void attach(KeyframeId id);
  void detach(KeyframeId child);                         ///< makes it the root of a component
  void set_parent(KeyframeId child, KeyframeId parent);  ///< std::invalid_argument: would be a cycle
  [[nodiscard]] KeyframeId parent(KeyframeId id) const {
    return keyframes_.at(id).parent;
  }  ///< invalid: root
  [[nodiscard]] const std::vector<KeyframeId>& children(KeyframeId id) const {
    return keyframes_.at(id).children;
  }

  // Landmarks: an Id is a PointId or a LineId.
  PointId add_point(std::int32_t robot, MapPoint point);
  LineId add_line(std::int32_t robot, MapLine line);
  template <typename Id>
  void remove(Id id);
  /// Two landmarks that are one: `kept` takes the observations and counts of `gone`, which is removed. Where
  /// one keyframe sees both, the feature of `kept` stays. The caller sets the position. Throws
  /// std::invalid_argument when both are the same.
  template <typename Id>
  void merge(Id kept, Id gone);
  [[nodiscard]] const MapPoint* find(PointId id) const { return points_.find(id); }
  [[nodiscard]] const MapLine* find(LineId id) const { return lines_.find(id); }
  [[nodiscard]] MapPoint& point(PointId id) { return points_.at(id); }
  [[nodiscard]] MapLine& line(LineId id) { return lines_.at(id); }
  [[nodiscard]] const MapPoint& point(PointId id) const { return points_.at(id); }
  [[nodiscard]] const MapLine& line(LineId id) const { return lines_.at(id); }
  [[nodiscard]] std::vector<PointId> point_ids() const { return points_.ids(); }
  [[nodiscard]] std::vector<LineId> line_ids() const { return lines_.ids(); }
  [[nodiscard]] std::size_t point_count() const { return points_.size(); }
  [[nodiscard]] std::size_t line_count() const { return lines_.size(); }

  // Observations. A feature sees at most one landmark; a keyframe sees a landmark with at most one feature:
  // observe returns false and changes nothing otherwise.
  template <typename Id>
  bool observe(Id id, KeyframeId keyframe, int feature, bool aligned = false);
  template <typename Id>
  void unobserve(Id id, KeyframeId keyframe);
  /// Landmark that a keyframe's feature sees; an invalid id: none.
  [[nodiscard]] PointId point_of(KeyframeId keyframe, int feature) const;
  [[nodiscard]] LineId line_of(KeyframeId keyframe, int feature) const;
  [[nodiscard]] const std::vector<PointId>& points_of(KeyframeId keyframe) const;
  [[nodiscard]] const std::vector<LineId>& lines_of(KeyframeId keyframe) const;
  /// Landmarks that any of these keyframes sees, by id.
  [[nodiscard]] std::vector<PointId> points_seen_by(const std::vector<KeyframeId>& keyframes) const;
  [[nodiscard]] std::vector<LineId> lines_seen_by(const std::vector<KeyframeId>& keyframes) const;

  /// Keyframes that share at least `min_shared` landmarks with `keyframe`, most first, ties by id. If there
  /// are none, the ones that share most.
  [[nodiscard]] std::vector<std::pair<KeyframeId, int>> covisible(KeyframeId keyframe, int min_shared) const;
  /// Covisible keyframes, those that share most first, `count` at most; empty for a keyframe that does not
  /// exist.
  [[nodiscard]] std::vector<KeyframeId> neighbours(KeyframeId keyframe, std::size_t count) const;

  /// Landmarks that both see.
  [[nodiscard]] int shared(KeyframeId a, KeyframeId b) const;

  void add_edge(const SurfaceEdge& edge);
  /// Gives an edge, by its number in edges(), another measurement between the same keyframes.
  void replace_edge(std::uint64_t number, const SurfaceEdge& edge);
  /// Edges that have `keyframe` at one end, in order of creation.
  [[nodiscard]] std::vector<SurfaceEdge> edges_of(KeyframeId keyframe) const;

  /// All edges by order of creation.
  [[nodiscard]] const std::map<std::uint64_t, SurfaceEdge>& edges() const { return edges_; }

  /// Loops that were closed and not rejected. Throws std::invalid_argument when both ends are one,
  /// std::out_of_range when one is not in the map.
  void set_loops(std::vector<LoopEdge> loops);
  [[nodiscard]] const std::vector<LoopEdge>& loops() const { return loops_; }

  /// Recomputes view direction and the most typical descriptor from the observations.
  void refresh_point(PointId id);

 private:
  struct KeyframeEntry {
    std::shared_ptr<const Keyframe> data;
    geometry::Rigid3 pose;
    std::vector<PointId> points;  ///< by feature
    std::vector<LineId> lines;    ///< by feature
    std::vector<PointId>& seen(PointId /*kind*/) { return points; }
    std::vector<LineId>& seen(LineId /*kind*/) { return lines; }
    std::map<KeyframeId, int> shared;
    std::vector<std::uint64_t> edges;
    KeyframeId parent;
    std::vector<KeyframeId> children;  ///< by id
  };
  IdMap<PointId, MapPoint>& landmarks(PointId /*kind*/) { return points_; }
  IdMap<LineId, MapLine>& landmarks(LineId /*kind*/) { return lines_; }
  void share(const std::vector<Observation>& others, KeyframeId keyframe, int change);
  void erase_patches(KeyframeId id);
  void restore_tree(const MapParts& parts);

  IdMap<KeyframeId, KeyframeEntry> keyframes_;
  IdMap<PointId, MapPoint> points_;
  IdMap<LineId, MapLine> lines_;
  std::map<std::uint64_t, SurfaceEdge> edges_;  ///< by order of creation
  std::uint64_t next_edge_ = 0;
  std::vector<LoopEdge> loops_;
};

}  // namespace plumbline::maps
