// SPDX-License-Identifier: BSD-3-Clause
#include "drawings/dxf_text.hpp"

namespace plumbline::exports {
namespace {

/// A layout, with the plot settings that every program expects.
void put_layout(DxfText& dxf, const char* handle, const char* name, int order, const char* block) {
  dxf.put(0, "LAYOUT");
  dxf.put(5, handle);
  dxf.put(330, "1A");
  dxf.put(100, "AcDbPlotSettings");
  dxf.put(1, "");
  dxf.put(2, "none_device");
  dxf.put(4, "");
  dxf.put(6, "");

  // Margins and sizes of the paper: none
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

  // Limits and axes of the layout
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

/// A dictionary of objects, whose entries are name and handle.
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

}  // namespace

/// Text whose characters beyond ASCII are \U+XXXX, as R2000 reads them.
std::string DxfText::encoded(const std::string& utf8) {
  std::string out;
  for (std::size_t i = 0; i < utf8.size(); ++i) {
    const auto c = static_cast<unsigned char>(utf8[i]);
    if (c < 0x80) {
      out += utf8[i];
      continue;
    }

    // Length and first bits of a character in UTF-8
    const std::size_t more = c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : 1;
    unsigned code = c & (0x3FU >> more);
    for (std::size_t k = 1; k <= more && i + k < utf8.size(); ++k)
      code = (code << 6U) | (static_cast<unsigned char>(utf8[i + k]) & 0x3FU);
    out += code > 0xFFFF ? "?" : fmt::format("\\U+{:04X}", code);
    i += more;
  }
  return out;
}

/// The beginning of a table with this number of entries.
void begin_table(DxfText& dxf, const char* name, const char* handle, int entries) {
  dxf.put(0, "TABLE");
  dxf.put(2, name);
  dxf.put(5, handle);
  dxf.put(330, "0");
  dxf.put(100, "AcDbSymbolTable");
  dxf.put(70, entries);
}

/// The beginning of an entry; without a handle it gets the next one.
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
  // The view that a program shows first
  begin_table(dxf, "VPORT", "8", 1);
  begin_entry(dxf, "VPORT", nullptr, "8", "AcDbViewportTableRecord", "*ACTIVE");
  dxf.put(70, 0);
  const auto pair = [&](int code, double x, double y) {
    dxf.put(code, x);
    dxf.put(code + 10, y);
  };

  // Corners, middle, snap and grid
  pair(10, 0.0, 0.0);
  pair(11, 1.0, 1.0);
  pair(12, middle.x(), middle.y());
  pair(13, 0.0, 0.0);
  pair(14, 0.1, 0.1);
  pair(15, 1.0, 1.0);

  // Direction, height and lens of the view
  dxf.put(16, 0.0);
  dxf.put(26, 0.0);
  dxf.put(36, 1.0);
  dxf.point(17, Eigen::Vector2d::Zero());
  dxf.put(40, height);
  dxf.put(41, 1.5);
  dxf.put(42, 50.0);
  dxf.put(0, "ENDTAB");
}

void put_style_tables(DxfText& dxf) {
  // The only style of texts
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

  // User coordinate systems: none, applications: AutoCAD's own
  begin_table(dxf, "UCS", "7", 0);
  dxf.put(0, "ENDTAB");
  begin_table(dxf, "APPID", "9", 1);
  begin_entry(dxf, "APPID", "12", "9", "AcDbRegAppTableRecord", "ACAD");
  dxf.put(70, 0);
  dxf.put(0, "ENDTAB");
}

void put_objects(DxfText& dxf) {
  // Names of everything below the root
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

  // Layouts of model and paper
  put_layout(dxf, "22", "Model", 0, kDxfModelBlock);
  put_layout(dxf, "1E", "Layout1", 1, kDxfPaperBlock);
  put_dictionary(dxf, "17", kDxfRootDictionary, {{"Standard", "18"}});

  // The style of multilines that must exist
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

  // Both lines of that style
  for (const double offset : {0.5, -0.5}) {
    dxf.put(49, offset);
    dxf.put(62, 256);
    dxf.put(6, "BYLAYER");
  }

  // Plot styles, of which there is only the normal one
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

std::string dxf_header(const std::string& next_handle, const Drawing& drawing, const Eigen::Vector2d& low,
                       const Eigen::Vector2d& high, double text_m) {
  DxfText dxf;
  for (const std::string& note : drawing.notes) dxf.put(999, note);
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
  for (const auto& [name, height] :
       {std::pair("$DIMTXT", 1.0), std::pair("$DIMASZ", 0.7), std::pair("$DIMTSZ", 0.4),
        std::pair("$DIMEXO", 0.5), std::pair("$DIMEXE", 0.5), std::pair("$DIMGAP", 0.4)}) {
    variable(name);
    dxf.put(40, height * text_m);
  }

  // LibreCAD prints the sheet from these.
  const DrawingSheet& sheet = drawing.sheet;

  for (const auto& [name, place] :
       {std::pair("$PLIMMIN", Eigen::Vector2d(0.0, 0.0)),
        std::pair("$PLIMMAX", Eigen::Vector2d(1e-3 * sheet.width_mm, 1e-3 * sheet.height_mm)),
        std::pair("$PINSBASE", Eigen::Vector2d(-sheet.low / sheet.scale))}) {
    variable(name);
    dxf.put(10, place.x());
    dxf.put(20, place.y());
    if (std::string(name) == "$PINSBASE") dxf.put(30, 0.0);
  }
  variable("$PSVPSCALE");

  dxf.put(40, 1.0 / sheet.scale);
  variable("$DIMTAD");
  dxf.put(70, 1);
  variable("$LTSCALE");
  dxf.put(40, 1.0);
  dxf.put(0, "ENDSEC");
  dxf.put(0, "SECTION");
  dxf.put(2, "CLASSES");
  dxf.put(0, "ENDSEC");
  return dxf.text();
}

}  // namespace plumbline::exports
