// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The floor as a grid: where people can stand, and how far the next obstacle is.
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

class Ground {
 public:
  static constexpr double kCell = 0.05;       ///< m
  static constexpr double kClearance = 0.24;  ///< m from the middle of a person to anything

  /// Rooms and ways between them, with leaves of doors in the way and nothing else.
  explicit Ground(const Plan& plan, int storey = 0);
  /// The floor of any scene at a height: nothing stands on it or hangs lower than people are high.
  Ground(const Scene& scene, double floor);

  /// Marks cells as occupied; recompute() brings the distances up to date.
  void block(const std::vector<Eigen::Vector2d>& outline, bool hides_view);
  void unblock(const std::vector<Eigen::Vector2d>& outline);
  void recompute();
  /// Nothing stands within an outline.
  [[nodiscard]] bool is_free(const std::vector<Eigen::Vector2d>& outline) const;
  /// Blocks an outline within a room, unless less than `least` of the room's floor could then be walked on
  /// without leaving it from each of the places `ways`.
  bool try_block(const std::vector<Eigen::Vector2d>& outline, bool hides_view,
                 const std::vector<Eigen::Vector2d>& room, const std::vector<Eigen::Vector2d>& ways,
                 double least);

  [[nodiscard]] cv::Point cell_of(const Eigen::Vector2d& p) const;
  [[nodiscard]] Eigen::Vector2d middle_of(const cv::Point& cell) const;
  /// m to the nearest obstacle; 0 outside.
  [[nodiscard]] double clearance(const Eigen::Vector2d& p) const;
  /// Nothing that people cannot look over is between two places.
  [[nodiscard]] bool in_sight(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;
  /// Least clearance along a straight line.
  [[nodiscard]] double clearance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;
  /// Cells that can be reached from one of them: 1, else 0.
  [[nodiscard]] cv::Mat1b reachable(const Eigen::Vector2d& from) const;
  /// The cheapest way, which keeps away from obstacles where it can (A*); empty if there is none.
  [[nodiscard]] std::vector<Eigen::Vector2d> way(const Eigen::Vector2d& from,
                                                 const Eigen::Vector2d& to) const;
  /// The same in straight pieces of up to 2 m, with clearance kept.
  [[nodiscard]] std::vector<Eigen::Vector2d> straight_way(const Eigen::Vector2d& from,
                                                          const Eigen::Vector2d& to) const;
  [[nodiscard]] bool walkable(const cv::Point& c) const {
    return cv::Rect({0, 0}, distance_.size()).contains(c) && distance_(c) >= static_cast<float>(kClearance);
  }
  [[nodiscard]] cv::Size size() const { return free_.size(); }

 private:
  /// Cells with their middles in an outline.
  void fill(cv::Mat1b& grid, const std::vector<Eigen::Vector2d>& outline, uchar value) const;
  Eigen::Vector2d origin_;
  cv::Mat1b free_;      ///< 1: nothing stands there
  cv::Mat1b see_;       ///< 1: nothing there reaches to the eyes
  cv::Mat1f distance_;  ///< m
};

/// A storey with all things that stand on it.
Ground furnished_ground(const Plan& plan, int storey);

/// The four corners of a rectangle in a frame.
std::vector<Eigen::Vector2d> rectangle(const Eigen::Vector2d& at, double yaw_rad, const Eigen::Vector2d& lo,
                                       const Eigen::Vector2d& hi);

}  // namespace plumbline::synth
