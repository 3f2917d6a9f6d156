// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Plans and sections of a map, each on its sheet.
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "drawings/plan_drawing.hpp"
#include "plumbline/exports/view.hpp"
#include "source/georeference.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// Walls, openings, rooms and furniture of the selected part of a map at --cut over its floor. Errors
/// (kInput): no normals, no walls.
core::Result<plans::WallPlan> plan_of(MapSource& source);
/// Sentences on what the plan holds.
std::vector<std::string> notes_of(const plans::WallPlan& plan);
using TitleRows = std::vector<std::pair<std::string, std::string>>;
/// Texts of the title block: as the options tell them, then `rows`. Errors: kUsage, kInput (--title-block).
core::Result<void> add_facts(const MapSource& source, const TitleRows& rows, SheetFacts& facts);
using DrawContent = std::function<void(const PlanStyle&, const PlanLayers&, Drawing&)>;
/// Draws the content in each scale until a sheet holds it. Errors (kUsage): none does; a layer that is not
/// there.
core::Result<Drawing> sheet_of(const ExportOptions& options, const SheetFacts& facts,
                               const plans::WallPlan& plan, double unit, const DrawContent& draw);
core::Result<Drawing> section_sheet(MapSource& source, ExportSummary& summary);
/// The plan without a sheet around it.
PlanPage plan_page(const plans::WallPlan& plan, const std::string& name);
/// A sheet for each storey that is selected, lowest first, and what was found.
core::Result<std::vector<Drawing>> plan_sheets(MapSource& source, const std::optional<Georeference>& world,
                                               ExportSummary& summary);

}  // namespace plumbline::exports
