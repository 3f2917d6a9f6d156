// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Text of a DXF file, and the parts of it that are the same for every drawing.
#include <fmt/format.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "drawings/drawing.hpp"

namespace plumbline::exports {

/// Pairs of group code and value.
class DxfText {
 public:
  void put(int code, const std::string& value) { text_ += fmt::format("{:>3}\n{}\n", code, encoded(value)); }
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

  /// The text with all that is not ASCII as \\U+XXXX; longer characters than those of 16 bits become a
  /// question mark.
  static std::string encoded(const std::string& utf8);

 private:
  std::string text_;
  int next_ = 0x1000;
};

inline constexpr const char* kDxfModelBlock = "1F";  // handles that others point to
inline constexpr const char* kDxfPaperBlock = "1B";
inline constexpr const char* kDxfRootDictionary = "C";
inline constexpr const char* kDxfBlocksTable = "1";

/// Begins a table of so many entries.
void begin_table(DxfText& dxf, const char* name, const char* handle, int entries);
/// Begins a table's entry; without a handle it gets a new one.
void begin_entry(DxfText& dxf, const char* type, const char* handle, const char* table, const char* marker,
                 const std::string& name);
/// Table of the window, which shows the drawing around its middle.
void put_viewport(DxfText& dxf, const Eigen::Vector2d& middle, double height);
/// Tables of text styles, views, coordinate systems and applications.
void put_style_tables(DxfText& dxf);
/// Section of the dictionaries, which ends the file.
void put_objects(DxfText& dxf);
/// The head, with the place of the sheet on the paper. `text_m`: height of dimensions' texts.
std::string dxf_header(const std::string& next_handle, const Drawing& drawing, const Eigen::Vector2d& low,
                       const Eigen::Vector2d& high, double text_m);

}  // namespace plumbline::exports
