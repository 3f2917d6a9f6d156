// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/check/self_check.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "camera_part.hpp"
#include "graph.hpp"
#include "pair.hpp"
#include "pair_choice.hpp"
#include "plumbline/core/numbers.hpp"
#include "samples.hpp"
#include "untied_path.hpp"
#include "verdict.hpp"

namespace plumbline::check {
namespace {

/// One pair that was aligned anew.
struct AlignedPair {
  std::size_t first = 0;  ///< number of an anchor
  std::size_t second = 0;
  double found = 1.0;        ///< share of the common surface that is near enough to be compared
  bool contradicts = false;  ///< no common surface where there should be one
  Correction both;
  double split_chi = -1.0;        ///< depth against colour; negative: one of them says nothing
  double split_squared_m2 = 0.0;  ///< less the noise of both
};

/// Depth against colour, in the directions that both know.
void note_split(const Correction& depth, const Correction& flow, AlignedPair& pair) {
  const geometry::Vector6d off = depth.motion - flow.motion;
  const geometry::Matrix6d noise = depth.covariance() + flow.covariance() + pair.both.blur.covariance();
  pair.split_chi = std::sqrt(off.dot(noise.ldlt().solve(off)) / 6.0);
  pair.split_squared_m2 = off.head<3>().squaredNorm() - noise.topLeftCorner<3, 3>().trace();
}

/// Noise of depth from frames that follow each other: a + b z^2 through robust spreads in bins of depth.
DepthNoise noise_of(const std::vector<PairRows>& next) {
  constexpr std::array<double, 8> kBins{0.0, 0.7, 1.2, 1.8, 2.5, 3.5, 5.0, 9.0};
  constexpr std::size_t kFewest = 300;
  constexpr double kLeast_m = 2e-4;

  // Residuals of neighbouring frames by distance.
  std::array<std::vector<double>, 7> offs, depths;
  for (const PairRows& rows : next) {
    for (const DepthRow& row : rows.depth) {
      const auto bin =
          std::upper_bound(kBins.begin() + 1, kBins.end() - 1, row.point.z()) - kBins.begin() - 1;
      offs[static_cast<std::size_t>(bin)].push_back(row.off_m);
      depths[static_cast<std::size_t>(bin)].push_back(row.point.z());
    }
  }

  Eigen::Matrix2d left = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  std::size_t bins = 0;
  for (std::size_t i = 0; i < offs.size(); ++i) {
    if (offs[i].size() < kFewest) continue;

    // Its standard deviation, by the median.
    const double middle = core::median(offs[i]);
    for (double& off : offs[i]) off = std::abs(off - middle);
    const double sigma = 1.4826 / std::sqrt(2.0) * core::median(offs[i]);
    const double z = core::median(depths[i]);

    // One equation of the fit.
    const double weight = 1.0 / std::max(sigma, 3e-4);
    const Eigen::Vector2d row = weight * Eigen::Vector2d(1.0, z * z);
    left += row * row.transpose();
    right += weight * sigma * row;
    ++bins;
  }

  if (bins == 0) return {};
  const Eigen::Vector2d found = (left + 1e-9 * Eigen::Matrix2d::Identity()).ldlt().solve(right);
  return {std::max(kLeast_m, found.x()), std::max(0.0, found.y())};
}

constexpr double kShortestTear_m = 0.03;

class Check {
 public:
  Check(const CheckInput& input, const core::Executor& executor) : input_(input), executor_(executor) {}

  core::Result<CheckReport> run() {
    for (const Way& way : input_.ways) cameras_.emplace_back(way);
    for (const KeptFrame& frame : input_.frames) {
      const PathPoses path(input_.ways[frame.way].path, input_.max_dt_s);
      if (const auto poses = path.of(frame)) frames_.push_back({frame, *poses});
    }
    for (std::size_t f = 0; f < frames_.size(); ++f) {
      if (frames_[f].frame.use == FrameChoice::Use::kAnchor) anchors_.push_back(f);
    }

    if (auto done = choose(); !done) return tl::unexpected(done.error());
    if (auto done = measure_noise(); !done) return tl::unexpected(done.error());
    if (auto done = align(); !done) return tl::unexpected(done.error());
    return summed_up();
  }

 private:
  core::Result<View> view(std::size_t frame) const {
    const PosedFrame& posed = frames_[frame];
    auto small = input_.read(posed.frame.number);
    if (!small) return tl::unexpected(small.error());
    return View{&cameras_[posed.frame.way], posed.poses, std::move(*small)};
  }
  /// An anchor's view; its images are shared and must not be changed.
  core::Result<View> anchor_view(std::size_t a) const {
    if (a >= kept_.size()) return view(anchors_[a]);
    const PosedFrame& posed = frames_[anchors_[a]];
    return View{&cameras_[posed.frame.way], posed.poses, kept_[a]};
  }

