// SPDX-License-Identifier: BSD-3-Clause
// DXF R2000 (AC1015): a file that CAD programs open without mending. Lengths are metres.
#include <algorithm>
#include <array>
#include <cmath>

#include "drawings/drawing.hpp"
#include "drawings/dxf_text.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::exports {
namespace {

/// Line types of the file; lengths of dashes are in metres of the drawing.
void put_line_types(DxfText& dxf, double mm) {
  begin_table(dxf, "LTYPE", "5", 4);
  for (const char* name : {"ByBlock", "ByLayer", "Continuous", "DASHED"}) {
    const bool dashed = std::string(name) == "DASHED";
    begin_entry(dxf, "LTYPE", nullptr, "5", "AcDbLinetypeTableRecord", name);
    dxf.put(70, 0);
    dxf.put(3, dashed ? "__ __ __" : "");
    dxf.put(72, 65);
    dxf.put(73, dashed ? 2 : 0);
    dxf.put(40, dashed ? 3.2 * mm : 0.0);

    // A dash and a gap
    for (const double part : {2.0 * mm, -1.2 * mm}) {
      if (!dashed) continue;
      dxf.put(49, part);
      dxf.put(74, 0);
    }
  }
  dxf.put(0, "ENDTAB");
}

/// The next of the widths that the form knows, hundredths of a millimetre.
int line_weight(double width_mm) {
  constexpr std::array<int, 12> kWeights{5, 9, 13, 15, 18, 20, 25, 30, 35, 40, 50, 70};
  return *std::min_element(kWeights.begin(), kWeights.end(), [&](int a, int b) {
    return std::abs(a - 100.0 * width_mm) < std::abs(b - 100.0 * width_mm);
  });
}

/// The table of layers; layer 0 must exist.
void put_layers(DxfText& dxf, const Drawing& drawing) {
  begin_table(dxf, "LAYER", "2", static_cast<int>(drawing.layers.size()) + 1);
  const auto put = [&](const DrawingLayer& layer, int weight) {
    begin_entry(dxf, "LAYER", nullptr, "2", "AcDbLayerTableRecord", layer.name);
    dxf.put(70, 0);
    dxf.put(62, layer.dxf_color);
    dxf.put(6, "Continuous");
    dxf.put(370, weight);
    dxf.put(390, "F");
  };
  put({"0"}, -3);
  for (const DrawingLayer& layer : drawing.layers) put(layer, line_weight(layer.width_mm));
  dxf.put(0, "ENDTAB");
}

/// Height of the texts of dimensions, metres.
double dimension_text(const Drawing& drawing) {
  return drawing.dimensions.empty() ? 2.0 * drawing.sheet.mm() : drawing.dimensions.front().label.height_m;
}

/// A style of dimensions whose measures are lengths on the ground.
void put_dimension_styles(DxfText& dxf, const Drawing& drawing) {
  // Heights relative to the texts' height
  const double text_m = dimension_text(drawing);
  begin_table(dxf, "DIMSTYLE", "A", 2);
  dxf.put(100, "AcDbDimStyleTable");
  for (const auto& [name, handle] : {std::pair("Standard", "27"), std::pair("PLAN", "28")}) {
    begin_entry(dxf, "DIMSTYLE", handle, "A", "AcDbDimStyleTableRecord", name);
    dxf.put(70, 0);
    for (const auto& [code, height] : {std::pair(41, 0.7), std::pair(42, 0.5), std::pair(44, 0.5),
                                       std::pair(140, 1.0), std::pair(142, 0.4)})
      dxf.put(code, height * text_m);

    // Measures in metres with three decimals
    dxf.put(144, 1.0 / drawing.unit);
    dxf.put(147, 0.4 * text_m);
    dxf.put(77, 1);
    dxf.put(271, 3);
    dxf.put(277, 2);
    dxf.put(278, static_cast<int>(drawing.comma ? ',' : '.'));
    dxf.put(340, "11");
  }
  dxf.put(0, "ENDTAB");
}

/// A block of the file: its record and its contents, whose owner the record is.
struct DxfBlock {
  std::string name, record;
  std::vector<DrawnLine> lines;
  std::vector<DrawnText> texts;
};

/// Model and paper, then symbols, then the pictures of dimensions.
std::vector<DxfBlock> dxf_blocks(const Drawing& drawing) {
  std::vector<DxfBlock> blocks{{"*Model_Space", kDxfModelBlock, {}, {}},
                               {"*Paper_Space", kDxfPaperBlock, {}, {}}};
  const auto record = [&] { return fmt::format("{:X}", 0x100 + blocks.size()); };
  for (const DrawnBlock& block : drawing.blocks) blocks.push_back({block.name, record(), block.lines, {}});
  for (std::size_t i = 0; i < drawing.dimensions.size(); ++i)
    blocks.push_back({fmt::format("*D{}", i + 1),
                      record(),
                      lines_of(drawing.dimensions[i]),
                      {drawing.dimensions[i].label}});
  return blocks;
}

/// One record for each block, which owns the block's contents.
void put_block_records(DxfText& dxf, const std::vector<DxfBlock>& blocks) {
  begin_table(dxf, "BLOCK_RECORD", kDxfBlocksTable, static_cast<int>(blocks.size()));
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    begin_entry(dxf, "BLOCK_RECORD", blocks[i].record.c_str(), kDxfBlocksTable, "AcDbBlockTableRecord",
                blocks[i].name);
    dxf.put(340, i == 0 ? "22" : i == 1 ? "1E" : "0");
  }
  dxf.put(0, "ENDTAB");
}

