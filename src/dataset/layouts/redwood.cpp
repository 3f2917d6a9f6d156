// SPDX-License-Identifier: BSD-3-Clause
// Redwood and Open3D layout: color/, image/ or rgb/, and depth/, files matched by their number;
// trajectory.log (Choi, Zhou, Koltun: Robust Reconstruction of Indoor Scenes, CVPR 2015) as truth.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "layout.hpp"
#include "plumbline/core/numbers.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

constexpr double kMicroseconds = 1e-6;

std::optional<fs::path> color_folder(const fs::path& folder) {
  for (const char* name : {"color", "image", "rgb"}) {
    if (is_folder(folder / name)) return folder / name;
  }
  return std::nullopt;
}

/// Images by the stamps in names such as 0000012-000000400431.jpg: number, microseconds; none if one has no
/// such name.
std::optional<std::vector<StampedFile>> by_stamp(const NumberedFiles& images) {
  std::vector<StampedFile> files;
  for (const auto& [number, file] : images) {
    const std::vector<long long> numbers = numbers_of(fs::path(file).stem().string());
    if (numbers.size() != 2) return std::nullopt;
    files.push_back({static_cast<double>(numbers[1]) * kMicroseconds, file, 0});
  }
  std::sort(files.begin(), files.end(), kByStamp);
  return files;
}

/// Blocks of "a b c" and four rows of a 4x4 world_from_camera; a is the position of the pair.
geometry::Trajectory read_log(const fs::path& file, const std::vector<PairInfo>& pairs, core::Log& log) {
  geometry::Trajectory truth;
  const auto lines = read_lines(file);
  if (!lines) return truth;

  for (std::size_t i = 0; i + 4 < lines->size(); i += 5) {
    const std::optional<double> index = core::to_number((*lines)[i].words[0]);
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
    bool good = index && *index >= 0.0 && *index < static_cast<double>(pairs.size());

    for (std::size_t r = 0; r < 4; ++r) {
      const std::vector<std::string>& words = (*lines)[i + 1 + r].words;
      for (std::size_t c = 0; c < 4 && c < words.size(); ++c) {
        matrix(static_cast<int>(r), static_cast<int>(c)) = core::to_number(words[c]).value_or(NAN);
      }
    }

    // A pose is rigid up to rounding
    const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
    const double error =
        (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    good = good && matrix.allFinite() && error < 0.01;

    // The truth ends at the first damaged pose
    if (!good) {
      log.warning(fmt::format("{}:{}: is not the pose of a pair; the truth ends here", file.string(),
                              (*lines)[i].number));
      break;
    }

    truth.push_back({pairs[static_cast<std::size_t>(*index)].stamp,
                     geometry::Rigid3(Eigen::Quaterniond(rotation), matrix.topRightCorner<3, 1>())});
  }

  std::stable_sort(truth.begin(), truth.end(), kByStamp);
  return truth;
}

bool looks_like_redwood(const fs::path& folder) {
  return color_folder(folder) && is_folder(folder / "depth");
}

core::Result<Layout> read_redwood(const fs::path& folder, const LayoutOptions& options, core::Log& log) {
  const std::optional<fs::path> colors = color_folder(folder);
  if (!colors || !is_folder(folder / "depth")) {
    return core::input_error(fmt::format(
        "{}: no {} folder (a Redwood or Open3D recording needs color/, image/ or rgb/, and depth/)",
        folder.string(), colors ? "depth/" : "colour"));
  }

  // Both folders have images.
  const auto color = numbered_images(*colors);
  const auto depth = numbered_images(folder / "depth");
  for (const auto& [images, path] : {std::pair(&color, *colors), std::pair(&depth, folder / "depth")}) {
    if (images->empty()) {
      return core::input_error(
          fmt::format("{}: no numbered image (looked for .png, .jpg, .pgm, .tiff, .exr)", path.string()));
    }
  }

  // By stamps where all names have them, else by number.
  Layout layout = numbered_layout("redwood", color, depth, options.fps);
  const auto c = by_stamp(color);
  const auto d = by_stamp(depth);

  // Stamps may differ a little, numbers may not
  if (c && d) {
    layout.pairs = pair_by_stamp(*c, *d, options.max_pair_gap_s);
    layout.images = images_of(*c, *d);
    if (layout.pairs.empty()) {
      return core::input_error(
          no_common_time(colors->string(), *c, (folder / "depth").string(), *d, options.max_pair_gap_s));
    }
  }

  // The numbers of both folders must overlap
  if (layout.pairs.empty()) {
    return core::input_error(
        fmt::format("{}: no number is in both {}/ ({} to {}) and depth/ ({} to {}); colour and depth are "
                    "matched by number",
                    folder.string(), colors->filename().string(), color.front().first, color.back().first,
                    depth.front().first, depth.back().first));
  }

  // Images without a partner are reported
  const std::size_t unmatched = color.size() + depth.size() - 2 * layout.pairs.size();
  if (unmatched > 0) {
    log.warning(fmt::format("{}: {} images have no partner and are skipped", folder.string(), unmatched));
  }

  std::error_code ignored;
  if (fs::is_regular_file(folder / "trajectory.log", ignored)) {
    geometry::Trajectory truth = read_log(folder / "trajectory.log", layout.pairs, log);
    if (!truth.empty()) layout.truth = std::move(truth);
  }

  return layout;
}

}  // namespace

const LayoutFormat& redwood_layout() {
  static const LayoutFormat format = {"redwood",
                                      "Redwood, Open3D",
                                      "color/ or image/ or rgb/ beside depth/",
                                      {"color/|image/|rgb/", "depth/"},
                                      &looks_like_redwood,
                                      &read_redwood};
  return format;
}

}  // namespace plumbline::dataset
