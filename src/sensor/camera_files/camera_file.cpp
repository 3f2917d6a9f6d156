// SPDX-License-Identifier: BSD-3-Clause
// Detection of a camera file's program, and checks that apply to all programs.
#include "plumbline/sensor/camera_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "camera_files/camera_formats.hpp"
#include "plumbline/core/git_lfs.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::sensor {
namespace {

constexpr std::size_t kMaxCameraBytes = 1'000'000;

/// The whole file, if it is small enough for a camera.
core::Result<std::string> read_camera_text(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    return core::usage_error(file.string() + ": is a folder, not a camera file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return core::usage_error(file.string() + ": no such file, or no permission to read it");

  // A device would never end
  std::string text(kMaxCameraBytes + 1, '\0');  // the file may be a device without end
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxCameraBytes)
    return core::usage_error(file.string() + ": is over 1 MB and thus not a camera file");
  if (core::begins_as_lfs_pointer(text)) return core::usage_error(file.string() + ": " + core::kLfsPointer);
  return text;
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

/// OpenCV's YAML and ROS' messages as standard YAML: without their directive and tags, the first document
/// only. Lines and columns are not moved.
std::string plain_yaml(std::string text) {
  // OpenCV's directive and tags are not YAML
  if (const std::size_t at = text.find("%YAML"); at != std::string::npos && at <= 3) {
    text.replace(at, std::min(text.find('\n', at), text.size()) - at, "");
  }
  replace_all(text, "!!opencv-matrix", std::string(15, ' '));

  // Only the first document counts
  bool content = false;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, std::min<std::size_t>(end - begin, 3));

    // A second document ends the text
    if (line == "---" && content) {
      text.resize(begin);
    } else if (line == "---" || line == "...") {
      text.replace(begin, 3, "   ");
    } else if (line.find_first_not_of(" \t\r") != std::string::npos && line[0] != '#') {
      content = true;
    }

    begin = end + 1;
  }
  return text;
}

/// The file as text and, if it can be parsed, as a tree.
CameraText camera_text(const std::filesystem::path& file, std::string content) {
  CameraText text;
  text.file = file.string();
  std::string yaml = plain_yaml(content);
  const std::size_t first = yaml.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (first != std::string::npos && yaml[first] == '{')
    std::replace(yaml.begin(), yaml.end(), '\t', ' ');  // JSON
  if (auto tree = core::parse_yaml(yaml, text.file, text.problems)) text.tree = std::move(*tree);
  text.text = std::move(content);
  return text;
}

/// Name of the program whose files are recognised but cannot be read; "" if not recognised.
std::string other_program(const CameraText& text) {
  constexpr std::array<std::pair<const char*, const char*>, 6> kWords = {{
      {"fl_x", "nerfstudio or instant-ngp (transforms.json)"},
      {"projection_parameters", "VINS (camodocal)"},
      {"opencv_storage", "OpenCV as XML"},
      {"T_imu_cam", "Basalt"},
      {"<camera", "an XML format, such as Metashape's or Agisoft Lens's"},
      {"CalibrationInformation", "Azure Kinect (raw calibration)"},
  }};
  for (const auto& [word, program] : kWords) {
    if (text.text.find(word) != std::string::npos) return program;
  }
  return "";
}

bool is_own(const CameraText& text) {
  constexpr std::array<const char*, 7> kKeys = {"fx", "fy", "cx", "cy", "width", "height", "depth_scale"};
  const auto has = [&](const char* key) { return text.tree.find(key) != nullptr; };
  return text.is_map() && std::any_of(kKeys.begin(), kKeys.end(), has);
}

/// Names the program if it is known, and shows the lines to write.
core::Error unknown_kind(const CameraText& text) {
  const std::string other = other_program(text);
  std::string programs;
  for (const CameraFormat* format : camera_formats())
    programs += (programs.empty() ? "" : ", ") + std::string(format->program);
  const std::string what =
      other.empty()
          ? fmt::format("is not a known camera file (known are camera.yaml and those of {})", programs)
          : fmt::format("is a camera file of {}, which is not read", other);
  return {core::ErrorKind::kUsage,
          fmt::format("{}; write a camera.yaml with these lines:\n{}",
                      core::printable(text.file + ": " + what), camera_lines({})),
          true};
}

const CameraFormat* format_of(const CameraText& text) {
  for (const CameraFormat* format : camera_formats()) {
    if (format->recognises(text)) return format;
  }
  return nullptr;
}

/// A camera that another program wrote, checked for values out of range.
core::Result<CameraReading> read_foreign(const CameraText& text, const CameraFormat& format) {
  if (!text.problems.empty() && text.is_map()) return tl::unexpected(core::to_error(text.problems));
  auto reading = format.read(text);
  if (!reading) return reading;
  Camera shape = reading->camera;
  if (!reading->has_size) {  // large enough for the principal point, so that only the rest is checked
    shape.color.width = static_cast<int>(std::clamp(2.0 * shape.color.cx + 2.0, 1.0, 32768.0));
    shape.color.height = static_cast<int>(std::clamp(2.0 * shape.color.cy + 2.0, 1.0, 32768.0));
  }
  const std::string wrong = camera_problem(shape);
  if (!wrong.empty()) return refuse_camera(text, format, {}, wrong, reading->camera);
  return reading;
}

