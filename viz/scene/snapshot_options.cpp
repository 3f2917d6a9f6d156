// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/snapshot.hpp"

namespace plumbline::viz {
namespace {

const std::vector<std::pair<std::string, View>>& views() {
  static const std::vector<std::pair<std::string, View>> kViews{
      {"iso", View::kIso},   {"top", View::kTop},   {"bottom", View::kBottom}, {"front", View::kFront},
      {"back", View::kBack}, {"left", View::kLeft}, {"right", View::kRight},   {"explicit", View::kExplicit}};
  return kViews;
}

const std::vector<std::pair<std::string, ColorMode>>& color_modes() {
  static const std::vector<std::pair<std::string, ColorMode>> kModes{
      {"rgb", ColorMode::kRgb},     {"height", ColorMode::kHeight}, {"normal", ColorMode::kNormal},
      {"robot", ColorMode::kRobot}, {"error", ColorMode::kError},   {"confidence", ColorMode::kConfidence},
      {"sigma", ColorMode::kSigma}};
  return kModes;
}

template <typename Value>
std::string name_of(const std::vector<std::pair<std::string, Value>>& names, Value value) {
  for (const auto& [name, v] : names) {
    if (v == value) return name;
  }
  return "";
}

}  // namespace

std::string view_name(View view) { return name_of(views(), view); }
std::string color_mode_name(ColorMode mode) { return name_of(color_modes(), mode); }

void SnapshotOptions::declare(core::OptionTable& table) {
  table.choice("view", view, views(), "Viewpoint");
  table.choice("color", color, color_modes(), "Meaning of the points' colours");
  table.integer("width", width_px, {64, 8192}, "px", "Picture width");
  table.integer("height", height_px, {64, 8192}, "px", "Picture height");
  table.number("point_size", point_size_px, {0.0, 50.0}, "px",
               "Point size; 0: large enough to close surfaces");
  table.boolean("cull_back_faces", cull_back_faces, "Omit points that face away, to look into rooms");
  table.boolean("shading", shading, "Shade slightly by normal, to show structure on white walls");
  table.boolean("annotations", annotations, "Title, legend, scale bar, axes and colour bar");
}

}  // namespace plumbline::viz