  /// work(a) for each anchor, side by side; the first error.
  template <typename Work>
  core::Result<void> for_anchors(const Work& work) const {
    std::vector<core::Result<void>> done(anchors_.size());
    executor_.parallel_for(anchors_.size(), [&](std::size_t a) { done[a] = work(a); });
    for (const auto& one : done) {
      if (!one) return one;
    }
    return {};
  }

  core::Result<void> choose() {
    // Each anchor has many partners: the images of the first ones, about 60 MB, are read once.
    constexpr std::size_t kMostKept = 256;
    kept_.resize(std::min(kMostKept, anchors_.size()));
    outlines_.resize(anchors_.size());
    auto done = for_anchors([&](std::size_t a) -> core::Result<void> {
      const auto anchor = view(anchors_[a]);
      if (!anchor) return tl::unexpected(anchor.error());
      outlines_[a] = outline_of(*anchor);
      if (a < kept_.size()) kept_[a] = anchor->frame;
      return {};
    });
    if (done) partners_ = choose_pairs(frames_, anchors_, outlines_, cameras_);
    return done;
  }

  core::Result<void> measure_noise() {
    std::vector<PairRows> next(anchors_.size());
    auto done = for_anchors([&](std::size_t a) -> core::Result<void> {
      if (!partners_[a].next) return {};
      auto first = anchor_view(a);
      const auto second = view(*partners_[a].next);
      if (!first || !second) return tl::unexpected((first ? second : first).error());
      next[a] = FirstView(std::move(*first)).depth_rows(*second);
      return {};
    });
    noise_ = noise_of(next);
    return done;
  }

  core::Result<void> align() {
    std::vector<std::array<std::vector<AlignedPair>, kGaps>> aligned(anchors_.size());
    auto done = for_anchors([&](std::size_t a) -> core::Result<void> {
      auto loaded = anchor_view(a);
      if (!loaded) return tl::unexpected(loaded.error());
      FirstView first(std::move(*loaded));

      // Its partners, one gap after the other.
      for (std::size_t gap = 0; gap < kGaps; ++gap) {
        for (const std::size_t b : partners_[a].by_gap[gap]) {
          const auto second = anchor_view(b);
          if (!second) return tl::unexpected(second.error());

          if (auto pair = align(first, *second, gap)) {
            pair->first = a;
            pair->second = b;
            aligned[a][gap].push_back(*pair);
          }
        }
      }
      return {};
    });

    for (const auto& of_anchor : aligned) {
      for (std::size_t gap = 0; gap < kGaps; ++gap)
        pairs_[gap].insert(pairs_[gap].end(), of_anchor[gap].begin(), of_anchor[gap].end());
    }
    return done;
  }

  [[nodiscard]] std::optional<AlignedPair> align(FirstView& first, const View& second,
                                                 std::size_t gap) const {
    AlignedPair pair;
    PairRows rows = first.depth_rows(second);
    pair.found = rows.found;
    pair.contradicts = rows.contradicts(gap == kRevisit);
    if (pair.contradicts) return pair;
    if (!rows.meet) return std::nullopt;

    first.add_flow(second, rows);
    const sensor::Pinhole& camera = second.camera->pinhole();
    pair.both = correction_of(rows, camera, noise_, Rows::kBoth);
    pair.both.blur = blur_of(first.view().poses, second.poses, rows.distance_m());
    if (gap == kSecond && !rows.flow.empty())
      note_split(correction_of(rows, camera, noise_, Rows::kDepth),
                 correction_of(rows, camera, noise_, Rows::kFlow), pair);
    return pair;
  }

