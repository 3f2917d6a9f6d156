// SPDX-License-Identifier: BSD-3-Clause
// A page with a map to walk through.
#include "plumbline/exports/view.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <tuple>

#include "drawings/plan_sheets.hpp"
#include "formats.hpp"
#include "pages/compare.hpp"
#include "pages/placing.hpp"
#include "pages/seen_from.hpp"
#include "pages/thumbnails.hpp"
#include "paths/lines.hpp"
#include "plumbline/cloud/columns.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/maps/pose_samples.hpp"
#include "plumbline/viewer/page.hpp"

namespace plumbline::exports {
namespace {

/// A point of each cell of this size that has any: the one of the highest confidence, or the first; in order.
std::vector<std::size_t> one_of_each_cell(const cloud::CloudFile& file, double cell_m) {
  struct Candidate {
    std::array<std::int32_t, 3> cell;
    float doubt;
    std::size_t index;
    bool operator<(const Candidate& other) const {
      return std::tie(cell, doubt, index) < std::tie(other.cell, other.doubt, other.index);
    }
  };

  // Sorted by cell, the most certain point first
  const std::vector<float>& confidence = file.columns.confidence;
  std::vector<Candidate> candidates;
  candidates.reserve(file.cloud->size());
  for (std::size_t i = 0; i < file.cloud->size(); ++i) {
    const cloud::Point& p = (*file.cloud)[i];
    const auto cell = [&](float v) { return static_cast<std::int32_t>(std::floor(v / cell_m)); };
    candidates.push_back({{cell(p.x), cell(p.y), cell(p.z)}, confidence.empty() ? 0.0F : -confidence[i], i});
  }
  std::sort(candidates.begin(), candidates.end());

  // The first of each cell, in the cloud's order
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i == 0 || candidates[i].cell != candidates[i - 1].cell) chosen.push_back(candidates[i].index);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

/// The cloud in the smallest voxels, about, that leave no more than `most` points.
cloud::CloudFile thinned_cloud(const cloud::CloudFile& file, std::size_t most) {
  double cell_m = 0.005;
  std::vector<std::size_t> chosen = one_of_each_cell(file, cell_m);
  for (int round = 0; round < 20 && chosen.size() > most; ++round) {
    // Surfaces have four times as few points in voxels twice as wide.
    const double ratio = static_cast<double>(chosen.size()) / static_cast<double>(most);
    cell_m *= std::max(1.02, 1.01 * std::sqrt(ratio));
    chosen = one_of_each_cell(file, cell_m);
  }

  cloud::CloudFile out;
  out.cloud = std::make_shared<cloud::Cloud>();
  out.cloud->reserve(chosen.size());
  for (const std::size_t i : chosen) out.cloud->push_back((*file.cloud)[i]);
  out.columns = cloud::pick_columns(file.columns, chosen);
  out.shift = file.shift;
  out.has_color = file.has_color;
  out.has_normals = file.has_normals;
  return out;
}

/// Two values that a share of the others lie below and above.
std::pair<double, double> middle_range(const std::vector<float>& values) {
  std::vector<float> sorted;
  for (const float v : values) {
    if (std::isfinite(v)) sorted.push_back(v);
  }
  if (sorted.empty()) return {0.0, 1.0};
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double share) {
    return static_cast<double>(
        sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))]);
  };
  return {at(0.02), at(0.98)};
}

/// Adds columns of the cloud as layers to colour by.
void add_layers(const cloud::CloudFile& file, const MapSource& source, viewer::Points& points) {
  const cloud::CloudColumns& columns = file.columns;
  if (!columns.confidence.empty()) {
    viewer::Layer layer{"confidence", "Confidence", "", viewer::Scale::kLinear};
    layer.steps = 20;
    layer.values = columns.confidence;
    points.layers.push_back(std::move(layer));
  }

  // Standard deviations span decades
  for (const cloud::CloudColumns::Other& other : columns.others) {
    if (other.name != "sigma") continue;
    viewer::Layer layer{"sigma", "Standard deviation", "m", viewer::Scale::kLogarithmic};
    const auto [low, high] = middle_range(other.values);

    // A range without outliers
    layer.low = std::max(low, 1e-5);
    layer.high = std::max(high, 1.1 * layer.low);
    layer.steps = 20;
    layer.values = other.values;
    points.layers.push_back(std::move(layer));
  }

  // Names of robots by number
  if (!columns.robot.empty() && source.robots().size() > 1) {
    viewer::Layer layer{"robot", "Robot", "", viewer::Scale::kCategory};
    std::size_t most = 0;
    for (const maps::RobotInfo& robot : source.robots())
      most = std::max(most, static_cast<std::size_t>(std::max(0, robot.number)));

    // Numbers without a robot have no name
    layer.names.resize(most + 1);
    for (const maps::RobotInfo& robot : source.robots())
      layer.names[static_cast<std::size_t>(std::max(0, robot.number))] = robot.name;
    layer.values.assign(columns.robot.begin(), columns.robot.end());
    points.layers.push_back(std::move(layer));
  }
}

