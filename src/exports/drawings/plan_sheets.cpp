// SPDX-License-Identifier: BSD-3-Clause
#include "drawings/plan_sheets.hpp"

#include <fmt/chrono.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "plumbline/core/config.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/core/version.hpp"

namespace plumbline::exports {
namespace {

/// The selected part of the cameras' paths, thinned; those are left out that only a cloud is known of.
void draw_path(const MapSource& source, std::size_t layer, Drawing& drawing) {
  constexpr double kStep_m = 0.05;
  const auto poses = source.poses(false);
  if (!poses) return;
  std::int32_t robot = -1;
  for (const ExportPose& pose : *poses) {
    const Eigen::Vector2d at = pose.world_from_camera.translation.head<2>();
    if (robot != pose.robot) {
      drawing.lines.push_back({layer, {at}, false, false});
      robot = pose.robot;
    } else if ((at - drawing.lines.back().points.back()).norm() > kStep_m) {
      drawing.lines.back().points.push_back(at);
    }
  }
  const auto single = [&](const DrawnLine& line) { return line.layer == layer && line.points.size() < 2; };
  drawing.lines.erase(std::remove_if(drawing.lines.begin(), drawing.lines.end(), single),
                      drawing.lines.end());
}

/// The day of the first frame in world time, if its stamp can be one.
std::string recorded_on(const MapSource& source) {
  constexpr double kFirst_s = 9.5e8, kLast_s = 4.1e9;  // 2000 to 2100
  const auto poses = source.poses(true);
  if (!poses || poses->empty()) return {};
  double first = poses->front().stamp;
  for (const ExportPose& pose : *poses) first = std::min(first, pose.stamp);
  if (!(first > kFirst_s && first < kLast_s)) return {};
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(static_cast<std::time_t>(first)));
}

/// Words of layers' names that --without may name.
std::set<std::string> layer_words(const DrawingLayer& layer) {
  std::set<std::string> words;
  const std::string name = core::lower(layer.name.substr(2));
  for (std::size_t from = 0; from <= name.size();) {
    const std::size_t to = std::min(name.find('-', from), name.size());
    words.insert(name.substr(from, to - from));
    from = to + 1;
  }
  return words;
}

/// Layers to leave out, by name.
core::Result<std::set<std::string>> layers_without(const std::string& list, const Drawing& drawing) {
  std::set<std::string> all, out;
  for (const DrawingLayer& layer : drawing.layers) all.merge(layer_words(layer));
  for (std::size_t from = 0; from <= list.size();) {
    const std::size_t to = std::min(list.find(',', from), list.size());
    const std::string word = core::lower(list.substr(from, to - from));
    if (!word.empty() && word != "none" && all.count(word) == 0)
      return core::usage_error(fmt::format("--without {}: there is no such layer (they are: {}; none)", word,
                                           fmt::join(all, ", ")));
    if (!word.empty()) out.insert(word);
    from = to + 1;
  }
  return out;
}

/// The scale's denominator; 0: it is chosen to fit the sheet.
core::Result<int> scale_of(const std::string& text) {
  const std::string number = text.rfind("1:", 0) == 0 ? text.substr(2) : text;
  const bool digits = !number.empty() && number.size() < 6 &&
                      std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (text == "auto") return 0;
  if (!digits || std::stoi(number) == 0)
    return core::usage_error(fmt::format("--scale {}: is not a scale, such as 1:50", text));
  return std::stoi(number);
}

/// The plan of one storey.
core::Result<Drawing> storey_sheet(MapSource& source, const std::string& storey,
                                   const std::optional<Georeference>& world, ExportSummary& summary) {
  // Walls are found in the map's frame, then moved
  auto found = plan_of(source);
  if (!found) return tl::unexpected(found.error());
  const plans::WallPlan plan =
      world ? plans::moved(*found, world->linear().topLeftCorner<2, 2>(), world->origin.head<2>()) : *found;

  // Sentences on what was found, for the user
  const std::vector<std::string> notes = notes_of(plan);
  for (const std::string& note : notes)
    summary.notes.push_back(storey.empty() ? note : fmt::format("storey {}: {}", storey, note));

  // The title block tells storey, height of the cut and coordinates
  SheetFacts facts;
  facts.georeferenced = world.has_value();
  const std::string frame =
      world ? fmt::format("{} (EPSG:{}); x east, y north, metres", world->name, world->epsg)
            : source.frame_text().substr(source.frame_text().rfind("frame: ", 0) == 0 ? 7 : 0);
  if (auto told = add_facts(source,
                            {{"Storey", storey},
                             {"Cut at", fmt::format("{:g} m over the floor", source.options().cut_m)},
                             {"Coordinates", frame}},
                            facts);
      !told)
    return tl::unexpected(told.error());

  // Content is drawn again for every scale that is tried
  const double unit = world ? world->scale : 1.0;
  return sheet_of(source.options(), facts, plan, unit,
                  [&](const PlanStyle& style, const PlanLayers& layers, Drawing& drawing) {
                    drawing.title = fmt::format("{}: plan at {:g} m", source.name(), source.options().cut_m);
                    drawing.notes.push_back("frame: " + frame);
                    draw_walls(plan, style, layers, drawing);
                    draw_dimensions(plan, style, layers, drawing);
                    draw_labels(plan, style, layers, drawing);
                    const std::size_t before = drawing.lines.size();
                    draw_path(source, layers.path, drawing);
                    for (std::size_t i = before; world && i < drawing.lines.size(); ++i) {
                      for (Eigen::Vector2d& p : drawing.lines[i].points)
                        p = ((*world) * Eigen::Vector3d(p.x(), p.y(), 0.0)).head<2>().eval();
                    }
                  });
}

}  // namespace

