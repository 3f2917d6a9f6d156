// SPDX-License-Identifier: BSD-3-Clause
#include "summary/sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::pipeline {
namespace {

constexpr double kMostLostPercent = 10.0;
constexpr double kWorthReporting_percent = 1.0;

const Json kNoSigma = {{"median", nullptr}, {"p90", nullptr}};

constexpr std::pair<const char*, std::size_t FrameCounts::*> kFrameCounts[] = {
    {"available", &FrameCounts::available}, {"read", &FrameCounts::read},
    {"resumed", &FrameCounts::resumed},     {"unreadable", &FrameCounts::unreadable},
    {"missing", &FrameCounts::missing},     {"odometry", &FrameCounts::odometry},
    {"tracked", &FrameCounts::tracked},     {"lost", &FrameCounts::lost},
    {"blind", &FrameCounts::blind},         {"longest_loss", &FrameCounts::longest_loss}};

Json section_of(const FrameCounts& counts) {
  Json frames;
  for (const auto& [key, member] : kFrameCounts) {
    if (member == &FrameCounts::longest_loss) frames["period_s"] = counts.period_s;
    frames[key] = counts.*member;
  }
  frames["tracked_percent"] = rounded(counts.tracked_percent());
  if (counts.bridged) frames["bridged"] = *counts.bridged;
  return frames;
}

}  // namespace

FrameCounts::FrameCounts(const Json& summary) {
  const Json& frames = summary.at("frames");
  for (const auto& [key, member] : kFrameCounts) this->*member = frames.at(key).get<std::size_t>();
  period_s = frames.at("period_s").get<double>();
  if (frames.contains("bridged")) bridged = frames.at("bridged").get<std::size_t>();
}

void FrameCounts::write(Json& summary) const { summary["frames"] = section_of(*this); }

void FrameCounts::count(const std::vector<FrameRow>& rows) {
  tracked = lost = blind = longest_loss = 0;
  std::size_t loss = 0;
  for (const FrameRow& row : rows) {
    const bool is_tracked = row.state == FrameState::kTracked;
    ++(is_tracked ? tracked : lost);
    blind += row.blind ? 1U : 0U;
    loss = is_tracked ? 0 : loss + 1;
    longest_loss = std::max(longest_loss, loss);
  }
}

double FrameCounts::tracked_percent() const {
  const auto all = static_cast<double>(read + unreadable);
  return all > 0.0 ? 100.0 * static_cast<double>(tracked) / all : 0.0;
}

Json empty_sections() {
  // Readers of summary.json find every section, whichever stages a pipeline has.
  const Json none = Json::array();
  return {{"input", ""},
          {"pipeline", ""},
          {"trustworthy", true},
          {"reason", ""},
          {"verdict", Json::object()},
          {"unchecked", none},
          {"signs", none},
          {"stopped", false},
          {"frames", section_of(FrameCounts())},
          {"keyframes", 0},
          {"keyframe_causes", {{"cone", 0}, {"urgent", 0}, {"plain", 0}}},
          {"landmarks", {{"points", 0}, {"lines", 0}}},
          {"loops",
           {{"candidates", 0},
            {"verified", 0},
            {"accepted", 0},
            {"rejected", 0},
            {"relocalisations_taken_back", 0},
            {"disputes", none},
            {"list", none}}},
          {"refine",
           {{"local_maps", 0},
            {"tried", 0},
            {"accepted", 0},
            {"rejected", 0},
            {"mean_rms", 0.0},
            {"mean_shift_m", 0.0},
            {"max_shift_m", 0.0},
            {"sigma_position_m", kNoSigma},
            {"sigma_rotation_rad", kNoSigma},
            {"sigma_note", "the run has no stage refine"},
            {"before", Json::object()},
            {"after", Json::object()}}},
          {"path",
           {{"largest_step_m", 0.0}, {"largest_step_rad", 0.0}, {"refused_adjustments", 0}, {"tears", none}}},
          {"merges", none},
          {"meetings", none},
          {"robots", none},
          {"components", {{"list", none}, {"dropped", 0}, {"dropped_frames", 0}}},
          {"cloud", {{"points", 0}, {"voxel_m", 0.0}}},
          {"frame", {{"up", "none"}, {"yaw", "none"}, {"output_from_map", rows({})}}},
          {"camera", none},
          {"camera_pairs", none}};
}