/// The beginning that all entities share.
void begin_entity(DxfText& dxf, const char* type, const std::string& layer, const std::string& owner,
                  bool dashed = false) {
  dxf.put(0, type);
  dxf.handle();
  dxf.put(330, owner);
  dxf.put(100, "AcDbEntity");
  if (owner == kDxfPaperBlock) dxf.put(67, 1);
  dxf.put(8, layer);
  if (dashed) dxf.put(6, "DASHED");
}

/// Two points are a LINE, all else is a polyline.
void put_line(DxfText& dxf, const DrawnLine& line, const std::string& layer, const std::string& owner) {
  if (line.points.size() == 2 && !line.closed) {
    begin_entity(dxf, "LINE", layer, owner, line.dashed);
    dxf.put(100, "AcDbLine");
    dxf.point(10, line.points[0]);
    dxf.point(11, line.points[1]);
    return;
  }

  // A polyline has a constant width of zero
  begin_entity(dxf, "LWPOLYLINE", layer, owner, line.dashed);
  dxf.put(100, "AcDbPolyline");
  dxf.put(90, static_cast<int>(line.points.size()));
  dxf.put(70, line.closed ? 1 : 0);
  dxf.put(43, 0.0);
  for (const Eigen::Vector2d& p : line.points) {
    dxf.put(10, p.x());
    dxf.put(20, p.y());
  }
}

/// A text that is fitted between two places, so that it is as wide in every program.
void put_text(DxfText& dxf, const DrawnText& text, const std::string& layer, const std::string& owner) {
  const auto box = box_of(text);
  begin_entity(dxf, "TEXT", layer, owner);
  dxf.put(100, "AcDbText");
  dxf.point(10, box[0]);
  dxf.put(40, text.height_m);
  dxf.put(1, text.text);
  dxf.put(50, readable_angle(text.angle_rad) * 180.0 / M_PI);
  dxf.put(72, 5);
  dxf.point(11, box[1]);
  dxf.put(100, "AcDbText");
}

void put_blocks(DxfText& dxf, const Drawing& drawing, const std::vector<DxfBlock>& blocks) {
  dxf.put(0, "SECTION");
  dxf.put(2, "BLOCKS");
  for (const DxfBlock& block : blocks) {
    begin_entity(dxf, "BLOCK", "0", block.record);
    dxf.put(100, "AcDbBlockBegin");
    dxf.put(2, block.name);
    dxf.put(70, block.name.rfind("*D", 0) == 0 ? 1 : 0);
    dxf.point(10, Eigen::Vector2d::Zero());
    dxf.put(3, block.name);
    dxf.put(1, "");

    // Symbols take the layer on which they are set, as all on layer 0 does.
    const bool symbol = block.name[0] != '*';
    for (const DrawnLine& line : block.lines)
      put_line(dxf, line, symbol ? "0" : drawing.layers[line.layer].name, block.record);
    for (const DrawnText& text : block.texts)
      put_text(dxf, text, drawing.layers[text.layer].name, block.record);
    begin_entity(dxf, "ENDBLK", "0", block.record);
    dxf.put(100, "AcDbBlockEnd");
  }
  dxf.put(0, "ENDSEC");
}

/// A hatch with its rings, whose lines rise to the right.
void put_area(DxfText& dxf, const DrawnArea& area, const std::string& layer) {
  begin_entity(dxf, "HATCH", layer, kDxfModelBlock);
  dxf.put(100, "AcDbHatch");
  dxf.point(10, Eigen::Vector2d::Zero());
  for (const auto& [code, value] : {std::pair(210, 0.0), std::pair(220, 0.0), std::pair(230, 1.0)})
    dxf.put(code, value);
  dxf.put(2, "ANSI31");
  dxf.put(70, 0);
  dxf.put(71, 0);
  dxf.put(91, static_cast<int>(area.rings.size()));

  // The outline is an outer ring, all others are holes
  for (std::size_t i = 0; i < area.rings.size(); ++i) {
    dxf.put(92, i == 0 ? 3 : 2);
    dxf.put(72, 0);
    dxf.put(73, 1);
    dxf.put(93, static_cast<int>(area.rings[i].size()));

    for (const Eigen::Vector2d& p : area.rings[i]) {
      dxf.put(10, p.x());
      dxf.put(20, p.y());
    }
    dxf.put(97, 0);
  }

  // Lines are as far apart as on the sheet
  dxf.put(75, 0);
  dxf.put(76, 1);
  dxf.put(52, 0.0);
  dxf.put(41, area.spacing_m / 3.175);  // of the lines of the metric pattern
  dxf.put(77, 0);
  dxf.put(78, 1);

  // One family of parallel lines at 45 degrees
  const double step = area.spacing_m / std::sqrt(2.0);
  for (const auto& [code, value] : {std::pair(53, 45.0), std::pair(43, 0.0), std::pair(44, 0.0),
                                    std::pair(45, -step), std::pair(46, step)})
    dxf.put(code, value);
  dxf.put(79, 0);
  dxf.put(98, 0);
}

