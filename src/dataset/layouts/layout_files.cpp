// SPDX-License-Identifier: BSD-3-Clause
// Helpers for the readers of several layouts: numbered images, poses in separate files.
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "layout.hpp"
#include "plumbline/core/numbers.hpp"
#include "plumbline/core/text.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& file) {
  const std::string extension = core::ending_of(file);
  for (const char* known : {".png", ".jpg", ".jpeg", ".pgm", ".tif", ".tiff", ".exr", ".npy"}) {
    if (extension == known) return true;
  }
  return false;
}

}  // namespace

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

std::optional<double> json_number(const nlohmann::ordered_json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  if (found == object.end() || !found->is_number()) return std::nullopt;
  const auto value = found->get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

geometry::Rigid3 from_arkit(const geometry::Rigid3& transform) {
  Eigen::Matrix3d world;  // x y z of the one world are x -z y of the other
  world << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Eigen::Matrix3d camera = Eigen::Vector3d(1, -1, -1).asDiagonal();
  return geometry::Rigid3(world, Eigen::Vector3d::Zero()) * transform *
         geometry::Rigid3(camera, Eigen::Vector3d::Zero());
}

/// The numbers of at most 18 digits in a file's name, in order.
std::vector<long long> numbers_of(const std::string& name) {
  std::vector<long long> numbers;
  for (std::size_t i = 0; i < name.size();) {
    std::size_t end = i;
    while (end < name.size() && name[end] >= '0' && name[end] <= '9') ++end;
    if (end > i && end - i <= 18) numbers.push_back(std::stoll(name.substr(i, end - i)));
    i = end + 1;
  }
  return numbers;
}

/// The images of a folder by the first number after the prefix.
NumberedFiles numbered_images(const fs::path& folder, const std::string& prefix) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const bool wanted = entry.path().filename().string().compare(0, prefix.size(), prefix) == 0;
    if (wanted && is_image(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());

  // The first of two files with one number counts
  std::map<long long, std::string> images;
  for (const fs::path& file : files) {
    const std::vector<long long> numbers = numbers_of(file.stem().string().substr(prefix.size()));
    if (!numbers.empty()) images.emplace(numbers[0], file.string());
  }
  return {images.begin(), images.end()};
}

/// Pairs colour and depth of the same number; the stamp is number / fps.
Layout numbered_layout(const char* format, const NumberedFiles& color, const NumberedFiles& depth,
                       double fps) {
  const auto images = std::make_shared<FileImages>();
  std::map<long long, ImageId> partners;
  for (const auto& [number, file] : depth) partners[number] = images->add(ImageList::kDepth, file);

  Layout layout{format};
  layout.images = images;
  for (const auto& [number, file] : color) {
    const ImageId image = images->add(ImageList::kColor, file);
    const auto partner = partners.find(number);
    if (partner == partners.end()) continue;
    const double stamp = static_cast<double>(number) / fps;
    layout.pairs.push_back({stamp, stamp, image, partner->second});
  }
  return layout;
}

/// A 4x4 matrix; none if a number is missing or not finite.
std::optional<geometry::Rigid3> read_pose_file(const std::string& file) {
  const auto lines = read_lines(file);
  if (!lines || lines->size() != 4) return std::nullopt;

  // Four rows of four finite numbers
  Eigen::Matrix4d matrix;
  for (std::size_t r = 0; r < 4; ++r) {
    const std::vector<std::string>& words = (*lines)[r].words;
    if (words.size() != 4) return std::nullopt;
    for (std::size_t c = 0; c < 4; ++c) {
      const std::optional<double> value = core::to_number(words[c]);
      if (!value || !std::isfinite(*value)) return std::nullopt;
      matrix(static_cast<int>(r), static_cast<int>(c)) = *value;
    }
  }

  // Damaged or scaled matrices are rejected
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  if ((rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 0.01) {
    return std::nullopt;
  }
  return geometry::Rigid3(Eigen::Quaterniond(rotation), matrix.topRightCorner<3, 1>());
}

}  // namespace plumbline::dataset
