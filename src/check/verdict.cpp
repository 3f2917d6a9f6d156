// SPDX-License-Identifier: BSD-3-Clause
#include "verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace plumbline::check {
namespace {

/// Coefficients of the expected error, found on the recordings that docs/method/trust.md names.
constexpr double kGraph = 1.3;
constexpr double kRevisits = 0.15;
constexpr double kLocal = 0.35;
constexpr double kThirds = 1.3;
constexpr double kSeconds = 0.5;
constexpr double kP95 = 1.8;
/// Standard deviations are told relative to the first keyframe: fitted to each other paths differ by less.
constexpr double kTold = 0.5;
/// The camera's part, if it is known, takes the place of what the estimate tells; pairs see some of it, too.
constexpr double kCamera = 1.4;
constexpr double kBesideCamera = 0.7;
/// Share of the length that nothing ties by which it may drift.
constexpr double kDrift = 0.0005;
constexpr double kMostlyTied = 0.5;   ///< more than this share is untied: that is told
constexpr double kShortPath_m = 5.0;  ///< and more than this

/// Limits beyond which a path is not trusted; shares are of the distance.
struct Limit {
  double metres;
  double share;
  [[nodiscard]] double at(double distance_m) const { return std::max(metres, share * distance_m); }
};
constexpr Limit kMostThirds{0.011, 0.0065};
constexpr Limit kMostSeconds{0.015, 0.010};
constexpr Limit kMostThreeSeconds{0.033, 0.0125};
constexpr Limit kMostLocal{0.020, 0.010};
/// The limit of the expected error is a share of the path's length, within bounds.
constexpr double kMostOfPath = 0.0045;
constexpr double kLeastLimit_m = 0.018;
constexpr double kMostLimit_m = 0.09;
constexpr double kMostRefused = 0.3;  ///< and one pair
constexpr double kMostChi = 25.0;
constexpr std::size_t kEnoughPairs = 4;
constexpr std::size_t kEnoughTried = 6;  ///< of so many some shows a surface twice

double squared(double value) { return value * value; }

double worst_tear(const CheckReport& report) {
  double worst = 0.0;
  for (const BadPlace& tear : report.tears) worst = std::max(worst, tear.off_m);
  return worst;
}

/// Median of a gap that has enough pairs: of all that they are off, or of what their motion does not explain.
using Median = double GapReport::*;
double typical_m(const CheckReport& report, Gap gap, Median median = &GapReport::median_m) {
  return report.align[gap].pairs >= kEnoughPairs ? report.align[gap].*median : 0.0;
}

/// Error that pairs show. Depth against colour and the shifts over three seconds add nothing to these.
double seen_m(const CheckReport& r, Median median = &GapReport::median_m) {
  return std::sqrt(squared(kGraph * r.graph_m) + squared(kRevisits * typical_m(r, kRevisit, median)) +
                   squared(kLocal * std::max(r.local.off_m, worst_tear(r))) +
                   squared(kThirds * r.align[kThird].*median) +
                   squared(kSeconds * typical_m(r, kSecond, median)));
}

double expected_m(const CheckReport& r) {
  if (r.camera_m > 0.0) return std::hypot(kBesideCamera * seen_m(r), kCamera * r.camera_m, r.drift_m);
  return std::hypot(seen_m(r), kTold * r.told_m, r.drift_m);
}

/// "drift: nothing was seen twice on 43 of 61 m"; empty: nearly all of the path is tied.
std::string drift_unchecked(const CheckReport& report) {
  if (report.align[kRevisit].pairs == 0) return "drift: nothing was seen twice";
  if (report.untied_m < std::max(kShortPath_m, kMostlyTied * report.path_m)) return {};
  return fmt::format("drift: nothing was seen twice on {:.0f} of {:.0f} m", report.untied_m, report.path_m);
}

/// "frames a second apart are 2.1 cm off each other", if that is beyond the limit.
void doubt_gap(const CheckReport& report, Gap gap, const Limit& limit, const char* apart,
               std::vector<std::string>& reasons) {
  const GapReport& align = report.align[gap];
  if (typical_m(report, gap, &GapReport::unexplained_m) <= limit.at(report.distance_m)) return;
  reasons.push_back(
      fmt::format("frames {} apart are {:.1f} cm off each other", apart, 100.0 * align.median_m));
}

}  // namespace

double least_local(const CheckReport& report) {
  return std::max(0.003, 5.0 * report.align[kSecond].median_m);
}

double found_share(const CheckReport& report) {
  return (report.camera_m > 0.0 ? kBesideCamera : 1.0) * kGraph;
}
double camera_share() { return kCamera; }

void judge(CheckReport& report) {
  if (report.checked()) report.drift_m = kDrift * report.untied_m;
  report.expected_m = expected_m(report);
  report.p95_m = kP95 * report.expected_m;
  if (report.size_m > 0.0) report.lengths = std::sqrt(2.0) * report.expected_m / report.size_m;

  report.unchecked.emplace_back("scale");
  if (!report.checked()) {
    report.unchecked.emplace_back("shape: no two frames show the same surface");
    if (report.tried >= kEnoughTried)
      report.reasons.emplace_back(
          "no two frames show the same surface, such as where all depth is beyond the range");
    return;
  }

  if (std::string drift = drift_unchecked(report); !drift.empty())
    report.unchecked.push_back(std::move(drift));

  std::vector<std::string>& reasons = report.reasons;

  // The largest jump is named.
  for (const BadPlace& tear : report.tears) {
    if (tear.off_m < worst_tear(report)) continue;
    reasons.push_back(fmt::format("the path jumps by {:.1f} cm at {:.3f} s", 100.0 * tear.off_m, tear.stamp));
    break;
  }

  // Pairs of frames that do not fit, all over the path or at one place.
  if (report.refused > kMostRefused + 1.0 / static_cast<double>(report.pairs)) {
    reasons.push_back(
        fmt::format("{:.0f} % of the pairs of frames do not fit the path", 100.0 * report.refused));
  }

  if (report.local.off_m > kMostLocal.at(report.distance_m)) {
    reasons.push_back(
        fmt::format("around {:.2f} s the path is off by about {:.1f} cm: frames a second apart do not fit",
                    report.local.stamp, 100.0 * report.local.off_m));
  }

  // All pairs of one gap.
  doubt_gap(report, kThird, kMostThirds, "a third of a second", reasons);
  doubt_gap(report, kSecond, kMostSeconds, "a second", reasons);
  doubt_gap(report, kThreeSeconds, kMostThreeSeconds, "three seconds", reasons);
  if (report.split_chi > kMostChi && report.align[kSecond].pairs >= kEnoughPairs) {
    reasons.push_back(fmt::format("depth and colour ask for paths that are {:.1f} cm apart in a second",
                                  100.0 * report.split_m));
  }

  if (std::hypot(report.told_m, seen_m(report, &GapReport::unexplained_m)) >
      std::clamp(kMostOfPath * report.path_m, kLeastLimit_m, kMostLimit_m))
    reasons.push_back(fmt::format("the error to expect is {:.1f} cm", 100.0 * report.expected_m));
}

}  // namespace plumbline::check