  [[nodiscard]] CheckReport summed_up() const {
    CheckReport report;
    report.anchors = anchors_.size();
    for (const Partners& partners : partners_) {
      for (const auto& gap : partners.by_gap) report.tried += gap.size();
    }
    report.noise = {noise_.a, noise_.b};
    report.told_m = input_.told_m;

    std::vector<double> distances;
    for (const Outline& outline : outlines_) distances.push_back(outline.distance_m);
    if (!distances.empty()) report.distance_m = core::median(std::move(distances));

    // Pairs that contradict the path have no shift to report; the graph counts them as refused.
    for (std::size_t gap = 0; gap < kGaps; ++gap) {
      std::vector<double> shifts, unexplained;
      for (const AlignedPair& pair : pairs_[gap]) {
        if (pair.contradicts) continue;
        shifts.push_back(pair.both.shift_m());
        unexplained.push_back(pair.both.unexplained_m());
      }

      report.align[gap] = {pairs_[gap].size(), core::quantile(shifts, 0.5, 0.0),
                           core::quantile(shifts, 0.9, 0.0), core::least_median(unexplained, 0.0)};
      report.pairs += pairs_[gap].size();
    }

    // The size of the scene is the extent of the cameras, extended by the
    // distance of the surfaces on either side.
    Eigen::AlignedBox3d box;
    for (const std::size_t a : anchors_) box.extend(frames_[a].poses.world_from_depth.translation);
    if (!anchors_.empty()) report.size_m = box.diagonal().norm() + 2.0 * report.distance_m;

    std::vector<GraphAnchor> anchors;
    for (const std::size_t a : anchors_)
      anchors.push_back({frames_[a].poses.world_from_depth, frames_[a].frame.way, frames_[a].frame.stamp});

    set_split(report);
    const GraphReport graph = set_graph(anchors, report);
    set_local(report);
    set_steps(report);

    report.untied_m = untied_length(input_.ways, ties());
    const CameraPart camera = camera_part(input_, anchors);
    report.camera_m = camera.rms_m;

    // The verdict needs all other figures, and the possible errors need the verdict.
    judge(report);
    report.samples = possible_errors(report, anchors, graph, camera);
    return report;
  }

  /// Frames that see a surface again where the path says so.
  [[nodiscard]] std::vector<Tie> ties() const {
    std::vector<Tie> all;
    for (const AlignedPair& pair : pairs_[kRevisit]) {
      const KeptFrame& a = frames_[anchors_[pair.first]].frame;
      const KeptFrame& b = frames_[anchors_[pair.second]].frame;
      if (!pair.contradicts) all.push_back({a.way, a.stamp, b.way, b.stamp});
    }
    return all;
  }

  void set_split(CheckReport& report) const {
    std::vector<double> squares, chis;
    for (const AlignedPair& pair : pairs_[kSecond]) {
      if (pair.split_chi < 0.0) continue;
      squares.push_back(pair.split_squared_m2);
      chis.push_back(pair.split_chi);
    }
    report.split_m = std::sqrt(std::max(0.0, core::quantile(squares, 0.5, 0.0)));
    report.split_chi = core::quantile(chis, 0.5, 0.0);
  }

  GraphReport set_graph(const std::vector<GraphAnchor>& anchors, CheckReport& report) const {
    // A pair that contradicts the path has no usable motion: it is not in the graph, but counts as refused.
    std::vector<PairLink> links;
    std::size_t refused = 0;

    for (const auto& pairs : pairs_) {
      for (const AlignedPair& pair : pairs) {
        if (pair.contradicts)
          ++refused;
        else
          links.push_back({pair.first, pair.second, pair.both});
      }
    }

    constexpr double kRefused = 0.3;
    GraphReport graph = put_together(anchors, links);
    report.graph_m = graph.rms_m;
    for (std::size_t a = 0; a < anchors_.size(); ++a)
      report.along.push_back({graph.shift_m[a], anchors[a].stamp, anchors[a].way});

    for (const auto& pairs : pairs_) {
      for (const AlignedPair& pair : pairs) note_along(pair, report);
    }

    // Links that the graph has given little weight contradict the others and count as refused, too.
    for (const double weight : graph.weight) refused += weight < kRefused ? 1U : 0U;
    if (report.pairs > 0) report.refused = static_cast<double>(refused) / static_cast<double>(report.pairs);
    return graph;
  }

  /// A pair's shift at both of its anchors.
  void note_along(const AlignedPair& pair, CheckReport& report) const {
    const double off_m = pair.contradicts ? contradiction_m(report) : pair.both.unexplained_m();
    for (const std::size_t a : {pair.first, pair.second})
      report.along[a].off_m = std::max(report.along[a].off_m, off_m);
  }
  /// Pairs that contradict the path are off by more than they look for surfaces.
  static double contradiction_m(const CheckReport& report) { return 0.05 + 0.04 * report.distance_m; }

  /// Shift that the thirds of a second ask for together; none if one is missing.
  [[nodiscard]] std::optional<double> shift_by_thirds(const AlignedPair& second) const {
    const geometry::Rigid3& at = frames_[anchors_[second.second]].poses.world_from_depth;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t anchor = second.first;
    for (const AlignedPair& third : pairs_[kThird]) {
      if (third.first != anchor || third.contradicts) continue;
      const geometry::Rigid3& camera = frames_[anchors_[third.second]].poses.world_from_depth;
      const Eigen::Vector3d turn = camera.rotation * third.both.motion.tail<3>();
      sum += camera.rotation * third.both.motion.head<3>() + turn.cross(at.translation - camera.translation);
      anchor = third.second;
      if (anchor == second.second) return sum.norm();
    }
    return std::nullopt;
  }

