// SPDX-License-Identifier: BSD-3-Clause
// DXF R2000 (AC1015): the smallest file that CAD programs open without mending. Lengths are metres.
#include <fmt/format.h>

#include <cmath>

#include "plans/drawing.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::exports {
namespace {

/// Pairs of group code and value.
class DxfText {
 public:
  void put(int code, const std::string& value) { text_ += fmt::format("{:>3}\n{}\n", code, value); }
  void put(int code, const char* value) { put(code, std::string(value)); }
  void put(int code, int value) { put(code, std::to_string(value)); }
  void put(int code, double value) { put(code, fmt::format("{:.6f}", value)); }
  void point(int code, const Eigen::Vector2d& p) {
    put(code, p.x());
    put(code + 10, p.y());
    put(code + 20, 0.0);
  }
  /// A new handle, which is put.
  std::string handle() {
    std::string name = fmt::format("{:X}", next_++);
    put(5, name);
    return name;
  }
  [[nodiscard]] std::string next_handle() const { return fmt::format("{:X}", next_); }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
  int next_ = 0x100;
};

constexpr const char* kDxfModelBlock = "1F";  // handles that others point to
constexpr const char* kDxfPaperBlock = "1B";
constexpr const char* kDxfRootDictionary = "C";
constexpr const char* kDxfBlocksTable = "1";

void begin_table(DxfText& dxf, const char* name, const char* handle, int entries) {
  dxf.put(0, "TABLE");
  dxf.put(2, name);
  dxf.put(5, handle);
  dxf.put(330, "0");
  dxf.put(100, "AcDbSymbolTable");
  dxf.put(70, entries);
}

/// The common part of a table's entry.
void begin_entry(DxfText& dxf, const char* type, const char* handle, const char* table, const char* marker,
                 const std::string& name) {
  dxf.put(0, type);
  if (handle != nullptr) {
    dxf.put(std::string(type) == "DIMSTYLE" ? 105 : 5, handle);
  } else {
    dxf.handle();
  }
  dxf.put(330, table);
  dxf.put(100, "AcDbSymbolTableRecord");
  dxf.put(100, marker);
  dxf.put(2, name);
}

void put_viewport(DxfText& dxf, const Eigen::Vector2d& middle, double height) {
  begin_table(dxf, "VPORT", "8", 1);
  begin_entry(dxf, "VPORT", nullptr, "8", "AcDbViewportTableRecord", "*ACTIVE");
  dxf.put(70, 0);
  const auto pair = [&](int code, double x, double y) {
    dxf.put(code, x);
    dxf.put(code + 10, y);
  };

  pair(10, 0.0, 0.0);
  pair(11, 1.0, 1.0);
  pair(12, middle.x(), middle.y());
  pair(13, 0.0, 0.0);
  pair(14, 0.1, 0.1);
  pair(15, 1.0, 1.0);

  dxf.put(16, 0.0);
  dxf.put(26, 0.0);
  dxf.put(36, 1.0);
  dxf.point(17, Eigen::Vector2d::Zero());
  dxf.put(40, height);
  dxf.put(41, 1.5);
  dxf.put(42, 50.0);
  dxf.put(0, "ENDTAB");
}

void put_line_types(DxfText& dxf) {
  begin_table(dxf, "LTYPE", "5", 3);
  for (const char* name : {"ByBlock", "ByLayer", "Continuous"}) {
    begin_entry(dxf, "LTYPE", nullptr, "5", "AcDbLinetypeTableRecord", name);
    dxf.put(70, 0);
    dxf.put(3, "");
    dxf.put(72, 65);
    dxf.put(73, 0);
    dxf.put(40, 0.0);
  }
  dxf.put(0, "ENDTAB");
}

void put_layers(DxfText& dxf, const Drawing& drawing) {
  begin_table(dxf, "LAYER", "2", static_cast<int>(drawing.layers.size()) + 1);
  const auto put = [&](const std::string& name, int color) {
    begin_entry(dxf, "LAYER", nullptr, "2", "AcDbLayerTableRecord", name);
    dxf.put(70, 0);
    dxf.put(62, color);
    dxf.put(6, "Continuous");
    dxf.put(370, -3);
    dxf.put(390, "F");
  };
  put("0", 7);
  for (const DrawingLayer& layer : drawing.layers) put(layer.name, layer.dxf_color);
  dxf.put(0, "ENDTAB");
}

void put_small_tables(DxfText& dxf) {
  begin_table(dxf, "STYLE", "3", 1);
  begin_entry(dxf, "STYLE", "11", "3", "AcDbTextStyleTableRecord", "Standard");
  dxf.put(70, 0);
  dxf.put(40, 0.0);
  dxf.put(41, 1.0);

  dxf.put(50, 0.0);
  dxf.put(71, 0);
  dxf.put(42, 0.2);
  dxf.put(3, "txt");
  dxf.put(4, "");
  dxf.put(0, "ENDTAB");
  begin_table(dxf, "VIEW", "6", 0);

  dxf.put(0, "ENDTAB");
  begin_table(dxf, "UCS", "7", 0);
  dxf.put(0, "ENDTAB");
  begin_table(dxf, "APPID", "9", 1);
  begin_entry(dxf, "APPID", "12", "9", "AcDbRegAppTableRecord", "ACAD");
  dxf.put(70, 0);
  dxf.put(0, "ENDTAB");

  begin_table(dxf, "DIMSTYLE", "A", 1);
  dxf.put(100, "AcDbDimStyleTable");
  begin_entry(dxf, "DIMSTYLE", "27", "A", "AcDbDimStyleTableRecord", "Standard");
  dxf.put(70, 0);
  dxf.put(340, "11");
  dxf.put(0, "ENDTAB");

  begin_table(dxf, "BLOCK_RECORD", kDxfBlocksTable, 2);
  begin_entry(dxf, "BLOCK_RECORD", kDxfModelBlock, kDxfBlocksTable, "AcDbBlockTableRecord", "*Model_Space");
  dxf.put(340, "22");
  begin_entry(dxf, "BLOCK_RECORD", kDxfPaperBlock, kDxfBlocksTable, "AcDbBlockTableRecord", "*Paper_Space");
  dxf.put(340, "1E");
  dxf.put(0, "ENDTAB");
}

void put_blocks(DxfText& dxf) {
  dxf.put(0, "SECTION");
  dxf.put(2, "BLOCKS");

  for (const bool model : {true, false}) {
    const char* record = model ? kDxfModelBlock : kDxfPaperBlock;
    const char* name = model ? "*Model_Space" : "*Paper_Space";
    const auto begin = [&](const char* type) {
      dxf.put(0, type);
      dxf.handle();
      dxf.put(330, record);
      dxf.put(100, "AcDbEntity");
      if (!model) dxf.put(67, 1);
      dxf.put(8, "0");
    };

    begin("BLOCK");
    dxf.put(100, "AcDbBlockBegin");
    dxf.put(2, name);
    dxf.put(70, 0);
    dxf.point(10, Eigen::Vector2d::Zero());
    dxf.put(3, name);
    dxf.put(1, "");
    begin("ENDBLK");
    dxf.put(100, "AcDbBlockEnd");
  }

  dxf.put(0, "ENDSEC");
}

void begin_entity(DxfText& dxf, const char* type, const DrawingLayer& layer) {
  dxf.put(0, type);
  dxf.handle();
  dxf.put(330, kDxfModelBlock);
  dxf.put(100, "AcDbEntity");
  dxf.put(8, layer.name);
}

void put_entities(DxfText& dxf, const Drawing& drawing, const Eigen::Matrix2d& turn,
                  const Eigen::Vector2d& origin) {
  dxf.put(0, "SECTION");
  dxf.put(2, "ENTITIES");
  const double turned_rad = std::atan2(turn(1, 0), turn(0, 0));
  const double scale = turn.col(0).norm();

  for (const DrawnLine& line : drawing.lines) {
    const DrawingLayer& layer = drawing.layers[line.layer];
    if (line.points.size() == 2 && !line.closed) {
      begin_entity(dxf, "LINE", layer);
      dxf.put(100, "AcDbLine");
      dxf.point(10, origin + turn * line.points[0]);
      dxf.point(11, origin + turn * line.points[1]);
      continue;
    }

    begin_entity(dxf, "LWPOLYLINE", layer);
    dxf.put(100, "AcDbPolyline");
    dxf.put(90, static_cast<int>(line.points.size()));
    dxf.put(70, line.closed ? 1 : 0);
    dxf.put(43, 0.0);

    for (const Eigen::Vector2d& p : line.points) {
      const Eigen::Vector2d at = origin + turn * p;
      dxf.put(10, at.x());
      dxf.put(20, at.y());
    }
  }

  for (const DrawnText& text : drawing.texts) {
    const Eigen::Vector2d at = origin + turn * text.at;
    begin_entity(dxf, "TEXT", drawing.layers[text.layer]);
    dxf.put(100, "AcDbText");
    dxf.point(10, at);

    dxf.put(40, scale * text.height_m);
    dxf.put(1, text.text);
    dxf.put(50, readable_angle(text.angle_rad + turned_rad) * 180.0 / M_PI);
    dxf.put(72, 1);
    dxf.point(11, at);
    dxf.put(100, "AcDbText");
    dxf.put(73, 2);
  }

  dxf.put(0, "ENDSEC");
}

void put_layout(DxfText& dxf, const char* handle, const char* name, int order, const char* block) {
  dxf.put(0, "LAYOUT");
  dxf.put(5, handle);
  dxf.put(330, "1A");
  dxf.put(100, "AcDbPlotSettings");
  dxf.put(1, "");
  dxf.put(2, "none_device");
  dxf.put(4, "");
  dxf.put(6, "");

  for (int code = 40; code <= 49; ++code) dxf.put(code, 0.0);
  dxf.put(140, 0.0);
  dxf.put(141, 0.0);
  dxf.put(142, 1.0);
  dxf.put(143, 1.0);
  dxf.put(70, order == 0 ? 1712 : 688);
  dxf.put(72, 0);

  dxf.put(73, 0);
  dxf.put(74, 5);
  dxf.put(7, "");
  dxf.put(75, 16);
  dxf.put(147, 1.0);
  dxf.put(148, 0.0);
  dxf.put(149, 0.0);

  dxf.put(100, "AcDbLayout");
  dxf.put(1, name);
  dxf.put(70, 1);
  dxf.put(71, order);
  dxf.put(10, 0.0);
  dxf.put(20, 0.0);
  dxf.put(11, 12.0);

  dxf.put(21, 9.0);
  dxf.point(12, Eigen::Vector2d::Zero());
  dxf.point(14, Eigen::Vector2d::Zero());
  dxf.point(15, Eigen::Vector2d::Zero());
  dxf.put(146, 0.0);
  dxf.point(13, Eigen::Vector2d::Zero());
  dxf.point(16, Eigen::Vector2d::UnitX());
  dxf.point(17, Eigen::Vector2d::UnitY());
  dxf.put(76, 0);
  dxf.put(330, block);
}

void put_dictionary(DxfText& dxf, const char* handle, const char* owner,
                    const std::vector<std::pair<const char*, const char*>>& entries) {
  dxf.put(0, "DICTIONARY");
  dxf.put(5, handle);
  dxf.put(330, owner);
  dxf.put(100, "AcDbDictionary");
  dxf.put(281, 1);
  for (const auto& [name, to] : entries) {
    dxf.put(3, name);
    dxf.put(350, to);
  }
}

void put_objects(DxfText& dxf) {
  dxf.put(0, "SECTION");
  dxf.put(2, "OBJECTS");
  put_dictionary(dxf, kDxfRootDictionary, "0",
                 {{"ACAD_GROUP", "D"},
                  {"ACAD_LAYOUT", "1A"},
                  {"ACAD_MLINESTYLE", "17"},
                  {"ACAD_PLOTSETTINGS", "19"},
                  {"ACAD_PLOTSTYLENAME", "E"}});
  put_dictionary(dxf, "D", kDxfRootDictionary, {});
  put_dictionary(dxf, "1A", kDxfRootDictionary, {{"Model", "22"}, {"Layout1", "1E"}});

  put_layout(dxf, "22", "Model", 0, kDxfModelBlock);
  put_layout(dxf, "1E", "Layout1", 1, kDxfPaperBlock);
  put_dictionary(dxf, "17", kDxfRootDictionary, {{"Standard", "18"}});
  dxf.put(0, "MLINESTYLE");
  dxf.put(5, "18");
  dxf.put(330, "17");
  dxf.put(100, "AcDbMlineStyle");

  dxf.put(2, "Standard");
  dxf.put(70, 0);
  dxf.put(3, "");
  dxf.put(62, 256);
  dxf.put(51, 90.0);
  dxf.put(52, 90.0);
  dxf.put(71, 2);

  for (const double offset : {0.5, -0.5}) {
    dxf.put(49, offset);
    dxf.put(62, 256);
    dxf.put(6, "BYLAYER");
  }

  put_dictionary(dxf, "19", kDxfRootDictionary, {});
  dxf.put(0, "ACDBDICTIONARYWDFLT");
  dxf.put(5, "E");
  dxf.put(330, kDxfRootDictionary);
  dxf.put(100, "AcDbDictionary");
  dxf.put(281, 1);
  dxf.put(3, "Normal");

  dxf.put(350, "F");
  dxf.put(100, "AcDbDictionaryWithDefault");
  dxf.put(340, "F");
  dxf.put(0, "ACDBPLACEHOLDER");
  dxf.put(5, "F");
  dxf.put(330, "E");
  dxf.put(0, "ENDSEC");
}

std::string dxf_header(const std::string& next_handle, const std::vector<std::string>& notes,
                       const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
  DxfText dxf;
  for (const std::string& note : notes) dxf.put(999, note);
  dxf.put(0, "SECTION");
  dxf.put(2, "HEADER");

  const auto variable = [&](const char* name) { dxf.put(9, name); };
  variable("$ACADVER");
  dxf.put(1, "AC1015");
  variable("$DWGCODEPAGE");
  dxf.put(3, "ANSI_1252");
  variable("$HANDSEED");

  dxf.put(5, next_handle);
  variable("$INSUNITS");
  dxf.put(70, 6);  // metres
  variable("$MEASUREMENT");
  dxf.put(70, 1);
  variable("$EXTMIN");
  dxf.point(10, low);

  variable("$EXTMAX");
  dxf.point(10, high);
  dxf.put(0, "ENDSEC");
  dxf.put(0, "SECTION");
  dxf.put(2, "CLASSES");
  dxf.put(0, "ENDSEC");
  return dxf.text();
}

}  // namespace

core::Result<void> write_dxf(const std::filesystem::path& file, const Drawing& drawing,
                             const Eigen::Matrix2d& turn, const Eigen::Vector2d& origin) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300);
  Eigen::Vector2d high = -low;
  for (const DrawnLine& line : drawing.lines) {
    for (const Eigen::Vector2d& p : line.points) {
      low = low.cwiseMin(origin + turn * p);
      high = high.cwiseMax(origin + turn * p);
    }
  }

  DxfText dxf;
  dxf.put(0, "SECTION");
  dxf.put(2, "TABLES");
  put_viewport(dxf, 0.5 * (low + high), 1.1 * std::max(1.0, (high - low).maxCoeff()));
  put_line_types(dxf);

  put_layers(dxf, drawing);
  put_small_tables(dxf);
  dxf.put(0, "ENDSEC");
  put_blocks(dxf);
  put_entities(dxf, drawing, turn, origin);
  put_objects(dxf);
  dxf.put(0, "EOF");

  core::OutputFile out(file);
  out.write(dxf_header(dxf.next_handle(), drawing.notes, low, high));
  out.write(dxf.text());
  return out.commit();
}

}  // namespace plumbline::exports
