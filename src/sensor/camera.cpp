// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/sensor/camera.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "plumbline/core/options.hpp"

namespace plumbline::sensor {
namespace {

using core::ConfigNode;
using core::ConfigProblems;

constexpr double kRigidTolerance = 1e-3;  // largest element of R^T R - I: calibration files are often rounded

std::string join(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

/// The keys that both cameras share.
void declare_pinhole(core::OptionTable& table, Pinhole& pinhole) {
  constexpr core::Range<double> focal{1e-3, 1e6};
  table.integer("width", pinhole.width, {1, 32768}, "px", "Width of the images");
  table.integer("height", pinhole.height, {1, 32768}, "px", "Height of the images");
  table.number("fx", pinhole.fx, focal, "px", "Focal length along x");
  table.number("fy", pinhole.fy, focal, "px", "Focal length along y");
  table.number("cx", pinhole.cx, {}, "px", "Principal point; 0 is the centre of the leftmost pixel");
  table.number("cy", pinhole.cy, {}, "px", "Principal point; 0 is the centre of the topmost pixel");
}

/// Every key of a pinhole must exist, and the principal point must be inside the image.
void check_pinhole(const ConfigNode& map, const Pinhole& pinhole, const std::string& path,
                   ConfigProblems& problems) {
  for (const char* key : {"width", "height", "fx", "fy", "cx", "cy"}) {
    if (map.find(key) == nullptr) {
      problems.push_back({map.mark, join(path, key), "is missing (needed: width height fx fy cx cy)"});
    }
  }
  const auto inside = [&](const char* key, double value, int size) {
    const ConfigNode* node = map.find(key);
    if (node == nullptr || size < 1 || (value >= 0.0 && value <= size - 1)) return;
    problems.push_back({node->mark, join(path, key),
                        fmt::format("{} lies outside the image (allowed: 0 to {})", value, size - 1)});
  };
  inside("cx", pinhole.cx, pinhole.width);
  inside("cy", pinhole.cy, pinhole.height);
}

/// A finite number, read as an option would be.
std::optional<double> number_of(const ConfigNode& node) {
  double value = 0.0;
  core::OptionTable table;
  table.number("n", value, {}, "", "");
  ConfigProblems problems;
  table.set("n", node, "", problems);
  if (!problems.empty() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// Reads 4 lists of 4 numbers or 16 numbers, row by row.
std::optional<Eigen::Matrix4d> read_matrix(const ConfigNode& node) {
  std::vector<const ConfigNode*> cells;
  for (const ConfigNode& item : node.items) {
    if (item.kind == ConfigNode::Kind::kSequence && item.items.size() == 4 && node.items.size() == 4) {
      for (const ConfigNode& cell : item.items) cells.push_back(&cell);
    } else {
      cells.push_back(&item);
    }
  }
  if (cells.size() != 16) return std::nullopt;

  Eigen::Matrix4d matrix;
  for (std::size_t i = 0; i < 16; ++i) {
    const std::optional<double> value = number_of(*cells[i]);
    if (!value) return std::nullopt;
    matrix(static_cast<int>(i) / 4, static_cast<int>(i) % 4) = *value;
  }
  return matrix;
}

/// The pose of the depth camera; it must be a rigid transform.
void read_color_from_depth(const ConfigNode& node, Camera& camera, ConfigProblems& problems) {
  // A matrix of sixteen numbers
  const std::string path = "color_from_depth";
  const std::optional<Eigen::Matrix4d> matrix = read_matrix(node);
  if (!matrix) {
    problems.push_back(
        {node.mark, path, "is not a 4x4 matrix (allowed: four lists of four numbers, or 16 numbers)"});
    return;
  }

  // Orthonormal, right-handed, homogeneous
  const Eigen::Matrix3d r = matrix->topLeftCorner<3, 3>();
  const double error = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const bool last_row = (matrix->row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < 1e-9;
  if (error > kRigidTolerance || r.determinant() < 0.0 || !last_row) {
    problems.push_back({node.mark, path,
                        "is not rigid (allowed: a rotation and a translation in metres, last row 0 0 0 1)"});
    return;
  }
  camera.color_from_depth = geometry::Rigid3(Eigen::Quaterniond(r), matrix->topRightCorner<3, 1>());
}

/// The model and coefficients of an image's lens, as in the file.
struct LensKeys {
  std::string model = "pinhole";
  std::vector<double> distortion = {0.0, 0.0, 0.0, 0.0, 0.0};

  void declare(core::OptionTable& table) {
    table.choice("model", model, {"pinhole", "equidistant", "fisheye"}, "Camera model");
    table.numbers("distortion", distortion, 0, {}, "",
                  "k1 k2 p1 p2 k3 [k4 k5 k6] of a pinhole, k1 k2 k3 k4 of an equidistant camera (fisheye)");
  }
  [[nodiscard]] Lens lens(const ConfigNode& map, const std::string& path, ConfigProblems& problems) const;
};

/// Checks the number of coefficients against the model.
Lens LensKeys::lens(const ConfigNode& map, const std::string& path, ConfigProblems& problems) const {
  Lens lens;
  if (model != "pinhole") lens.model = LensModel::kEquidistant;
  const bool pinhole = lens.model == LensModel::kRadialTangential;
  const std::size_t n = distortion.size();
  const ConfigNode* node = map.find("distortion");
  const bool zeros = node == nullptr;  // without the key: the default list is longer than a fisheye's
  if (!zeros && !(pinhole ? (n >= 1 && n <= 5) || n == 8 : n >= 1 && n <= 4)) {
    problems.push_back({node->mark, join(path, "distortion"),
                        fmt::format("has {} numbers (allowed: {})", n,
                                    pinhole ? "1 to 5 of k1, k2, p1, p2, k3, or 8 with k4, k5, k6"
                                            : "1 to 4 of k1, k2, k3, k4")});
    return lens;
  }
  if (!zeros) std::copy(distortion.begin(), distortion.end(), lens.k.begin());
  return lens;
}

void read_depth_camera(const ConfigNode& root, Camera& camera, ConfigProblems& problems) {
  // Size and pose belong together
  const ConfigNode* transform = root.find("color_from_depth");
  const ConfigNode* depth = root.find("depth");
  if (transform != nullptr) read_color_from_depth(*transform, camera, problems);
  if (transform != nullptr && depth == nullptr) {
    problems.push_back(
        {transform->mark, "depth",
         "is missing: color_from_depth needs the depth camera's own width height fx fy cx cy"});
  }
  if (depth == nullptr) return;

  // Intrinsics without a pose
  if (transform == nullptr) {
    problems.push_back({depth->mark, "color_from_depth",
                        "is missing: a separate depth camera needs its pose (4x4, metres)"});
  }
  if (depth->kind != ConfigNode::Kind::kMap) {
    problems.push_back({depth->mark, "depth", "must hold the keys width height fx fy cx cy"});
    return;
  }

  // The same keys as the colour camera's
  Pinhole pinhole;
  LensKeys lens;
  core::OptionTable table;
  declare_pinhole(table, pinhole);
  lens.declare(table);
  table.set_all(*depth, "depth", problems);
  check_pinhole(*depth, pinhole, "depth", problems);
  camera.depth = pinhole;
  camera.depth_lens = lens.lens(*depth, "depth", problems);
}

/// Text as YAML, quoted where needed.
std::string text_yaml(std::string text) {
  core::OptionTable table;
  table.text("text", text, "");
  return table.value("text");
}

std::string pinhole_yaml(const Pinhole& p, const std::string& indent) {
  // "{}" prints the shortest text that reads back as the same double
  return fmt::format("{0}width: {1}\n{0}height: {2}\n{0}fx: {3}\n{0}fy: {4}\n{0}cx: {5}\n{0}cy: {6}\n",
                     indent, p.width, p.height, p.fx, p.fy, p.cx, p.cy);
}

/// The coefficients of a lens: those that its model has, without unused ones.
std::string lens_yaml(const Lens& lens, const std::string& indent) {
  const bool pinhole = lens.model == LensModel::kRadialTangential;
  const bool rational = pinhole && (lens.k[5] != 0.0 || lens.k[6] != 0.0 || lens.k[7] != 0.0);
  const std::size_t count = !pinhole ? 4 : rational ? 8 : 5;
  const std::vector<double> k(lens.k.begin(), lens.k.begin() + static_cast<std::ptrdiff_t>(count));
  const char* names = !pinhole ? "k1 k2 k3 k4" : rational ? "k1 k2 p1 p2 k3 k4 k5 k6" : "k1 k2 p1 p2 k3";
  return fmt::format("{}distortion: [{}]  # {}\n", indent, fmt::join(k, ", "), names);
}

const char* model_name(LensModel model) {
  return model == LensModel::kEquidistant ? "equidistant" : "pinhole";
}

/// The keys of CameraSigma, in the order of the file.
std::vector<std::pair<const char*, double*>> sigma_keys(CameraSigma& sigma) {
  return {{"fx", &sigma.fx},
          {"centre", &sigma.centre},
          {"distortion", &sigma.distortion},
          {"readout", &sigma.readout_s},
          {"depth_slope", &sigma.depth_slope},
          {"depth_delay", &sigma.depth_delay_s}};
}

/// Standard deviations of the calibration, by key.
void read_sigma(const ConfigNode& root, CameraSigma& sigma, ConfigProblems& problems) {
  const ConfigNode* node = root.find("sigma");
  if (node == nullptr) return;
  if (node->kind != ConfigNode::Kind::kMap) {
    problems.push_back(
        {node->mark, "sigma", "must hold standard deviations, such as {fx: 0.8, readout: 0.5 ms}"});
    return;
  }
  core::OptionTable table;
  for (const auto& [key, value] : sigma_keys(sigma)) {
    const bool seconds = value == &sigma.readout_s || value == &sigma.depth_delay_s;
    table.number(key, *value, {0.0, 1e3}, seconds ? "s" : "", "Standard deviation; 0: not known");
  }
  double of_scale = 0.0;  // adjust tells it to readers; nothing here estimates the scale
  table.number("depth_scale", of_scale, {0.0, 1e6}, "", "Standard deviation; 0: not known");
  table.set_all(*node, "sigma", problems);
}

std::string sigma_yaml(CameraSigma sigma) {
  std::vector<std::string> told;
  for (const auto& [key, value] : sigma_keys(sigma)) {
    if (*value > 0.0) told.push_back(fmt::format("{}: {:.3g}", key, *value));
  }
  return told.empty() ? "" : fmt::format("sigma: {{{}}}  # standard deviations\n", fmt::join(told, ", "));
}

core::Result<Camera> camera_in(core::Result<ConfigNode> root, const std::filesystem::path& file) {
  // Only a map of keys is a camera file
  if (!root) return tl::unexpected(root.error());
  ConfigProblems problems;
  if (root->kind != ConfigNode::Kind::kMap && root->kind != ConfigNode::Kind::kNull) {
    problems.push_back({root->mark, "", "is not a camera file: expected lines such as 'fx: 525.0'"});
    return tl::unexpected(core::to_error(problems));
  }
  if (root->mark.file.empty()) root->mark = {file.string(), 1, 1};

  // Keys of the colour camera
  Camera camera;
  LensKeys lens;
  core::OptionTable table;
  declare_pinhole(table, camera.color);
  table.text("name", camera.name, "Name of the camera; empty: the file's name", core::EmptyValue::kAllowed);
  lens.declare(table);
  table.number("depth_scale", camera.depth_scale, {1e-3, 1e7}, "", "Raw depth units per metre");
  table.number("fps", camera.fps, {1e-3, 1e4}, "", "Pairs a second");

  // Readout of a rolling shutter
  double readout_s = 0.0;
  table.number("readout", readout_s, {0.0, 0.1}, "s",
               "Time from the first to the last row of an image; 0: all at once");

  // Corrections of depth images
  std::vector<double> slope(2, 0.0);
  table.numbers("depth_slope", slope, 2, {-0.2, 0.2}, "1/m",
                "Slope along x and y: added to 1 / depth on the ray (x, y, 1)");
  table.number("depth_delay", camera.depth_delay_s, {-0.1, 0.1}, "s",
               "Delay of depth images after their stamps");
  if (root->kind == ConfigNode::Kind::kMap)
    table.set_all(*root, "", problems, {"color_from_depth", "depth", "sigma"});

  // Relations between keys
  check_pinhole(*root, camera.color, "", problems);
  const Lens color_lens = lens.lens(*root, "", problems);
  camera.model = color_lens.model;
  camera.distortion = color_lens.k;
  if (root->find("readout") != nullptr) camera.readout_s = readout_s;
  if (slope.size() == camera.depth_slope.size()) std::copy_n(slope.begin(), 2, camera.depth_slope.begin());
  read_depth_camera(*root, camera, problems);
  read_sigma(*root, camera.sigma, problems);

  // All problems are reported at once
  if (!problems.empty()) return tl::unexpected(core::to_error(problems));
  if (camera.name.empty()) camera.name = file.stem().string();
  return camera;
}

}  // namespace

core::Result<Camera> read_camera(const std::filesystem::path& file) {
  return camera_in(core::read_yaml(file), file);
}

core::Result<Camera> parse_camera(const std::string& text, const std::string& file_name) {
  return camera_in(core::parse_yaml(text, file_name), file_name);
}

std::string to_yaml(const Camera& camera) {
  // Keys that every camera has
  std::string text = camera.name.empty() ? "" : fmt::format("name: {}\n", text_yaml(camera.name));
  text += fmt::format("model: {}\n", model_name(camera.model)) + pinhole_yaml(camera.color, "");
  text += lens_yaml(camera.lens(), "");
  text += fmt::format("depth_scale: {}  # raw units per metre\nfps: {}\n", camera.depth_scale, camera.fps);

  // Keys that few cameras need
  if (camera.readout_s) {
    text += fmt::format("readout: {}  # s from the first row of an image to the last; 0: all at once\n",
                        *camera.readout_s);
  }

  // A slope corrects the depth
  if (camera.depth_slope != std::array<double, 2>{}) {
    text += fmt::format("depth_slope: [{}, {}]  # 1/m along x, y: added to 1 / depth on the ray (x, y, 1)\n",
                        camera.depth_slope[0], camera.depth_slope[1]);
  }

  // A delay of the depth sensor
  if (camera.depth_delay_s != 0.0) {
    text += fmt::format("depth_delay: {}  # s that depth images were taken later than their stamps say\n",
                        camera.depth_delay_s);
  }
  text += sigma_yaml(camera.sigma);

  // A separate depth camera
  if (camera.color_from_depth && camera.depth) {
    const Eigen::Matrix4d m = camera.color_from_depth->isometry().matrix();
    text += "color_from_depth:\n";
    for (int r = 0; r < 4; ++r) {
      text += fmt::format("  - [{}, {}, {}, {}]\n", m(r, 0), m(r, 1), m(r, 2), m(r, 3));
    }

    // Its intrinsics and lens
    text += "depth:\n" + pinhole_yaml(*camera.depth, "  ");
    if (camera.depth_lens.distorts()) {
      text += fmt::format("  model: {}\n", model_name(camera.depth_lens.model));
      text += lens_yaml(camera.depth_lens, "  ");
    }
  }
  return text;
}

}  // namespace plumbline::sensor
