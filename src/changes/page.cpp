// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viewer/page.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "output.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/text.hpp"
#include "point_search.hpp"

namespace plumbline::changes {
namespace {

constexpr const char* kPageStyle =
    "body{margin:0;display:flex;height:100vh;font:15px/1.4 sans-serif;color-scheme:light dark}"
    "nav{width:22rem;overflow:auto;padding:0 1rem}main{flex:1;min-width:0;overflow:auto}"
    "main .pv{height:100%}li{margin:.4rem 0}button{font:inherit;text-align:left;cursor:pointer}"
    "small{opacity:.75}@media(max-width:50rem){body{display:block;height:auto}nav{width:auto}main{height:"
    "80vh}}";

/// A click shows the change from aslant above.
constexpr const char* kPageScript =
    "document.querySelectorAll('button[data-at]').forEach((b)=>b.addEventListener('click',()=>{"
    "const v=document.querySelector('.pv').viewer.view,[x,y,z,d]=b.dataset.at.split(' "
    "').map(Number),o=v.base;"
    "v.camera.look('orbit');v.camera.target=[x-o[0],y-o[1],z-o[2]];v.camera.distance=d;v.camera.pitch=-0.6;"
    "v.setLayer('change');v.changed();}));\n";

/// Text with the characters escaped that HTML gives a meaning.
std::string markup(const std::string& text) {
  std::string out;
  for (const char c : core::printable(text)) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

/// Two layers: kind and shift of the place nearest to each point.
void add_layers(viewer::Points& points, const Comparison& comparison, const Shown& shown, bool later,
                const core::Executor& executor) {
  constexpr float kReach2 = 0.06F * 0.06F;
  constexpr std::size_t kBlock = 4096;

  // Places that this cloud can show
  std::vector<Eigen::Vector3f> at;
  std::vector<const Place*> places;

  for (const Place& place : comparison.places) {
    if (place.later && !later) continue;
    if (later && (place.kind == PlaceKind::kVanished || place.kind == PlaceKind::kNotSeenAfter)) continue;
    at.push_back(place.at);
    places.push_back(&place);
  }
  const PointSearch search(at);

  // A moved object is shown as a kind by itself
  viewer::Layer kind{"change", "Change", "", viewer::Scale::kCategory};
  for (int k = 0; k < 6; ++k) kind.names.emplace_back(name_of(static_cast<PlaceKind>(k)));
  kind.names.emplace_back("moved");
  viewer::Layer way{"way", "Way along the normal", "m", viewer::Scale::kLinear, -0.03, 0.03, 60};
  kind.values.assign(points.positions.size(), std::nanf(""));
  way.values = kind.values;

  // Points and places have different origins
  const Eigen::Vector3f shift =
      (Eigen::Vector3d(points.shift[0], points.shift[1], points.shift[2]) - shown.shift).cast<float>();

  // Points far from any place keep no value
  executor.parallel_for((points.positions.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    PointSearch::Found found;
    for (std::size_t i = block * kBlock; i < std::min(points.positions.size(), (block + 1) * kBlock); ++i) {
      const auto& [x, y, z] = points.positions[i];
      search.nearest(Eigen::Vector3f(x, y, z) + shift, 1, found);
      if (found.empty() || found.front().second > kReach2) continue;
      const Place& place = *places[found.front().first];

      const bool moved =
          place.change >= 0 &&
          comparison.changes[static_cast<std::size_t>(place.change)].kind == ChangeKind::kMoved;
      kind.values[i] = moved ? 6.0F : static_cast<float>(place.kind);
      way.values[i] = place.distance.shift_m;
    }
  });

  points.layers.push_back(std::move(kind));
  points.layers.push_back(std::move(way));
}

/// Changes as buttons that turn the view to them.
std::string list_html(const Comparison& comparison, const Shown& shown, bool z_up) {
  std::string html;
  for (const Change& change : comparison.changes) {
    const Eigen::Vector3d at = viewer::upright(change.box().center() + shown.shift, z_up);
    const double far = std::max(2.0, 2.5 * change.box().diagonal().norm());
    html += fmt::format(
        "<li><button data-at=\"{:.3f} {:.3f} {:.3f} {:.2f}\">{}</button> "
        "<small>at {:.2f} {:.2f} {:.2f}</small></li>\n",
        at.x(), at.y(), at.z(), far, markup(text_of(change)), at.x(), at.y(), at.z());
  }
  return html.empty() ? "<p>Nothing has changed that both maps show.</p>" : "<ol>\n" + html + "</ol>\n";
}

}  // namespace

/// The page changes.html: list of changes and both clouds in one view.
core::Result<void> write_page(const std::filesystem::path& folder, const Comparison& comparison,
                              const Shown& shown, viewer::Scene& scene, const core::Executor& executor) {
  add_layers(scene.clouds[0], comparison, shown, false, executor);
  add_layers(scene.clouds[1], comparison, shown, true, executor);
  const std::string still =
      "<p>This browser has no WebGL 2 or runs no scripts: top.png and iso.png show the map.</p>";
  const std::string title = markup(shown.before + " -> " + shown.after);

  // A page without outside files works offline
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>\n"
      "<meta name=\"generator\" content=\"plumbline compare\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
      title + "</title>\n<style>" + kPageStyle +
      "</style></head>\n<body>\n<nav><h1>What has changed</h1>\n<p>" + title + "</p>\n";

  // The list, then the viewer with both clouds
  html += list_html(comparison, shown, scene.z_up);
  html += fmt::format("<p>{}. In the median a shift of {:.1f} mm shows (95 %).</p>\n", markup(shown.placing),
                      1000.0 * comparison.median_limit_m);
  html += "</nav>\n<main>" + viewer::fragment(scene, still) + "</main>\n<script>" + kPageScript +
          "</script>\n</body></html>\n";
  return core::write_file(folder / "changes.html", html);
}

}  // namespace plumbline::changes