/// The cloud with its layers as the viewer takes it.
viewer::Points points_of(const cloud::CloudFile& file, const MapSource& source) {
  viewer::Points points;
  points.name = source.name();
  points.colored = file.has_color;
  points.shift = {file.shift.x(), file.shift.y(), file.shift.z()};
  const std::size_t count = file.cloud->size();
  points.positions.reserve(count);
  points.colors.reserve(count);
  if (file.has_normals) points.normals.reserve(count);
  for (const cloud::Point& p : *file.cloud) {
    points.positions.push_back({p.x, p.y, p.z});
    points.colors.push_back({p.r, p.g, p.b});
    if (file.has_normals) points.normals.push_back({p.normal_x, p.normal_y, p.normal_z});
  }
  add_layers(file, source, points);
  return points;
}

/// Path of each robot, a pose each 2 cm or 5 degrees.
void add_paths(const MapSource& source, viewer::Scene& scene) {
  constexpr double kStep_m = 0.02;
  constexpr double kTurn = 0.087;
  const auto poses = source.poses(false);
  if (!poses) return;

  // A new path for each robot
  for (std::size_t i = 0; i < poses->size(); ++i) {
    const ExportPose& pose = (*poses)[i];
    const bool begins = scene.paths.empty() || scene.paths.back().robot != pose.robot;
    if (begins) scene.paths.push_back({pose.robot, pose.robot_name, {}, {}});

    // First and last poses stay, others if they differ
    viewer::CameraPath& path = scene.paths.back();
    const bool ends = i + 1 == poses->size() || (*poses)[i + 1].robot != pose.robot;
    if (!begins && !ends) {
      const geometry::Rigid3& before = path.world_from_camera.back();
      const double moved = (pose.world_from_camera.translation - before.translation).norm();
      const double cosine = pose.world_from_camera.rotation.col(2).dot(before.rotation.col(2));
      if (moved < kStep_m && cosine > std::cos(kTurn)) continue;
    }

    // Poses of the thinned path
    path.stamps.push_back(pose.stamp);
    path.world_from_camera.push_back(pose.world_from_camera);
  }
}

/// Errors that the keyframes' poses may have; none if the map was not checked.
void add_samples(const MapSource& source, const std::vector<ExportPose>& poses, viewer::Scene& scene) {
  const auto& result = source.place().result;
  if (!result) return;
  const auto samples = maps::read_pose_samples(result->folder / maps::kPoseSamplesFile);
  if (!samples) return;
  std::map<core::KeyframeId, const geometry::PoseSamples*> known;
  for (const maps::KeyframeSamples& one : *samples) known[one.keyframe] = &one.in_camera;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto found = known.find(poses[i].keyframe);
    if (found != known.end()) scene.keyframes[i].in_camera = *found->second;
  }
}

