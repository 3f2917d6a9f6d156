// SPDX-License-Identifier: BSD-3-Clause
// Files of numbers alone: fx fy cx cy [k1 k2 p1 p2 [k3]] (ETH3D's calibration.txt among them), or a matrix of
// 3x3, 3x4 or 4x4 (ScanNet's intrinsic_color.txt, Stray Scanner's camera_matrix.csv).
#include <fmt/format.h>

#include <cmath>

#include "camera_files/camera_formats.hpp"
#include "camera_files/text_words.hpp"
#include "plumbline/core/numbers.hpp"

namespace plumbline::sensor {
namespace {

constexpr std::size_t kMostNumbers = 16;

/// All numbers of the file; none if it holds anything else, or more than a matrix has.
std::optional<std::vector<double>> plain_numbers(const CameraText& text) {
  std::vector<double> numbers;
  for (const CameraLine& line : camera_text_lines(text.text, " \t\r\v\f,;[]()")) {
    for (const std::string& word : line.words) {
      const auto number = core::to_number(word);
      if (!number || !std::isfinite(*number) || numbers.size() == kMostNumbers) return std::nullopt;
      numbers.push_back(*number);
    }
  }
  if (numbers.empty()) return std::nullopt;
  return numbers;
}

bool recognises_plain(const CameraText& text) { return plain_numbers(text).has_value(); }

/// The line with a decimal comma, 0 if none has one.
int decimal_comma_line(const CameraText& text) {
  for (const CameraLine& line : camera_text_lines(text.text, " \t\r;")) {
    if (core::has_decimal_comma(line.words)) return line.number;
  }
  return 0;
}

bool is_matrix(const std::vector<double>& n) {
  if (n.size() == 12 || n.size() == 16) return true;
  return n.size() == 9 && n[3] == 0.0 && n[8] == 1.0;
}

core::Result<CameraReading> read_plain(const CameraText& text) {
  // A decimal comma would double the numbers
  CameraReading reading = blank_reading(text, kPlainCamera);
  Camera& camera = reading.camera;
  const auto refuse = [&](int line, const std::string& what) {
    return refuse_camera(text, kPlainCamera, {text.file, line, line > 0 ? 1 : 0}, what, camera);
  };
  if (const int line = decimal_comma_line(text); line > 0)
    return refuse(line, "decimal comma; write numbers with a point");

  // A matrix, or a list of numbers
  const std::vector<double> n = *plain_numbers(text);
  if (is_matrix(n)) {
    if (const std::string wrong = take_matrix(n, camera); !wrong.empty()) return refuse(0, wrong);
    return reading;
  }

  // A list may end with the distortion
  if (n.size() != 4 && n.size() != 8 && n.size() != 9) {
    return refuse(
        0, fmt::format("has {} numbers (allowed: fx fy cx cy [k1 k2 p1 p2 [k3]], or a matrix of 3x3, 3x4 "
                       "or 4x4)",
                       n.size()));
  }

  // Focal lengths, principal point, distortion
  camera.color.fx = n[0];
  camera.color.fy = n[1];
  camera.color.cx = n[2];
  camera.color.cy = n[3];
  const std::string wrong = take_coefficients("", {n.begin() + 4, n.end()}, camera);
  if (!wrong.empty()) return refuse(0, wrong);
  return reading;
}

}  // namespace

const CameraFormat kPlainCamera = {"plain numbers", false, &recognises_plain, &read_plain};

}  // namespace plumbline::sensor