double rounded(double value) { return std::round(value * 1e4) / 1e4; }

Json rows(const geometry::Rigid3& transform) {
  Json matrix = Json::array();
  const Eigen::Matrix4d values = transform.isometry().matrix();
  for (int row = 0; row < 4; ++row) {
    matrix.push_back({values(row, 0), values(row, 1), values(row, 2), values(row, 3)});
  }
  return matrix;
}

Json section_of(const Sigma& sigma) {
  const auto rounded_finely = [](double value) {
    return std::isfinite(value) ? Json(std::round(value * 1e6) / 1e6) : Json(nullptr);
  };
  return {{"median", rounded_finely(sigma.median)}, {"p90", rounded_finely(sigma.p90)}};
}

void add(Json& number, std::size_t more) { number = number.get<std::size_t>() + more; }

Json left_out_section(const std::vector<std::pair<std::string, std::size_t>>& left_out) {
  Json list = Json::array();
  for (const auto& [by, points] : left_out) list.push_back({{"by", by}, {"points", points}});
  return list;
}

std::string left_out_text(const Json& cloud) {
  if (!cloud.contains("left_out")) return {};
  const double measured = std::max(1.0, cloud.at("measured").get<double>());
  std::string text;
  for (const Json& part : cloud.at("left_out")) {
    const double percent = 100.0 * part.at("points").get<double>() / measured;
    if (percent < kWorthReporting_percent) continue;
    text +=
        fmt::format("{}{:.0f} % by {}", text.empty() ? "" : ", ", percent, part.at("by").get<std::string>());
  }
  return text.empty() ? text : text + ", of what keyframes measured (stage cloud)";
}

std::string left_out_of_map_text(const Json& cloud) {
  if (!cloud.contains("left_out_of_map")) return {};
  std::string text;
  for (const Json& part : cloud.at("left_out_of_map")) {
    const auto points = part.at("points").get<std::size_t>();
    if (points == 0) continue;
    text +=
        fmt::format("{}{} points by {}", text.empty() ? "" : ", ", points, part.at("by").get<std::string>());
  }
  return text.empty() ? text : text + ", of the merged cloud";
}

void doubt_lost_frames(const Json& summary, std::vector<Doubt>& reasons) {
  const FrameCounts frames(summary);
  const std::size_t every = frames.read + frames.unreadable + frames.missing;
  const std::size_t blind = std::min(every, frames.blind);

  if (2 * blind > every) {
    reasons.push_back(
        {Doubt::About::kLostFrames, fmt::format("nothing can be seen in {} of {} frames: no depth, or a "
                                                "picture without contrast",
                                                blind, every)});
    return;
  }

  // Frames that showed nothing could not be tracked by anything.
  const std::size_t all = every - blind;
  const std::size_t without = all - std::min(all, frames.tracked);

  const double percent = all > 0 ? 100.0 * static_cast<double>(without) / static_cast<double>(all) : 0.0;
  if (percent <= kMostLostPercent) return;
  const std::string none = frames.missing > 0 ? fmt::format(", {} without files", frames.missing) : "";
  reasons.push_back(
      {Doubt::About::kLostFrames, fmt::format("{} of {} frames have no pose ({:.1f} %; up to {:.0f} % would "
                                              "be trusted): {} lost, {} unreadable{}; "
                                              "the longest loss is {} frames",
                                              without, all, percent, kMostLostPercent, frames.lost - blind,
                                              frames.unreadable, none, frames.longest_loss)});
}

void doubt_empty_cloud(const Json& summary, std::vector<Doubt>& reasons) {
  const Json& cloud = summary.at("cloud");
  if (FrameCounts(summary).read == 0) return;
  if (!(cloud.at("voxel_m").get<double>() > 0.0) || cloud.at("points").get<std::size_t>() > 0) return;
  const std::string of_map = left_out_of_map_text(cloud);
  const std::string without = of_map.empty() ? left_out_text(cloud) : of_map;
  reasons.push_back({Doubt::About::kEmptyCloud,
                     "the cloud is empty: " +
                         (without.empty() ? "no keyframe had usable depth" : "left out were " + without)});
}

}  // namespace plumbline::pipeline