/// Facts for the title block: options first, then the file of --title-block.
core::Result<void> add_facts(const MapSource& source, const TitleRows& rows, SheetFacts& facts) {
  const ExportOptions& o = source.options();
  TitleRows told{{"Title", o.title}, {"Client", o.client}, {"Address", o.address}, {"Recorded", o.date}};

  // The file may add rows of its own
  if (!o.title_block.empty()) {
    const auto file = core::read_yaml(o.title_block);
    if (!file) return tl::unexpected(file.error());

    for (const auto& [key, node] : file->entries) {
      std::string name = key;
      if (!name.empty()) name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
      if (name == "Date") name = "Recorded";
      const auto known =
          std::find_if(told.begin(), told.end(), [&](const auto& row) { return row.first == name; });
      if (known == told.end()) told.emplace_back(name, node.scalar);
      if (known != told.end() && known->second.empty()) known->second = node.scalar;
    }
  }

  // Facts that nobody gave
  facts.title = told.front().second.empty() ? source.name() : told.front().second;
  if (told[3].second.empty()) told[3].second = recorded_on(source);
  for (auto& row : told) row = {core::printable(row.first), core::printable(row.second)};
  facts.rows.assign(told.begin() + 1, told.end());
  facts.rows.insert(facts.rows.end(), rows.begin(), rows.end());
  facts.rows.emplace_back("Program", fmt::format("Plumbline {}", core::version()));
  return {};
}

/// The first sheet, from the largest scale on, that holds the drawing with all its tables.
core::Result<Drawing> sheet_of(const ExportOptions& options, const SheetFacts& facts,
                               const plans::WallPlan& plan, double unit, const DrawContent& draw) {
  const auto scale = scale_of(options.scale);
  if (!scale) return tl::unexpected(scale.error());
  const SheetOptions wanted{options.paper == "auto" ? "" : options.paper, *scale};
  Eigen::Vector2d size = Eigen::Vector2d::Zero();

  // Sizes of texts depend on the scale
  for (const int of : sheet_scales(wanted)) {
    Drawing drawing;
    drawing.sheet.scale = of;
    drawing.unit = unit;
    drawing.comma = options.decimal == "comma";
    const PlanLayers layers(drawing);
    const PlanStyle style{drawing.sheet.mm(), unit, drawing.comma};
    const auto without = layers_without(options.without, drawing);
    if (!without) return tl::unexpected(without.error());

    // Layers are removed by words of their names
    const auto is_unwanted = [&](const DrawingLayer& layer) {
      const std::set<std::string> words = layer_words(layer);
      return std::any_of(words.begin(), words.end(),
                         [&](const std::string& word) { return without->count(word) > 0; });
    };
    draw(style, layers, drawing);
    drawing.remove_layers(is_unwanted);

    // The sheet adds lines and texts on the same layers
    const auto [low, high] = drawing.bounds();
    size = high - low;
    if (!put_on_sheet(wanted, facts, style, layers, tables_of(plan, style), drawing)) continue;
    drawing.remove_layers(is_unwanted);
    drawing.break_lines();
    return drawing;
  }

  // No scale fits on the paper
  return core::usage_error(fmt::format(
      "--scale {}: what is drawn has {:.1f} x {:.1f} m, which {} does not hold beside its tables; "
      "leave --scale or --paper out",
      options.scale, size.x(), size.y(), wanted.paper.empty() ? "A0" : wanted.paper));
}

