// SPDX-License-Identifier: BSD-3-Clause
// COLMAP's cameras.txt: CAMERA_ID MODEL WIDTH HEIGHT PARAMS. The centre of its first pixel is at (0.5, 0.5).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "camera_files/camera_formats.hpp"
#include "camera_files/text_words.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::sensor {
namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

struct ColmapModel {
  const char* name;
  std::size_t parameters;
  bool one_focal;  ///< f cx cy ..., else fx fy cx cy ...
};

constexpr std::array<ColmapModel, 11> kColmapModels = {{
    {"SIMPLE_PINHOLE", 3, true},
    {"PINHOLE", 4, false},
    {"SIMPLE_RADIAL", 4, true},
    {"RADIAL", 5, true},
    {"OPENCV", 8, false},
    {"FULL_OPENCV", 12, false},
    {"OPENCV_FISHEYE", 8, false},
    {"FOV", 5, false},
    {"SIMPLE_RADIAL_FISHEYE", 4, true},
    {"RADIAL_FISHEYE", 5, true},
    {"THIN_PRISM_FISHEYE", 12, false},
}};

const ColmapModel* colmap_model(const CameraLine& line) {
  if (line.words.size() < 2) return nullptr;
  const auto found = std::find_if(kColmapModels.begin(), kColmapModels.end(),
                                  [&](const ColmapModel& m) { return line.words[1] == m.name; });
  return found == kColmapModels.end() ? nullptr : &*found;
}

bool recognises_colmap(const CameraText& text) {
  const auto lines = camera_text_lines(text.text, kBlanks);
  return !lines.empty() && colmap_model(lines.front()) != nullptr;
}

/// Width, height and parameters; none if a word is not a number.
std::optional<std::vector<double>> colmap_numbers(const CameraLine& line) {
  std::vector<double> numbers;
  for (std::size_t i = 2; i < line.words.size(); ++i) {
    const auto number = core::to_number(line.words[i]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

/// `n`: width, height, parameters. Returns "" or what is wrong.
std::string take_colmap(const ColmapModel& model, const std::vector<double>& n, Camera& camera) {
  constexpr double kHalfPixel = 0.5;
  const std::size_t focals = model.one_focal ? 1 : 2;
  camera.color.width = static_cast<int>(std::clamp(n[0], 0.0, 1e6));
  camera.color.height = static_cast<int>(std::clamp(n[1], 0.0, 1e6));
  camera.color.fx = n[2];
  camera.color.fy = n[1 + focals];
  camera.color.cx = n[2 + focals] - kHalfPixel;
  camera.color.cy = n[3 + focals] - kHalfPixel;
  std::vector<double> coefficients(n.begin() + static_cast<std::ptrdiff_t>(4 + focals), n.end());
  return take_coefficients(core::lower(model.name), coefficients, camera);
}

core::Result<CameraReading> read_colmap(const CameraText& text) {
  // The first camera, without its number
  CameraReading reading = blank_reading(text, kColmapCamera);
  const auto lines = camera_text_lines(text.text, kBlanks);
  const std::vector<std::string> first(lines.front().words.begin() + 1, lines.front().words.end());
  for (const CameraLine& line : lines) {
    const auto refuse = [&](const std::string& what) {
      return refuse_camera(text, kColmapCamera, {text.file, line.number, 1}, what, reading.camera);
    };

    // Other cameras must equal the first
    const ColmapModel* model = colmap_model(line);
    if (model == nullptr) return refuse("expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS");
    if (&line != &lines.front()) {
      if (std::equal(first.begin(), first.end(), line.words.begin() + 1, line.words.end())) continue;
      return refuse("holds several cameras that differ; leave the one of the colour images");
    }

    // The model decides the number of parameters
    const auto numbers = colmap_numbers(line);
    if (!numbers || numbers->size() != model->parameters + 2)
      return refuse(fmt::format("{} needs a width, a height and {} numbers", model->name, model->parameters));
    if (const std::string wrong = take_colmap(*model, *numbers, reading.camera); !wrong.empty())
      return refuse(wrong);
  }

  // COLMAP's first pixel has its centre at 0.5
  reading.has_size = true;
  reading.notes.emplace_back("half a pixel subtracted from the principal point");
  return reading;
}

}  // namespace

const CameraFormat kColmapCamera = {"COLMAP", true, &recognises_colmap, &read_colmap};

}  // namespace plumbline::sensor