/// Keyframes with their pictures, what each of them saw best, and the loops between them.
core::Result<void> add_keyframes(const MapSource& source, const cloud::CloudFile& file, MapView& view) {
  const auto poses = source.poses(true);
  if (!poses) return {};

  // Numbers and places of keyframes for views and loops
  std::map<core::KeyframeId, std::size_t> numbers;
  std::map<core::KeyframeId, Eigen::Vector3d> places;
  for (const ExportPose& pose : *poses) {
    if (pose.keyframe.valid()) {
      numbers[pose.keyframe] = view.scene.keyframes.size();
      places[pose.keyframe] = pose.world_from_camera.translation;
    }
    view.scene.keyframes.push_back({pose.robot, pose.stamp, pose.world_from_camera, {}, {}});
  }

  // Pictures and samples of the keyframes' poses
  add_samples(source, *poses, view.scene);
  add_thumbnails(source, *poses, view);
  if (!source.has_store()) return {};

  // The keyframe that saw each point best
  auto seen = best_views(source, file, numbers);
  if (!seen) return tl::unexpected(seen.error());
  if (!seen->empty()) {
    viewer::Layer layer{"view", "Time seen", "s", viewer::Scale::kView};
    layer.values = std::move(*seen);
    view.scene.clouds.front().layers.push_back(std::move(layer));
  }

  // Loops between keyframes that are shown
  const auto store = source.store("loops");
  for (const maps::LoopEdge& loop : (*store)->stored().map.loops()) {
    const auto a = places.find(loop.a);
    const auto b = places.find(loop.b);
    if (a != places.end() && b != places.end())
      view.scene.arcs.push_back({loop.a.robot != loop.b.robot, a->second, b->second});
  }
  return {};
}

void add_lines(const MapSource& source, viewer::Scene& scene) {
  const auto lines = lines_of(source);
  if (!lines) return;
  for (const auto& [start, end] : *lines) {
    if (source.selects(start) && source.selects(end)) scene.lines.emplace_back(start, end);
  }
}

/// Walls, doors and rooms at the height of the cut; nothing where none are found.
void add_plan(MapSource& source, MapView& view) {
  viewer::Scene& scene = view.scene;
  if (!scene.z_up) return;
  const auto plan = plan_of(source);
  if (!plan) {
    view.notes.push_back("without a floor plan: " + plan.error().message);
    return;
  }

  // Faces of walls between their openings
  const double height = source.floor_m() + source.options().cut_m;
  const auto at = [&](const Eigen::Vector2d& p) { return Eigen::Vector3d(p.x(), p.y(), height); };
  for (const plans::WallLine& wall : plan->walls) {
    double from = wall.s0;
    for (const plans::WallOpening& opening : wall.openings) {
      scene.walls.emplace_back(at(wall.at(from)), at(wall.at(opening.s0)));
      from = opening.s1;
    }
    scene.walls.emplace_back(at(wall.at(from)), at(wall.at(wall.s1)));
  }

  // Windows are not passages
  for (const plans::WallDoor& door : plan->doors) {
    if (door.kind == plans::OpeningKind::kWindow) continue;
    scene.doors.emplace_back(at(0.5 * (door.jambs[0] + door.far_jambs[0])),
                             at(0.5 * (door.jambs[1] + door.far_jambs[1])));
  }

  // Areas of rooms, and the plan as a drawing
  for (const plans::WallRoom& room : plan->rooms)
    scene.rooms.emplace_back(at(room.label),
                             fmt::format("{}{:.2f} m²", room.closed ? "" : "≥ ", room.area_m2));
  scene.plan_height_m = height;
  view.plan = plan_page(*plan, scene.name);
}

/// The cloud with so many points as are wanted, for the page and as it is.
core::Result<std::pair<cloud::CloudFile, viewer::Points>> shown_cloud(MapSource& source) {
  const auto whole = source.cloud();
  if (!whole) return tl::unexpected(whole.error());
  const auto most = static_cast<std::size_t>(source.options().points);
  const std::size_t all = (*whole)->cloud->size();
  const bool thin = most > 0 && all > most;
  cloud::CloudFile file = thin ? thinned_cloud(**whole, most) : **whole;

  viewer::Points points = points_of(file, source);
  if (thin) points.of = all;
  return std::pair(std::move(file), std::move(points));
}

/// The whole scene: cloud, paths, keyframes, lines and plan.
core::Result<MapView> view_of(MapSource& source) {
  auto cloud = shown_cloud(source);
  if (!cloud) return tl::unexpected(cloud.error());
  MapView view;
  viewer::Scene& scene = view.scene;
  scene.name = source.name();
  scene.frame = source.frame_text();
  scene.z_up = source.need_upright("").has_value();
  scene.floor_m = source.floor_m();
  scene.clouds.push_back(std::move(cloud->second));

  // Parts that the map lacks are left out
  add_paths(source, scene);
  if (auto added = add_keyframes(source, cloud->first, view); !added) return tl::unexpected(added.error());
  add_lines(source, scene);
  add_plan(source, view);
  return view;
}

