// SPDX-License-Identifier: BSD-3-Clause
#include "verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace plumbline::check {
namespace {

/// Coefficients of the expected error, found on the recordings that docs/method/trust.md names.
constexpr double kGraph = 1.5;
constexpr double kRevisits = 0.7;
constexpr double kSplit = 0.6;
constexpr double kLocal = 0.5;
constexpr double kP95 = 1.9;

constexpr double kMostRefused = 0.3;
constexpr double kMostAlign_m = 0.015;
constexpr double kMostAlign = 0.01;  ///< of the distance
constexpr double kMostChi = 15.0;
constexpr double kMostExpected = 0.015;  ///< of the distance

double squared(double value) { return value * value; }

}  // namespace

double least_local(const CheckReport& report) {
  return std::max(0.003, 5.0 * report.align[kSecond].median_m);
}

void judge(CheckReport& report) {
  report.expected_m = std::sqrt(squared(report.told_m) + squared(kGraph * report.graph_m) +
                                squared(kRevisits * report.align[kRevisit].median_m) +
                                squared(kSplit * report.split_m) + squared(kLocal * report.local.off_m));
  report.p95_m = kP95 * report.expected_m;

  report.unchecked.emplace_back("scale");
  if (!report.checked())
    return report.unchecked.emplace_back("shape: no two frames show the same surface"), void();
  if (report.align[kRevisit].pairs == 0) report.unchecked.emplace_back("drift: nothing was seen twice");

  std::vector<std::string>& reasons = report.reasons;
  if (!report.tears.empty()) {
    const BadPlace& worst = *std::max_element(report.tears.begin(), report.tears.end(),
                                              [](const auto& a, const auto& b) { return a.off_m < b.off_m; });
    reasons.push_back(
        fmt::format("the path jumps by {:.1f} cm at {:.3f} s", 100.0 * worst.off_m, worst.stamp));
  }
  if (report.refused > kMostRefused)
    reasons.push_back(
        fmt::format("{:.0f} % of the pairs of frames do not fit the path", 100.0 * report.refused));
  if (report.local.off_m > std::max(kMostAlign_m, kMostAlign * report.distance_m))
    reasons.push_back(
        fmt::format("around {:.2f} s the path is off by about {:.1f} cm: frames a second apart do not fit",
                    report.local.stamp, 100.0 * report.local.off_m));
  if (report.align[kSecond].median_m > std::max(kMostAlign_m, kMostAlign * report.distance_m))
    reasons.push_back(fmt::format("frames a second apart are {:.1f} cm off each other",
                                  100.0 * report.align[kSecond].median_m));
  if (report.split_chi > kMostChi)
    reasons.push_back(fmt::format("depth and colour ask for paths that are {:.1f} cm apart in a second",
                                  100.0 * report.split_m));
  if (report.expected_m > kMostExpected * report.distance_m)
    reasons.push_back(fmt::format("the expected error of {:.1f} cm is more than {:.1f} % of the distance",
                                  100.0 * report.expected_m, 100.0 * kMostExpected));
}

}  // namespace plumbline::check
