// SPDX-License-Identifier: BSD-3-Clause
// Measures of openings and rooms, and outlines of furniture, from the points of the cloud.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "opening_points.hpp"
#include "plumbline/core/numbers.hpp"
#include "room_cells.hpp"
#include "wall_steps.hpp"

namespace plumbline::plans {

/// The place at which most values are, refined by medians; nothing if there are too few.
std::optional<double> main_place(const std::vector<double>& places) {
  constexpr double kBin_m = 0.002;
  constexpr double kNear_m = 0.008;
  constexpr std::size_t kFewest = 25;

  // The interval that holds most values
  if (places.size() < kFewest) return std::nullopt;
  const double first = *std::min_element(places.begin(), places.end());
  const double last = *std::max_element(places.begin(), places.end());
  double best = first;
  std::ptrdiff_t most = -1;

  const int bins = static_cast<int>((last - first) / kBin_m) + 1;
  for (int bin = 0; bin < bins; ++bin) {
    const double at = first + kBin_m * bin;
    const auto near =
        std::count_if(places.begin(), places.end(), [&](double s) { return std::abs(s - at) < kNear_m; });
    if (near <= most) continue;
    most = near;
    best = at;
  }

  // Medians of the values near it withstand outliers
  for (int round = 0; round < 3; ++round) {
    std::vector<double> near;
    std::copy_if(places.begin(), places.end(), std::back_inserter(near),
                 [&](double s) { return std::abs(s - best) < kNear_m; });
    if (near.size() < kFewest) return std::nullopt;
    best = core::median(near);
  }

  return best;
}

/// Points near an opening: along it, in front of it, and over the floor.
NearPoints points_near(const cloud::Cloud& cloud, double floor_m, const WallDoor& door, double reach_m) {
  NearPoints points;
  const Eigen::Vector2d along = (door.jambs[1] - door.jambs[0]).normalized();
  const Eigen::Vector2d front(along.y(), -along.x());
  const double depth = std::max(0.1, (door.far_jambs[0] - door.jambs[0]).norm());

  // Coordinates along and in front of the near jamb
  for (const cloud::Point& p : cloud) {
    const Eigen::Vector2d way = p.getVector3fMap().head<2>().cast<double>() - door.jambs[0];
    const double s = along.dot(way), h = front.dot(way);
    if (s < -reach_m || s > door.width_m + reach_m || h > reach_m || h < -depth - reach_m) continue;
    const Eigen::Vector3d normal = p.getNormalVector3fMap().cast<double>();
    points.places.emplace_back(s, h, static_cast<double>(p.z) - floor_m);
    points.normals.emplace_back(along.dot(normal.head<2>()), front.dot(normal.head<2>()), normal.z());
  }
  return points;
}

void measure_jambs(const NearPoints& points, WallDoor& door) {
  constexpr double kReach_m = 0.3;
  constexpr double kInside_m = 0.008;
  constexpr double kAssumed_m = 0.1;
  constexpr double kFacing = 0.8;
  const Eigen::Vector2d along = (door.jambs[1] - door.jambs[0]).normalized();

  const double known = (door.far_jambs[0] - door.jambs[0]).norm();
  const double depth = known > 0.0 ? known : kAssumed_m;
  std::array<double, 2> ends{0.0, door.width_m};

  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<double> places;
    for (std::size_t i = 0; i < points.places.size(); ++i) {
      const Eigen::Vector3d& p = points.places[i];
      const double facing = (k == 0 ? 1.0 : -1.0) * points.normals[i].x();
      if (facing > kFacing && std::abs(p.x() - ends[k]) < kReach_m && p.y() < -kInside_m &&
          p.y() > -depth + kInside_m && p.z() > 0.15 && p.z() < 2.0)
        places.push_back(p.x());
    }

    const std::optional<double> found = main_place(places);
    door.jamb_seen[k] = found.has_value();
    if (found) ends[k] = *found;
  }

  // Square to the wall, as the ends of its two faces need not lie opposite each other.
  const Eigen::Vector2d first = door.jambs[0], front(along.y(), -along.x());
  const Eigen::Vector2d across = front.dot(door.far_jambs[0] - first) * front;

  for (std::size_t k = 0; k < 2; ++k) {
    door.jambs[k] = first + ends[k] * along;
    door.far_jambs[k] = door.jambs[k] + across;
  }
  door.width_m = ends[1] - ends[0];
}

namespace {

/// The height of what faces down in the opening.
void measure_head(const NearPoints& points, WallDoor& door) {
  const double depth = std::max(0.1, (door.far_jambs[0] - door.jambs[0]).norm());
  std::vector<double> heights;
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    const Eigen::Vector3d& p = points.places[i];
    if (points.normals[i].z() < -0.8 && p.x() > 0.05 && p.x() < door.width_m - 0.05 && p.y() < 0.0 &&
        p.y() > -depth && p.z() > 1.7)
      heights.push_back(p.z());
  }
  if (const std::optional<double> head = main_place(heights)) door.head_m = *head;
}

