// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A plan as a drawing, and the sheet around it.
#include <string>
#include <utility>
#include <vector>

#include "drawings/drawing.hpp"
#include "drawings/labels.hpp"
#include "plumbline/plans/plan.hpp"

namespace plumbline::exports {

/// Layers of a plan, by their numbers in the drawing; names as the AIA's guideline has them.
struct PlanLayers {
  std::size_t grid, furniture, hatch, assumed, area, path, wall, glazing, door, dimensions, anno;
  explicit PlanLayers(Drawing& drawing);
};

/// Sizes and forms of what is written.
struct PlanStyle {
  double mm = 0.05;   ///< of the paper, in units of the plan
  double unit = 1.0;  ///< of the plan for a metre
  bool comma = false;

  /// A number with so many decimals.
  [[nodiscard]] std::string number(double value, int decimals) const;
};

/// Walls, openings, furniture.
void draw_walls(const plans::WallPlan& plan, const PlanStyle& style, const PlanLayers& layers,
                Drawing& drawing);
/// Chains along the sides of rooms and along other walls.
void draw_dimensions(const plans::WallPlan& plan, const PlanStyle& style, const PlanLayers& layers,
                     Drawing& drawing);
/// Numbers of rooms with their areas, and of openings.
void draw_labels(const plans::WallPlan& plan, const PlanStyle& style, const PlanLayers& layers,
                 Drawing& drawing);
/// Numbers of openings as they are on the plan: D1, P1, W1.
std::vector<std::string> opening_numbers(const plans::WallPlan& plan);

/// The plan as JSON, described on the format's page.
std::string plan_json(const plans::WallPlan& plan, const std::string& frame, double floor_m, double cut_m);

/// A table of a sheet; widths of columns in mm.
struct SheetTable {
  std::string title;
  std::vector<std::pair<std::string, double>> columns;
  std::vector<std::vector<std::string>> rows;
};
/// Rooms, then openings.
std::vector<SheetTable> tables_of(const plans::WallPlan& plan, const PlanStyle& style);

struct SheetOptions {
  std::string paper;  ///< "A4" to "A0"; empty: A3, or the next that holds the drawing
  int scale = 0;      ///< 0: the largest of the usual ones that fits
};
/// Texts of the title block, by name, and what the legend explains.
struct SheetFacts {
  std::string title;
  std::vector<std::pair<std::string, std::string>> rows;
  bool georeferenced = false;  ///< y is north
};
/// Scales to try, in order, as the options allow.
std::vector<int> sheet_scales(const SheetOptions& options);
/// Puts frame, title block, legend, scale bar, grid and tables around the drawing, on the first paper that
/// holds it; false: none does.
bool put_on_sheet(const SheetOptions& options, const SheetFacts& facts, const PlanStyle& style,
                  const PlanLayers& layers, const std::vector<SheetTable>& tables, Drawing& drawing);

}  // namespace plumbline::exports