/// Sizes in pixels, focal lengths, a principal point inside the image.
std::string pinhole_problem(const Pinhole& p, const std::string& which) {
  const auto focal = [](double f) { return f >= 1e-3 && f <= 1e6; };
  if (p.width < 1 || p.height < 1 || p.width > 32768 || p.height > 32768)
    return fmt::format("{}{}x{} is not the size of an image", which, p.width, p.height);
  if (!focal(p.fx) || !focal(p.fy))
    return fmt::format("{}fx {} and fy {} are not focal lengths", which, p.fx, p.fy);

  // Some programs divide by the image's size
  if (p.fx < 10.0 && p.cx <= 1.0 && p.cy <= 1.0) {
    return fmt::format("{}fx {} and cx {} are shares of the image's size; multiply them by it", which, p.fx,
                       p.cx);
  }
  const bool inside = p.cx >= 0.0 && p.cy >= 0.0 && p.cx <= p.width - 1 && p.cy <= p.height - 1;
  if (inside) return "";
  return fmt::format("{}the principal point ({}, {}) lies outside the image of {}x{}", which, p.cx, p.cy,
                     p.width, p.height);
}

}  // namespace

/// Formats of other programs are tried before camera.yaml.
core::Result<CameraReading> read_camera_file(const std::filesystem::path& file) {
  auto content = read_camera_text(file);
  if (!content) return tl::unexpected(content.error());
  const CameraText text = camera_text(file, std::move(*content));
  if (const CameraFormat* format = format_of(text)) return read_foreign(text, *format);
  if (!other_program(text).empty()) return tl::unexpected(unknown_kind(text));

  // YAML that is broken gets YAML's message
  const std::string ending = file.extension().string();
  const bool named_so = ending == ".yaml" || ending == ".yml" || ending == ".json";
  const bool broken = text.tree.kind == core::ConfigNode::Kind::kNull && !text.problems.empty();
  if (named_so && broken) return tl::unexpected(core::to_error(text.problems));
  if (!is_own(text)) return tl::unexpected(unknown_kind(text));
  auto camera = read_camera(file);
  if (!camera) return tl::unexpected(camera.error());
  return CameraReading{std::move(*camera), "", true, true, {}};
}

core::Result<CameraReading> find_camera(const std::string& name_or_file,
                                        const std::filesystem::path& cameras_folder) {
  const auto file = core::find_yaml("camera", name_or_file, cameras_folder);
  if (!file) return tl::unexpected<core::Error>(file.error());
  return read_camera_file(*file);
}

bool is_foreign_camera_file(const std::filesystem::path& file, bool numbers_too) {
  auto content = read_camera_text(file);
  if (!content) return false;
  const CameraFormat* format = format_of(camera_text(file, std::move(*content)));
  return format != nullptr && (numbers_too || format->structured);
}

/// Values that no camera has; empty if all are possible.
std::string camera_problem(const Camera& camera) {
  if (std::string wrong = pinhole_problem(camera.color, ""); !wrong.empty()) return wrong;
  if (camera.depth) {
    if (std::string wrong = pinhole_problem(*camera.depth, "depth: "); !wrong.empty()) return wrong;
  }
  const auto is_finite = [](const Distortion& k) {
    return std::all_of(k.begin(), k.end(), [](double c) { return std::isfinite(c); });
  };
  const bool finite = is_finite(camera.distortion) && is_finite(camera.depth_lens.k);
  if (!finite) return "a distortion coefficient is not finite";
  if (!(camera.depth_scale >= 1e-3 && camera.depth_scale <= 1e7))
    return fmt::format("the depth scale {} is out of range (raw units per metre: 0.001 to 1e7)",
                       camera.depth_scale);
  if (!(camera.fps >= 1e-3 && camera.fps <= 1e4))
    return fmt::format("{} images per second are not possible", camera.fps);
  return "";
}

std::string camera_lines(const Camera& camera) {
  // Unknown numbers become words to replace
  const Pinhole& p = camera.color;
  const auto known = [](double value, const char* otherwise) {
    return value != 0.0 && std::isfinite(value) ? fmt::format("{}", value) : std::string(otherwise);
  };

  // Unused coefficients are left out
  const Distortion& k = camera.distortion;
  const bool fisheye = camera.model == LensModel::kEquidistant;
  const bool rational = !fisheye && (k[5] != 0.0 || k[6] != 0.0 || k[7] != 0.0);
  const std::ptrdiff_t count = fisheye ? 4 : rational ? 8 : 5;
  const std::vector<double> coefficients(k.begin(), k.begin() + count);

  return fmt::format(
      "{}  width: {}\n  height: {}\n  fx: {}\n  fy: {}\n  cx: {}\n  cy: {}\n  distortion: [{}]  # {}\n"
      "  depth_scale: {}  # raw units per metre",
      fisheye ? "  model: equidistant\n" : "", known(p.width, "WIDTH"), known(p.height, "HEIGHT"),
      known(p.fx, "FX"), known(p.fy, "FY"), known(p.cx, "CX"), known(p.cy, "CY"),
      fmt::join(coefficients, ", "),
      fisheye    ? "k1 k2 k3 k4"
      : rational ? "k1 k2 p1 p2 k3 k4 k5 k6"
                 : "k1 k2 p1 p2 k3",
      camera.depth_scale);
}

}  // namespace plumbline::sensor
