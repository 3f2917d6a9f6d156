// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <nlohmann/json.hpp>

#include "output.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/viz/snapshot.hpp"

namespace plumbline::changes {
namespace {

using Json = nlohmann::ordered_json;

struct Color {
  std::uint8_t r, g, b;
};
/// By kind of place; colour-blind readers distinguish them (Okabe and Ito 2008).
constexpr std::array<Color, 6> kColors = {
    {{190, 190, 190}, {230, 159, 0}, {0, 114, 178}, {213, 94, 0}, {120, 150, 165}, {165, 140, 120}}};
/// Colours of places that moved, before and after.
constexpr Color kMovedFrom{240, 130, 170};
constexpr Color kMovedTo{0, 158, 115};

Color color_of(const Place& place, const std::vector<Change>& changes) {
  if (place.change >= 0 && changes[static_cast<std::size_t>(place.change)].kind == ChangeKind::kMoved)
    return place.later ? kMovedTo : kMovedFrom;
  return kColors[static_cast<std::size_t>(place.kind)];
}

/// Places as a cloud, coloured by kind of change.
cloud::CloudPtr cloud_of(const Comparison& comparison) {
  auto cloud = std::make_shared<cloud::Cloud>();
  cloud->reserve(comparison.places.size());
  for (const Place& place : comparison.places) {
    cloud::Point point;
    point.getVector3fMap() = place.at;
    point.getNormalVector3fMap() = place.normal;
    const Color color = color_of(place, comparison.changes);
    point.r = color.r;
    point.g = color.g;
    point.b = color.b;
    cloud->push_back(point);
  }
  return cloud;
}

/// Columns of changes.ply.
cloud::CloudColumns columns_of(const Comparison& comparison) {
  using Value = float (*)(const Place&);

  // Columns beyond position, normal and colour
  const std::vector<std::pair<const char*, Value>> values = {
      {"kind", [](const Place& p) { return static_cast<float>(p.kind); }},
      {"later", [](const Place& p) { return p.later ? 1.0F : 0.0F; }},
      {"change", [](const Place& p) { return static_cast<float>(p.change + 1); }},
      {"distance", [](const Place& p) { return p.distance.shift_m; }},
      {"limit", [](const Place& p) { return p.distance.limit_m; }},
      {"points_before", [](const Place& p) { return static_cast<float>(p.distance.before.count); }},
      {"points_after", [](const Place& p) { return static_cast<float>(p.distance.after.count); }},
      {"roughness_before", [](const Place& p) { return static_cast<float>(p.distance.before.sigma_m); }},
      {"roughness_after", [](const Place& p) { return static_cast<float>(p.distance.after.sigma_m); }}};

  // Column by column, in the order of the places
  cloud::CloudColumns columns;
  for (const auto& [name, value] : values) {
    cloud::CloudColumns::Other column{name, {}};
    for (const Place& place : comparison.places) column.values.push_back(value(place));
    columns.others.push_back(std::move(column));
  }
  return columns;
}

std::string three(const Eigen::Vector3d& p) {
  return fmt::format("{:.3f},{:.3f},{:.3f}", p.x(), p.y(), p.z());
}

std::string box_text(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& shift) {
  return box.isEmpty() ? ",,,,," : three(box.min() + shift) + "," + three(box.max() + shift);
}

/// Way of the middle of what moved or shifted.
Eigen::Vector3d way_of(const Change& change) {
  if (change.kind != ChangeKind::kMoved) return change.after_from_before.translation;
  if (!change.before.isEmpty())
    return change.after_from_before * change.before.center() - change.before.center();
  return change.after.center() - change.after_from_before.inverse() * change.after.center();
}

/// The table changes.csv, one row per change.
std::string csv_of(const Comparison& comparison, const Eigen::Vector3d& shift) {
  std::string csv =
      "number,kind,x,y,z,before_x0,before_y0,before_z0,before_x1,before_y1,before_z1,after_x0,after_y0,after_"
      "z0,"
      "after_x1,after_y1,after_z1,area,volume,way_x,way_y,way_z,turn_deg,distance,limit,sigma\n";
  for (std::size_t i = 0; i < comparison.changes.size(); ++i) {
    const Change& c = comparison.changes[i];
    const bool moved = c.kind == ChangeKind::kMoved, shifted = c.kind == ChangeKind::kShifted;
    csv += fmt::format("{},{},{},{},{},{:.4f},{:.5f},{},{},{},{},{:.4f}\n", i + 1, name_of(c.kind),
                       three(c.box().center() + shift), box_text(c.before, shift), box_text(c.after, shift),
                       c.area_m2, c.volume_m3, moved || shifted ? three(way_of(c)) : ",,",
                       moved ? fmt::format("{:.1f}", c.turn_rad * 180.0 / M_PI) : "",
                       shifted ? fmt::format("{:.4f}", c.shift_m) : "",
                       shifted ? fmt::format("{:.4f}", c.limit_m) : "", c.sigma_m);
  }
  return csv;
}

Json matrix_json(const geometry::Rigid3& pose) {
  const Eigen::Matrix4d m = pose.isometry().matrix();
  Json rows = Json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
  return rows;
}

/// The numbers of summary.json: counts, accuracy and the transformation between the maps.
Json summary_json(const Comparison& comparison, const Shown& shown) {
  Json places, changes = {{"appeared", 0}, {"vanished", 0}, {"moved", 0}, {"shifted", 0}};
  for (std::size_t k = 0; k < comparison.counts.size(); ++k)
    places[name_of(static_cast<PlaceKind>(k))] = comparison.counts[k];
  for (const Change& change : comparison.changes)
    changes[name_of(change.kind)] = changes[name_of(change.kind)].get<int>() + 1;
  return {{"before", shown.before},
          {"after", shown.after},
          {"swapped", shown.swapped},
          {"placing", shown.placing},
          {"before_from_after", matrix_json(shown.before_from_after)},
          {"agreement", comparison.agreement},
          {"registration_sigma_m", comparison.registration_m},
          {"median_limit_m", comparison.median_limit_m},
          {"free_space", {{"before", shown.free_space_before}, {"after", shown.free_space_after}}},
          {"places", places},
          {"changes", changes},
          {"version", core::version()}};
}

}  // namespace

/// One line about a change, for pages and the terminal.
std::string text_of(const Change& change) {
  const auto size = [](const Eigen::AlignedBox3d& box) {
    const Eigen::Vector3d s = box.sizes();
    return fmt::format("{:.2f} x {:.2f} x {:.2f} m", s.x(), s.y(), s.z());
  };

  // Moves and shifts name their distance
  switch (change.kind) {
    case ChangeKind::kMoved: {
      const double turn = change.turn_rad * 180.0 / M_PI;
      return fmt::format("moved by {:.2f} m{}", way_of(change).norm(),
                         std::abs(turn) < 2.0 ? "" : fmt::format(", turned by {:.0f} degrees", turn));
    }

    case ChangeKind::kShifted:
      return fmt::format("shifted by {:+.1f} mm (limit {:.1f} mm) over {:.2f} m2", 1000.0 * change.shift_m,
                         1000.0 * change.limit_m, change.area_m2);
    case ChangeKind::kAppeared:
    case ChangeKind::kVanished:
      break;
  }

  return fmt::format("{}: {}", name_of(change.kind), size(change.box()));
}

/// Cloud, table and summary of the comparison.
core::Result<void> write_tables(const std::filesystem::path& folder, const Comparison& comparison,
                                const Shown& shown) {
  auto written = cloud::write_ply(folder / "changes.ply", *cloud_of(comparison), columns_of(comparison),
                                  shown.shift, shown.frame.comments());
  if (written) written = core::write_file(folder / "changes.csv", csv_of(comparison, shown.shift));
  if (written)
    written = core::write_file(folder / "summary.json", core::json_text(summary_json(comparison, shown)));
  return written;
}

/// Two views coloured by kind of change, and one coloured by distance.
core::Result<void> write_pictures(const std::filesystem::path& folder, const Comparison& comparison,
                                  const Shown& shown, const core::Executor& executor) {
  viz::Scene scene;
  scene.cloud = cloud_of(comparison);

  // Both views show the kinds of change
  scene.title = core::printable(shown.before + " -> " + shown.after);
  viz::SnapshotOptions options;

  options.up = shown.up;
  std::vector<viz::Snapshot> snapshots;
  for (const viz::View view : {viz::View::kTop, viz::View::kIso}) {
    options.view = view;
    snapshots.push_back({options, folder / (viz::view_name(view) + ".png")});
  }
  if (auto drawn = viz::render_snapshots(scene, snapshots, executor); !drawn) return drawn;

  // The scale covers four times the median limit of detection
  for (const Place& place : comparison.places)
    scene.scalars.push_back(1000.0F * std::abs(place.distance.shift_m));
  scene.scalar_label = "distance (mm)";
  options.color = viz::ColorMode::kError;
  options.scalar_range = {0.0, std::max(10.0, 4000.0 * comparison.median_limit_m)};
  return viz::render_snapshots(scene, {{options, folder / "distance.png"}}, executor);
}

}  // namespace plumbline::changes