  [[nodiscard]] BadPlace place(const AlignedPair& pair, double off_m) const {
    const KeptFrame& a = frames_[anchors_[pair.first]].frame;
    const KeptFrame& b = frames_[anchors_[pair.second]].frame;
    return {off_m, 0.5 * (a.stamp + b.stamp), a.way};
  }

  /// The worst second that its thirds confirm.
  void set_local(CheckReport& report) const {
    const auto note = [&](const BadPlace& bad) {
      if (bad.off_m > report.local.off_m) report.local = bad;
    };
    for (const AlignedPair& pair : pairs_[kSecond]) {
      if (pair.contradicts) continue;
      if (const auto thirds = shift_by_thirds(pair))
        note(place(pair, std::min(pair.both.unexplained_m(), *thirds)));
    }
    for (const AlignedPair& pair : pairs_[kThird]) {
      if (pair.contradicts) note(place(pair, contradiction_m(report)));
    }
    if (report.local.off_m <= least_local(report)) report.local = {};
  }

  void set_steps(CheckReport& report) const {
    for (std::size_t w = 0; w < input_.ways.size(); ++w) {
      const geometry::Trajectory& path = input_.ways[w].path;
      std::vector<double> steps, speeds;
      for (std::size_t i = 1; i < path.size(); ++i) {
        steps.push_back(
            (path[i].world_from_camera.translation - path[i - 1].world_from_camera.translation).norm());
        report.path_m += steps.back();
        speeds.push_back(steps.back() / std::max(1e-3, path[i].stamp - path[i - 1].stamp));
      }
      for (std::size_t i = 0; i < steps.size(); ++i) {
        if (steps[i] > kShortestTear_m && is_tear(speeds, i, w, path[i].stamp, path[i + 1].stamp))
          report.tears.push_back({steps[i], path[i + 1].stamp, w});
      }
    }
  }

  /// No camera is carried at 5 m/s; a step that is fast beside its neighbours is a tear if the pictures
  /// around it say so, or show nothing in common.
  [[nodiscard]] bool is_tear(const std::vector<double>& speeds, std::size_t i, std::size_t way, double from,
                             double to) const {
    constexpr double kFastest_m_s = 5.0;
    constexpr double kTimesMedian = 10.0;
    constexpr double kContradicted_m = 0.02;
    constexpr double kNeighbours_s = 0.1;
    constexpr double kMostlyFound = 0.6;
    constexpr double kContradicted_rad = 0.05;  // of what lies before the camera a shift is much like a turn
    constexpr std::size_t kAround = 15;

    if (speeds[i] > kFastest_m_s) return true;
    const std::size_t begin = i > kAround ? i - kAround : 0, end = std::min(speeds.size(), i + kAround + 1);
    std::vector<double> around(speeds.begin() + static_cast<std::ptrdiff_t>(begin),
                               speeds.begin() + static_cast<std::ptrdiff_t>(end));
    if (speeds[i] <= kTimesMedian * core::median(std::move(around))) return false;

    for (const AlignedPair& pair : pairs_[kThird]) {
      const KeptFrame& a = frames_[anchors_[pair.first]].frame;
      const KeptFrame& b = frames_[anchors_[pair.second]].frame;
      if (a.way != way || a.stamp > from + 1e-6 || b.stamp < to - 1e-6) continue;
      return pair.contradicts || pair.found < kMostlyFound || pair.both.shift_m() > kContradicted_m ||
             pair.both.motion.tail<3>().norm() > kContradicted_rad;
    }
    // After the last anchor nothing was aligned: that says nothing.
    const bool between = std::any_of(anchors_.begin(), anchors_.end(), [&](std::size_t a) {
      return frames_[a].frame.way == way && frames_[a].frame.stamp > to - 1e-6;
    });
    return between && to - from < kNeighbours_s;
  }

  const CheckInput& input_;
  const core::Executor& executor_;
  std::vector<SmallCamera> cameras_;  ///< by way
  std::vector<PosedFrame> frames_;
  std::vector<std::size_t> anchors_;  ///< among frames_
  std::vector<SmallFrame> kept_;      ///< images of the first anchors
  std::vector<Outline> outlines_;     ///< by anchor
  std::vector<Partners> partners_;    ///< by anchor
  DepthNoise noise_;
  std::array<std::vector<AlignedPair>, kGaps> pairs_;
};

}  // namespace

core::Result<CheckReport> check_path(const CheckInput& input, const core::Executor& executor) {
  return Check(input, executor).run();
}

}  // namespace plumbline::check
