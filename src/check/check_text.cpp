// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "plumbline/check/self_check.hpp"
#include "plumbline/core/json.hpp"

namespace plumbline::check {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, kGaps> kNames{"third_s", "one_s", "three_s", "revisit"};
constexpr std::array<const char*, kGaps> kTexts{"frames 1/3 s apart", "frames 1 s apart", "frames 3 s apart",
                                                "revisits"};

/// Micrometres.
double rounded_m(double value) { return std::round(value * 1e6) / 1e6; }

Json json_of(const BadPlace& place) {
  return {{"off_m", rounded_m(place.off_m)}, {"stamp", place.stamp}, {"robot", place.way}};
}

std::string mm(double metres) { return fmt::format("{:.{}f} mm", 1000.0 * metres, metres < 0.01 ? 1 : 0); }

}  // namespace

std::string shape_sentence(const std::optional<Shape>& shape, const std::vector<std::string>& unchecked) {
  // "drift: nothing was seen twice" is what, and why.
  std::string what, why;
  for (const std::string& one : unchecked) {
    const std::size_t colon = one.find(": ");
    what += (what.empty() ? "" : ", ") + one.substr(0, colon);
    if (colon != std::string::npos) why += (why.empty() ? ": " : "; ") + one.substr(colon + 2);
  }
  const std::string rest = what.empty() ? "" : fmt::format("; {} unchecked{}", what, why);
  if (!shape) return fmt::format("No reason to doubt this result was found{}.", rest);
  return fmt::format("Shape ± {} (95 %: {}), lengths {:.2g} %{}.", mm(shape->expected_m), mm(shape->p95_m),
                     100.0 * shape->lengths, rest);
}

std::string sentence(const CheckReport& report) {
  if (!report.reasons.empty()) return fmt::format("Not trustworthy: {}.", fmt::join(report.reasons, "; "));
  if (!report.checked()) return shape_sentence({}, report.unchecked);
  return shape_sentence(Shape{report.expected_m, report.p95_m, report.lengths}, report.unchecked);
}

std::string to_text(const CheckReport& report) {
  std::string text = sentence(report) + "\n";
  const auto line = [&](const std::string& name, const std::string& value) {
    text += fmt::format("{:<22} {}\n", name, value);
  };
  line("expected error", fmt::format("{}, 95 %: {}", mm(report.expected_m), mm(report.p95_m)));
  if (report.drift_m > 0.0)
    line("drift", fmt::format("{}: nothing was seen twice on {:.1f} of {:.1f} m", mm(report.drift_m),
                              report.untied_m, report.path_m));
  if (report.camera_m > 0.0) line("camera's uncertainty", mm(report.camera_m));
  line("told by the estimate", report.told_m > 0.0 ? mm(report.told_m) : "nothing");

  line("graph of corrections", fmt::format("{} RMS over {} frames", mm(report.graph_m), report.anchors));

  // Distances by which frames are off, by the time between them.
  for (std::size_t gap = 0; gap < kGaps; ++gap) {
    const GapReport& align = report.align[gap];
    line(kTexts[gap], align.pairs == 0 ? "none"
                                       : fmt::format("{} off, 90 %: {}, {} pairs", mm(align.median_m),
                                                     mm(align.p90_m), align.pairs));
  }

  // Contradictions of the path as a whole, and where.
  line("pairs refused", fmt::format("{:.1f} %", 100.0 * report.refused));
  line("depth against colour", fmt::format("{}, {:.1f} sigma", mm(report.split_m), report.split_chi));
  line("worst place", report.local.off_m > 0.0
                          ? fmt::format("{} off at {:.2f} s", mm(report.local.off_m), report.local.stamp)
                          : "none stands out");

  for (const BadPlace& tear : report.tears)
    line("tear", fmt::format("{} at {:.3f} s", mm(tear.off_m), tear.stamp));
  line("noise of depth",
       fmt::format("{:.2f} mm + {:.2f} mm z²", 1e3 * report.noise[0], 1e3 * report.noise[1]));
  return text;
}

std::string to_json(const CheckReport& report) {
  Json align = Json::object();
  for (std::size_t gap = 0; gap < kGaps; ++gap) {
    const GapReport& one = report.align[gap];
    align[kNames[gap]] = {{"pairs", one.pairs},
                          {"median_m", rounded_m(one.median_m)},
                          {"p90_m", rounded_m(one.p90_m)},
                          {"unexplained_m", rounded_m(one.unexplained_m)}};
  }

  Json tears = Json::array();
  for (const BadPlace& tear : report.tears) tears.push_back(json_of(tear));
  Json along = Json::array();
  for (const BadPlace& place : report.along) along.push_back(json_of(place));

  // Lengths are in metres, rounded to a micrometre: further digits are noise.
  const Json all = {{"sentence", sentence(report)},
                    {"expected_m", rounded_m(report.expected_m)},
                    {"p95_m", rounded_m(report.p95_m)},
                    {"lengths", std::round(report.lengths * 1e5) / 1e5},
                    {"trusted", report.reasons.empty()},
                    {"reasons", report.reasons},
                    {"unchecked", report.unchecked},
                    {"told_m", rounded_m(report.told_m)},
                    {"camera_m", rounded_m(report.camera_m)},
                    {"untied_m", rounded_m(report.untied_m)},
                    {"drift_m", rounded_m(report.drift_m)},
                    {"graph_m", rounded_m(report.graph_m)},
                    {"align", align},
                    {"revisits", report.align[kRevisit].pairs},
                    {"refused", std::round(report.refused * 1e4) / 1e4},
                    {"split_m", rounded_m(report.split_m)},
                    {"split_chi", std::round(report.split_chi * 1e3) / 1e3},
                    {"local", report.local.off_m > 0.0 ? json_of(report.local) : Json(nullptr)},
                    {"tears", tears},
                    {"along", along},
                    {"noise", {{"a_m", rounded_m(report.noise[0])}, {"b_per_m", rounded_m(report.noise[1])}}},
                    {"distance_m", rounded_m(report.distance_m)},
                    {"path_m", rounded_m(report.path_m)},
                    {"size_m", rounded_m(report.size_m)},
                    {"anchors", report.anchors},
                    {"pairs", report.pairs}};
  return core::json_text(all);
}

}  // namespace plumbline::check
