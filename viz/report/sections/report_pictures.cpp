// SPDX-License-Identifier: BSD-3-Clause
// The pictures of a report.
#include <fmt/format.h>

#include <array>
#include <system_error>

#include "plumbline/viz/snapshot.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

namespace fs = std::filesystem;

struct Caption {
  const char* name;
  const char* text;
};
constexpr std::array<Caption, 7> kCaptions{{{"iso", "Obliquely; surfaces that face away are left out"},
                                            {"top", "From above, true to scale"},
                                            {"front", "From the front, true to scale"},
                                            {"back", "From the back, true to scale"},
                                            {"left", "From the left, true to scale"},
                                            {"right", "From the right, true to scale"},
                                            {"bottom", "From below, true to scale"}}};

/// Empty if the file is not a complete PNG.
std::string picture_html(const fs::path& file, const std::string& caption) {
  const std::string bytes = read_bytes(file);
  const bool whole = bytes.rfind("\x89PNG\r\n\x1a\n", 0) == 0 && bytes.size() > 20 &&
                     bytes.find("IEND", bytes.size() - 8) != std::string::npos;
  if (!whole) return {};
  const std::string text = viz::markup_text(caption);
  return "<figure><img alt=\"" + text + "\" src=\"data:image/png;base64," + base64(bytes) +
         "\"/><figcaption>" + text + "</figcaption></figure>\n";
}

std::size_t count_of(std::string_view what, std::string_view text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string_view::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

/// Snapshots that exist: each view in the camera's colours, then by robot.
std::string snapshots_html(ReportData& data) {
  std::string out;
  std::error_code ec;
  for (const Caption& caption : kCaptions) {
    for (const bool by_robot : {false, true}) {
      const std::string name = fmt::format("snapshots/{}{}.png", by_robot ? "robots_" : "", caption.name);
      if (!fs::exists(data.folder / name, ec)) continue;
      const std::string what =
          by_robot ? std::string(caption.text) + "; colours show which robot saw it" : caption.text;
      const std::string picture = picture_html(data.folder / name, what);
      if (picture.empty()) data.missing.push_back(name + " " + fault_of(data.folder / name));
      out += picture;
    }
  }
  return out;
}

/// The scene of the drawn pictures: cloud and paths.
viz::Scene scene_of(const ReportData& data) {
  viz::Scene scene;
  scene.cloud = data.cloud->cloud;
  scene.title = data.name;
  for (std::size_t i = 0; i < data.paths.size(); ++i) {
    viz::CameraPath path;
    path.name = data.paths.size() > 1 ? data.paths[i].robot : std::string();
    path.trajectory = data.paths[i].poses;
    path.color = viz::category_color(data.paths[i].number);
    scene.paths.push_back(std::move(path));
  }
  return scene;
}

core::Result<std::string> drawn_html(const ReportData& data, const fs::path& scratch) {
  const viz::Scene scene = scene_of(data);
  viz::SnapshotOptions options;
  if (data.z_up) options.up = Eigen::Vector3d::UnitZ();
  std::string out;
  for (const auto& [view, caption] : {std::pair{viz::View::kIso, kCaptions[0]},
                                      {viz::View::kTop, kCaptions[1]},
                                      {viz::View::kFront, kCaptions[2]}}) {
    options.view = view;
    const auto drawn = viz::render_snapshot(scene, options, scratch);
    if (!drawn) return tl::unexpected<core::Error>(drawn.error());
    out += picture_html(scratch, caption.text);

    // The page holds a copy.
    std::error_code ignored;
    fs::remove(scratch, ignored);
  }
  return out;
}

}  // namespace

core::Result<std::string> pictures_html(ReportData& data, const fs::path& scratch) {
  std::string out = snapshots_html(data);
  if (out.empty()) {
    // Drawn now if the run drew none.
    if (!data.extent) return std::string();
    auto drawn = drawn_html(data, scratch);
    if (!drawn) return drawn;
    out = std::move(*drawn);
  }
  const bool even = count_of("<figure>", out) % 2 == 0;
  return std::string(even ? "<div class=\"pictures even\">" : "<div class=\"pictures\">") + out + "</div>\n";
}

}  // namespace plumbline::report
