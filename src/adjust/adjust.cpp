// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/adjust/adjust.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <utility>

#include "network.hpp"
#include "plumbline/exports/grid_place.hpp"
#include "plumbline/mapping/adjustment/global_adjustment.hpp"
#include "plumbline/optimize/pose_graph.hpp"
#include "report.hpp"

namespace plumbline::adjust {
namespace {

using geometry::Rigid3;

constexpr double kDetectable_m = 0.3;  // what shows only larger blunders checks nothing
constexpr double kDetection = 4.0;     // standard deviations: found in 9 of 10, none found in vain in 1000

class Adjuster {
 public:
  Adjuster(maps::StoredMaps& maps, const AdjustRequest& request, const core::Executor& executor)
      : maps_(maps),
        request_(request),
        executor_(executor),
        stored_(maps.parts().front().run.stored()),
        left_out_(request.control.size(), false) {}

  core::Result<Adjustment> run() {
    if (auto fine = check(); !fine) return tl::unexpected(fine.error());
    if (auto seen = see(); !seen) return tl::unexpected(seen.error());
    if (auto placed = place(); !placed) return tl::unexpected(placed.error());
    if (auto solved = solve(); !solved) return tl::unexpected(solved.error());
    tell();

    if (auto moved = move(); !moved) return tl::unexpected(moved.error());
    return std::move(result_);
  }

 private:
  [[nodiscard]] core::Result<void> check() const {
    if (request_.control.empty() && request_.datum.empty() && request_.edits.empty() &&
        request_.tags.empty()) {
      return core::usage_error(
          "nothing to adjust by; give --length, --points, --tags, --level, --plumb, --datum or --edits "
          "(docs/guide/control.md)");
    }

    if (!stored_.result.upright) {
      return core::input_error(
          "the map is not upright, so that heights are not known; map again without fuse.up=none");
    }

    if (!request_.datum.empty() && points() > 0)
      return core::usage_error("--datum and --points both say where the map lies; give one of them");
    return {};
  }

  /// Which keyframes saw the places, in the map as it was given.
  core::Result<void> see() {
    std::vector<Eigen::Vector3d> places;
    for (const Control& control : request_.control) {
      places.push_back(control.p);
      places.push_back(control.q);
    }

    const std::vector<PlaceViews> found = find_place_views(maps_, 0, places, executor_);
    for (std::size_t i = 0; i < request_.control.size(); ++i) {
      const Control& control = request_.control[i];
      p_.push_back(control.seen.empty() ? found[2 * i] : control.seen);
      q_.push_back(!control.pair()          ? PlaceViews()
                   : control.seen_q.empty() ? found[2 * i + 1]
                                            : control.seen_q);

      // Picks come from views of the cloud: one that lies beside every surface cannot be tied to keyframes.
      for (const auto& [place, place_views] :
           {std::pair{&control.p, &p_[i]}, std::pair{&control.q, &q_[i]}}) {
        if (!place_views->empty() || (place == &control.q && !control.pair())) continue;
        return core::usage_error(
            fmt::format("{}: no keyframe saw a surface within 6 cm of {:.3f},{:.3f},{:.3f}; pick "
                        "the place on a surface (plumbline view shows coordinates)",
                        control.name, place->x(), place->y(), place->z()));
      }
    }

    return {};
  }

  [[nodiscard]] std::size_t points() const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < request_.control.size(); ++i)
      count += request_.control[i].kind == ControlKind::kPoint && !left_out_[i] ? 1 : 0;
    return count;
  }

  /// The map's place in the world as its points have it, and where they lie in the frame of results then.
  core::Result<void> place() {
    start_ = {};
    targets_.assign(request_.control.size(), Eigen::Vector3d::Zero());

    if (!request_.datum.empty()) {
      const auto world = place_of_datum();
      if (!world) return tl::unexpected(world.error());
      result_.world = *world;
    }

    return points() == 0 ? core::Result<void>() : place_by_points();
  }

  /// The world that --datum gives: a place of the map's origin, and its turn from grid north.
  [[nodiscard]] core::Result<WorldPlace> place_of_datum() const {
    const auto grid = exports::grid_of(request_.datum);
    if (!grid) return tl::unexpected(grid.error());
    const auto north = exports::grid_at(grid->epsg, grid->east, grid->north);
    if (!north) return tl::unexpected(north.error());

    WorldPlace world{grid->epsg, grid->name,  {grid->east, grid->north, 0.0},
                     grid->turn, grid->scale, north->turn - M_PI / 2};
    if (request_.datum.size() == 4) world.origin.z() = request_.datum[3];
    return world;
  }