/// The plan as a part of a page, at the largest scale that fits.
PlanPage plan_page(const plans::WallPlan& plan, const std::string& name) {
  constexpr double kWidest_mm = 182.0, kTallest_mm = 150.0, kAround_mm = 3.0;
  PlanPage page;
  Drawing drawing;

  // The drawing alone decides on the scale
  for (const int scale : sheet_scales({})) {
    drawing = {};
    drawing.title = name;
    drawing.sheet.scale = scale;
    const double mm = drawing.sheet.mm();
    const PlanLayers layers(drawing);
    draw_walls(plan, {mm}, layers, drawing);
    draw_dimensions(plan, {mm}, layers, drawing);
    draw_labels(plan, {mm}, layers, drawing);

    // The page is as large as the drawing
    const auto [low, high] = drawing.bounds();
    drawing.sheet.low = low.array() - kAround_mm * mm;
    drawing.sheet.width_mm = (high.x() - low.x()) / mm + 2.0 * kAround_mm;
    drawing.sheet.height_mm = (high.y() - low.y()) / mm + 2.0 * kAround_mm;
    if (drawing.sheet.width_mm <= kWidest_mm && drawing.sheet.height_mm <= kTallest_mm) break;
  }

  // Tables are the page's, not the drawing's
  drawing.break_lines();
  page.svg = svg_text(drawing);
  for (SheetTable& table : tables_of(plan, {})) {
    page.tables.push_back({std::move(table.title), {}, std::move(table.rows)});
    for (auto& [column, width] : table.columns) page.tables.back().columns.push_back(std::move(column));
  }
  return page;
}

core::Result<std::vector<Drawing>> plan_sheets(MapSource& source, const std::optional<Georeference>& world,
                                               ExportSummary& summary) {
  std::vector<Drawing> pages;
  const ExportOptions& o = source.options();
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  const std::size_t storeys =
      o.storey < 0 && o.box.empty() && o.z.empty() ? floor_heights(*(*cloud)->cloud).size() : 1;
  if (storeys < 2) {
    auto page = storey_sheet(source, o.storey < 0 ? "" : std::to_string(o.storey), world, summary);
    if (!page) return tl::unexpected(page.error());
    return std::vector<Drawing>{std::move(*page)};
  }

  // Storeys without walls, such as a landing, are told and left out.
  core::Error last;

  for (std::size_t k = 0; k < storeys; ++k) {
    ExportRequest request = source.request();
    request.options.storey = static_cast<int>(k);
    const ExportProgress progress = [&](std::size_t done, std::size_t total) {
      source.progress(done, total);
    };
    auto storey = MapSource::open(request, source.executor(), source.log(), progress);
    if (!storey) return tl::unexpected(storey.error());
    auto page = storey_sheet(*storey, std::to_string(k), world, summary);

    if (!page && page.error().kind != core::ErrorKind::kInput) return tl::unexpected(page.error());
    if (!page) {
      summary.notes.push_back(fmt::format("storey {} is left out: {}", k, page.error().message));
      last = page.error();
      continue;
    }
    pages.push_back(std::move(*page));
  }
  if (pages.empty()) return tl::unexpected(last);
  return pages;
}

}  // namespace plumbline::exports