/// True if a file is a page of the viewer.
bool is_view(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string head(512, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  return head.rfind("<!DOCTYPE html>", 0) == 0 && head.find(kViewGenerator) != std::string::npos;
}

/// Writes the page; only pages of maps are replaced.
core::Result<ExportSummary> write_view(MapSource& source, const std::filesystem::path& output) {
  std::error_code ec;
  if (std::filesystem::is_regular_file(output, ec) && !is_view(output)) {
    return core::usage_error(fmt::format(
        "{}: exists and is not a page of a map; name another file (only such pages are ever replaced)",
        output.string()));
  }

  auto view = view_of(source);
  if (!view) return tl::unexpected(view.error());

  viewer::Cost cost;
  const std::string page = viewer::page(view->scene, kViewGenerator, &cost);
  if (auto written = core::write_file(output, page); !written) return tl::unexpected(written.error());

  // Facts about the page's size
  ExportSummary summary;
  summary.written = {output};
  summary.notes = std::move(view->notes);
  const auto each = [&](std::size_t bytes) {
    return static_cast<double>(bytes) / static_cast<double>(std::max<std::size_t>(1, cost.points));
  };

  // Bytes of each part for one point
  summary.notes.push_back(fmt::format(
      "{} points{}, {:.1f} MB: {:.2f} bytes a point for place and colour, {:.2f} for normals, "
      "{:.2f} for {} further layers",
      cost.points,
      view->scene.clouds.front().of > 0 ? fmt::format(" of {}", view->scene.clouds.front().of) : "",
      static_cast<double>(page.size()) / 1e6, each(cost.place_and_color), each(cost.normals),
      each(cost.layers), view->scene.clouds.front().layers.size()));
  return summary;
}

}  // namespace

core::Result<MapView> view_of(const ExportRequest& request, const core::Executor& executor, core::Log& log,
                              const ExportProgress& progress) {
  auto source = MapSource::open(request, executor, log, progress);
  if (!source) return tl::unexpected(source.error());
  return view_of(*source);
}

/// Both maps in the frame of the first, coloured by distance.
core::Result<MapView> view_of_two(const ExportRequest& first, const ExportRequest& second,
                                  const core::Executor& executor, core::Log& log,
                                  const ExportProgress& progress, bool by_cameras) {
  // Both maps with their clouds
  auto one = MapSource::open(first, executor, log, progress);
  if (!one) return tl::unexpected(one.error());
  auto other = MapSource::open(second, executor, log, progress);
  if (!other) return tl::unexpected(other.error());
  auto view = view_of(*one);
  if (!view) return view;
  auto added = shown_cloud(*other);
  if (!added) return tl::unexpected(added.error());

  // The second cloud is moved into the first one's frame
  viewer::Scene& scene = view->scene;
  if (added->second.name == scene.clouds.front().name) added->second.name += " (second)";
  const auto placed = place_second(*one, scene.clouds.front(), *other, added->second, by_cameras);
  if (!placed) return tl::unexpected(placed.error());
  move(added->second, placed->first_from_second);
  view->first_from_second = placed->first_from_second;
  view->world_from_map = {one->world_from_map(), placed->first_from_second * other->world_from_map()};
  scene.placing = placed->how;
  view->notes.push_back(placed->how);

  // Distances need the aligned clouds
  add_distances(scene.clouds.front(), added->second, executor);
  scene.clouds.push_back(std::move(added->second));
  return view;
}

Format html_format() {
  return {"html",
          {".html"},
          {Content::kCloud},
          "",
          "Page to walk through the map in a browser",
          "One file that opens from disk, without a network: the cloud with levels of detail, coloured by "
          "photo, height, normal, confidence, σ, robot or time seen; the cameras' path with the keyframes' "
          "pictures, lines, loops, the floor plan; measuring, cutting, saving of what is shown. Small "
          "pictures of keyframes are taken from the recording as long as it is there. `--points` thins the "
          "cloud by voxels. [viewer.md](viewer.md) tells how it is used.",
          {"points", "voxel", "cut"},
          &write_view};
}

}  // namespace plumbline::exports