/// The height of what faces up in the opening, from the floor to a parapet.
void measure_sill(const NearPoints& points, WallDoor& door) {
  constexpr double kHighest_m = 1.3;
  constexpr double kThreshold_m = 0.06;
  const double depth = std::max(0.1, (door.far_jambs[0] - door.jambs[0]).norm());
  std::vector<double> heights;
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    const Eigen::Vector3d& p = points.places[i];
    if (points.normals[i].z() > 0.8 && p.x() > 0.05 && p.x() < door.width_m - 0.05 && p.y() < 0.0 &&
        p.y() > -depth && p.z() < kHighest_m)
      heights.push_back(p.z());
  }
  const std::optional<double> sill = main_place(heights);
  if (sill && *sill > kThreshold_m) door.sill_m = *sill;
}

}  // namespace

/// Measures clear width, head and sill of doors; wide or high ones are passages, those over a sill windows.
void measure_doors(const cloud::Cloud& cloud, double floor_m, std::vector<WallDoor>& doors) {
  constexpr double kWidestLeaf_m = 1.3;
  for (WallDoor& door : doors) {
    const NearPoints points = points_near(cloud, floor_m, door);
    measure_jambs(points, door);

    // Between the jambs as they were measured.
    const NearPoints within = points_near(cloud, floor_m, door);
    measure_head(within, door);
    measure_sill(within, door);
    if (door.width_m > kWidestLeaf_m || door.head_m > 2.3) door.kind = OpeningKind::kPassage;
    if (door.sill_m > 0.0) door.kind = OpeningKind::kWindow;
  }
}

/// Heights of the rooms' ceilings: median, and range of the middle nine tenths.
void measure_heights(const cloud::Cloud& cloud, double floor_m, std::vector<WallRoom>& rooms) {
  constexpr double kLowest_m = 1.9;
  constexpr double kFewestPerArea = 300.0;  // per square metre: a tenth of a ceiling
  std::vector<std::vector<double>> heights(rooms.size());

  // Points that face down, by room
  for (const cloud::Point& p : cloud) {
    const double height = static_cast<double>(p.z) - floor_m;
    if (!(p.normal_z < -0.9F) || height < kLowest_m) continue;
    const Eigen::Vector2d at = p.getVector3fMap().head<2>().cast<double>();

    // Rooms do not overlap
    for (std::size_t i = 0; i < rooms.size(); ++i) {
      if (!is_inside(rooms[i].outline, at)) continue;
      heights[i].push_back(height);
      break;
    }
  }

  // A ceiling of which little was seen is not measured
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    std::vector<double>& of_room = heights[i];
    if (static_cast<double>(of_room.size()) < kFewestPerArea * rooms[i].area_m2) continue;
    std::sort(of_room.begin(), of_room.end());
    rooms[i].height_m = of_room[of_room.size() / 2];
    rooms[i].heights_m = {of_room[of_room.size() / 20], of_room[of_room.size() - 1 - of_room.size() / 20]};
  }
}

/// Outlines of all that stands at the height of furniture and away from walls.
std::vector<std::vector<Eigen::Vector2d>> furniture_outlines(const cloud::Cloud& cloud, double floor_m,
                                                             const std::vector<WallLine>& walls) {
  constexpr double kCell_m = 0.03;
  constexpr double kLow_m = 0.15, kHigh_m = 1.8;
  constexpr double kAtWall_m = 0.07;  // pictures, casings, noise
  constexpr double kSmallest_m2 = 0.03;
  constexpr double kLargest_m = 500.0;

  // Points between floor and head height
  std::vector<Eigen::Vector2d> places;
  Eigen::AlignedBox2d box;
  for (const cloud::Point& p : cloud) {
    const double height = static_cast<double>(p.z) - floor_m;
    const Eigen::Vector2d at = p.getVector3fMap().head<2>().cast<double>();

    if (height < kLow_m || height > kHigh_m) continue;

    // Points on a wall are no furniture
    const bool at_wall = std::any_of(walls.begin(), walls.end(), [&](const WallLine& wall) {
      const double s = wall.along().dot(at);
      return std::abs(wall.normal.dot(at) - wall.offset_m) < kAtWall_m && s > wall.s0 - kAtWall_m &&
             s < wall.s1 + kAtWall_m;
    });

    if (at_wall) continue;
    places.push_back(at);
    box.extend(at);
  }

  if (places.empty() || box.sizes().maxCoeff() > kLargest_m) return {};

  // A raster of cells with points
  const Eigen::Vector2d low = box.min().array() - 3.0 * kCell_m;
  const Eigen::Array2i size = ((box.max() - low) / kCell_m).array().ceil().cast<int>() + 3;
  cv::Mat cells = cv::Mat::zeros(size.y(), size.x(), CV_8U);

  for (const Eigen::Vector2d& at : places) {
    const Eigen::Array2i cell = ((at - low) / kCell_m).array().floor().cast<int>();
    cells.at<std::uint8_t>(cell.y(), cell.x()) = 255;
  }
  cv::morphologyEx(cells, cells, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));

  // Outer contours, simplified to the size of a cell
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(cells, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<std::vector<Eigen::Vector2d>> outlines;

  for (const std::vector<cv::Point>& contour : contours) {
    if (cv::contourArea(contour) * kCell_m * kCell_m < kSmallest_m2) continue;
    std::vector<cv::Point> corners;
    cv::approxPolyDP(contour, corners, 1.5, true);
    std::vector<Eigen::Vector2d> outline;
    outline.reserve(corners.size());
    for (const cv::Point& p : corners)
      outline.emplace_back(low + kCell_m * Eigen::Vector2d(p.x + 0.5, p.y + 0.5));
    outlines.push_back(std::move(outline));
  }

  return outlines;
}

}  // namespace plumbline::plans