  /// Scale, turn and shift in the plane by least squares over the points that are not left out.
  core::Result<void> place_by_points() {
    // Centres of gravity first: the shift is theirs, whatever the scale and the turn.
    Eigen::Vector3d in_world = Eigen::Vector3d::Zero(), in_map = Eigen::Vector3d::Zero();
    for_points([&](std::size_t i) {
      in_world += request_.control[i].world / static_cast<double>(points());
      in_map += request_.control[i].p / static_cast<double>(points());
    });

    WorldPlace world;
    if (request_.epsg != 0) {
      const auto grid = exports::grid_at(request_.epsg, in_world.x(), in_world.y());
      if (!grid) return tl::unexpected(grid.error());
      world = {grid->epsg, grid->name, {}, 0.0, grid->scale, grid->turn - M_PI / 2};
    }

    const auto both = scale_and_turn(in_world, in_map, world.scale);
    if (!both) return tl::unexpected(both.error());
    start_.scale = std::abs(*both);
    world.turn = std::arg(*both);

    // The grid's scale acts on what is horizontal only; heights are metres as they are.
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(world.turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d grid(world.scale, world.scale, 1.0);
    world.origin = in_world - grid.asDiagonal() * (turn * (start_.scale * in_map));
    for (std::size_t i = 0; i < targets_.size(); ++i) {
      targets_[i] =
          turn.transpose() * grid.cwiseInverse().asDiagonal() * (request_.control[i].world - world.origin);
    }

    result_.world = world;
    return {};
  }

  /// Scale and turn in the plane as one complex number; 1 where a single point cannot tell them.
  [[nodiscard]] core::Result<std::complex<double>> scale_and_turn(const Eigen::Vector3d& in_world,
                                                                  const Eigen::Vector3d& in_map,
                                                                  double grid_scale) const {
    if (points() < 2) return std::complex<double>(1.0, 0.0);

    std::complex<double> sum(0.0, 0.0);
    double spread = 0.0;
    for_points([&](std::size_t i) {
      const Eigen::Vector3d m = request_.control[i].p - in_map;
      const Eigen::Vector3d w = (request_.control[i].world - in_world) / grid_scale;
      sum += std::conj(std::complex<double>(m.x(), m.y())) * std::complex<double>(w.x(), w.y());
      spread += m.head<2>().squaredNorm();
    });
    if (spread < 0.01) return core::usage_error("--points: all lie at one place from above; choose others");

    // A map is never half or twice as large as it should be: columns of the file are swapped then.
    const std::complex<double> both = sum / spread;
    if (!(std::abs(both) > 0.5 && std::abs(both) < 2.0)) {
      return core::usage_error(
          fmt::format("--points: the map would become {:.3g} times as large; look for columns that "
                      "are swapped (map x, y, z, then east, north, height)",
                      std::abs(both)));
    }
    return both;
  }

  template <typename Do>
  void for_points(const Do& act) const {
    for (std::size_t i = 0; i < request_.control.size(); ++i) {
      if (request_.control[i].kind == ControlKind::kPoint && !left_out_[i]) act(i);
    }
  }

  /// Solves, and leaves out one blunder after another.
  core::Result<void> solve() {
    const auto state = maps_.parts().front().run.fusion_state();
    if (!state) return tl::unexpected(state.error());
    covariance_ = std::make_unique<MapCovariance>(stored_.map, *state);
    checks_.resize(request_.control.size());

    if (request_.control.empty()) return {};

    // One observation leaves at a time, as a blunder spreads over the residuals of its neighbours. If the
    // next worst is nearly as bad, and fits once the worst is gone, nothing tells which of the two is wrong.
    std::optional<std::size_t> alternative;
    std::size_t last = 0;
    for (std::size_t removed = 0;; ++removed) {
      converge();

      std::optional<std::size_t> worst, second;
      for (std::size_t k = 0; k < solved_.used.size(); ++k) {
        const std::size_t i = solved_.used[k];
        checks_[i] = solved_.solution.checks[k];
        if (!worst || excess(i) > excess(*worst)) {
          second = worst;
          worst = i;
        } else if (!second || excess(i) > excess(*second)) {
          second = i;
        }
      }

      if (alternative && excess(*alternative) <= 1.0) return contradiction(last, *alternative);
      if (!worst || excess(*worst) <= 1.0) return {};
      if (!checked(*worst) || 3 * (removed + 1) > 2 * request_.control.size())
        return contradiction(*worst, *worst);

      const bool close = second && excess(*second) > std::max(1.0, 0.8 * excess(*worst));
      alternative = close ? second : std::nullopt;

      last = *worst;
      left_out_[last] = true;
      if (auto placed = place(); !placed) return placed;
    }
  }

  void converge() {
    constexpr int kSteps = 4;
    network_.emplace(request_.control, p_, q_, stored_.map, stored_.result.output_from_map);
    network_->move(start_);
    total_ = start_;
    for (int step = 0; step < kSteps; ++step) {
      solved_ = network_->solve(left_out_, targets_, *covariance_);

      network_->move(solved_.step);
      total_ = solved_.step * total_;
    }

    solved_ = network_->solve(left_out_, targets_, *covariance_);
  }

  /// Squared deviation of an observation, relative to the gate; over 1: it is a blunder.
  [[nodiscard]] double excess(std::size_t i) const {
    return checks_[i].chi2 / optimize::chi_square_gate(checks_[i].rows);
  }
  [[nodiscard]] bool checked(std::size_t i) const { return kDetection * checks_[i].sigma <= kDetectable_m; }

  [[nodiscard]] core::Result<void> contradiction(std::size_t a, std::size_t b) const {
    const std::string& name = request_.control[a].name;
    return core::failure(
        core::ErrorKind::kUntrustworthy,
        a == b
            ? fmt::format(
                  "what was measured does not fit together: {} is off by {:.0f} mm, and which of them "
                  "is wrong cannot be told; measure more",
                  name, 1e3 * checks_[a].difference.norm())
            : fmt::format("{} and {} contradict each other by {:.0f} mm, and which is wrong cannot be told; "
                          "measure one more",
                          name, request_.control[b].name, 1e3 * checks_[a].difference.norm()));
  }

  /// Fills the findings; the network is where the similarity has brought it.
  void tell() {
    if (request_.control.empty()) return;
    const Network before(request_.control, p_, q_, stored_.map, stored_.result.output_from_map);
    Network start = before;
    if (result_.world) start.move(start_);  // only the points' own place tells how far they were off
    for (std::size_t i = 0; i < request_.control.size(); ++i) {
      ControlFinding finding;
      finding.name = request_.control[i].name;
      finding.before_m = residual_of(request_.control[i].pair() ? before : start, i);
      finding.after_m = residual_of(*network_, i);
      finding.left_out = left_out_[i];

      finding.checked = checked(i);
      finding.off_m = finding.left_out ? finding.after_m : checks_[i].difference.norm();
      finding.detectable_m = kDetection * checks_[i].sigma;

      result_.findings.push_back(finding);
    }

    result_.scale = total_.scale;
    result_.scale_sigma = solved_.scale_sigma;

    const Eigen::Vector3d turned = geometry::log_so3(total_.motion.rotation);
    result_.tilt_rad = turned.head<2>().norm();
    result_.turn_rad = turned.z();
    result_.shift_m = total_.motion.translation.norm();
  }
  [[nodiscard]] double residual_of(const Network& network, std::size_t i) const {
    const Eigen::VectorXd r = network.residual(i, targets_);

    return r.size() == 1 ? r(0) : r.norm();
  }

  /// The similarity, then the bend, then what is left of each observation.
  core::Result<void> move() {
    maps::Map map = stored_.map;
    std::vector<maps::FramePose> frames = stored_.frames;
    apply(total_, stored_.result.output_from_map, map, frames);

    if (!request_.control.empty()) {
      // The part of the correction that no similarity has, by the correlation of each keyframe with the
      // observations.
      const Eigen::VectorXd motions = solved_.signal * solved_.solution.weights;
      mapping::KeyframePoses poses;
      double sum = 0.0;
      for (const core::KeyframeId id : map.keyframe_ids()) {
        const geometry::Vector6d own = motions.segment<6>(covariance_->at(id));
        const Rigid3& pose = map.camera_from_world(id);
        poses.emplace_back(id, geometry::exp_se3(own) * pose);

        const double way = (poses.back().second.inverse().translation - pose.inverse().translation).norm();
        result_.largest_bend_m = std::max(result_.largest_bend_m, way);
        sum += way;
      }

      result_.mean_bend_m = sum / static_cast<double>(std::max<std::size_t>(1, poses.size()));
      mapping::move_keyframes(map, poses);

      // Residuals are told as the moved map has them, and not as the linear solution promised.
      for (std::vector<PlaceViews>* all : {&p_, &q_}) {
        for (PlaceViews& place_views : *all) {
          for (auto& [id, in_camera] : place_views) in_camera *= total_.scale;
        }
      }

      const Network now(request_.control, p_, q_, map, stored_.result.output_from_map);
      for (std::size_t i = 0; i < request_.control.size(); ++i) {
        ControlFinding& finding = result_.findings[i];
        finding.after_m = residual_of(now, i);
        if (finding.left_out) finding.off_m = std::abs(finding.after_m);
      }
    }
    write_report(result_);

    return maps_.replace(0, std::move(map), std::move(frames), total_.scale);
  }

  maps::StoredMaps& maps_;
  const AdjustRequest& request_;
  const core::Executor& executor_;
  const maps::StoredMap& stored_;
  std::vector<bool> left_out_;
  std::vector<PlaceViews> p_, q_;
  std::vector<Eigen::Vector3d> targets_;  ///< of points, in the frame of results
  Similarity start_, total_;
  std::unique_ptr<MapCovariance> covariance_;

  std::optional<Network> network_;
  Network::Solved solved_;
  std::vector<CollocationCheck> checks_;
  Adjustment result_;
};

}  // namespace

core::Result<Adjustment> adjust_map(maps::StoredMaps& maps, const AdjustRequest& request,
                                    const core::Executor& executor) {
  return Adjuster(maps, request, executor).run();
}

}  // namespace plumbline::adjust