/// An insertion of a block, mirrored if its axes turn clockwise.
void put_symbol(DxfText& dxf, const DrawnSymbol& symbol, const std::string& block, const std::string& layer) {
  const double turn = symbol.x.x() * symbol.y.y() - symbol.x.y() * symbol.y.x();
  begin_entity(dxf, "INSERT", layer, kDxfModelBlock);
  dxf.put(100, "AcDbBlockReference");
  dxf.put(2, block);
  dxf.point(10, symbol.at);
  dxf.put(41, symbol.x.norm());
  dxf.put(42, std::copysign(symbol.y.norm(), turn));
  dxf.put(43, 1.0);
  dxf.put(50, std::atan2(symbol.x.y(), symbol.x.x()) * 180.0 / M_PI);
}

/// A dimension with its picture as a block, so that all programs show it alike.
void put_dimension(DxfText& dxf, const DrawnDimension& dimension, std::size_t number,
                   const std::string& layer) {
  begin_entity(dxf, "DIMENSION", layer, kDxfModelBlock);
  dxf.put(100, "AcDbDimension");
  dxf.put(2, fmt::format("*D{}", number));
  dxf.point(10, dimension.to + dimension.beside);
  dxf.point(11, dimension.label.at);
  dxf.put(70, 32 + 128);  // its block is its own, its text was placed
  dxf.put(1, dimension.label.text);
  dxf.put(71, 5);
  dxf.put(42, dimension.measure_m);
  dxf.put(3, "PLAN");
  dxf.put(100, "AcDbAlignedDimension");
  dxf.point(13, dimension.from);
  dxf.point(14, dimension.to);

  // Angle of the dimension line
  const Eigen::Vector2d way = dimension.to - dimension.from;
  dxf.put(50, std::atan2(way.y(), way.x()) * 180.0 / M_PI);
  dxf.put(100, "AcDbRotatedDimension");
}

/// Everything that the model space holds, areas first, so that lines are drawn over them.
void put_entities(DxfText& dxf, const Drawing& drawing) {
  const auto layer = [&](const auto& thing) { return drawing.layers[thing.layer].name; };
  dxf.put(0, "SECTION");
  dxf.put(2, "ENTITIES");
  for (const DrawnArea& area : drawing.areas) put_area(dxf, area, layer(area));
  for (const DrawnLine& line : drawing.lines) put_line(dxf, line, layer(line), kDxfModelBlock);
  for (const DrawnSymbol& symbol : drawing.symbols)
    put_symbol(dxf, symbol, drawing.blocks[symbol.block].name, layer(symbol));
  for (std::size_t i = 0; i < drawing.dimensions.size(); ++i)
    put_dimension(dxf, drawing.dimensions[i], i + 1, layer(drawing.dimensions[i]));
  for (const DrawnText& text : drawing.texts) put_text(dxf, text, layer(text), kDxfModelBlock);
  dxf.put(0, "ENDSEC");
}

}  // namespace

core::Result<void> write_dxf(const std::filesystem::path& file, const Drawing& drawing) {
  // Views and limits need the extent of the drawing
  const auto [low, high] = drawing.bounds();
  const std::vector<DxfBlock> blocks = dxf_blocks(drawing);
  DxfText dxf;
  dxf.put(0, "SECTION");
  dxf.put(2, "TABLES");
  put_viewport(dxf, 0.5 * (low + high), 1.1 * std::max(1.0, (high - low).maxCoeff()));

  // Tables that entities refer to
  put_line_types(dxf, drawing.sheet.mm());
  put_layers(dxf, drawing);
  put_style_tables(dxf);
  put_dimension_styles(dxf, drawing);
  put_block_records(dxf, blocks);
  dxf.put(0, "ENDSEC");

  // Contents of the file
  put_blocks(dxf, drawing, blocks);
  put_entities(dxf, drawing);
  put_objects(dxf);
  dxf.put(0, "EOF");

  // The header holds the next free handle, which is known only now
  core::OutputFile out(file);
  out.write(dxf_header(dxf.next_handle(), drawing, low, high, dimension_text(drawing)));
  out.write(dxf.text());
  return out.commit();
}

}  // namespace plumbline::exports
