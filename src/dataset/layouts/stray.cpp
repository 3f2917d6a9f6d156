// SPDX-License-Identifier: BSD-3-Clause
// Stray Scanner (a phone with LiDAR): rgb.mp4, depth/000000.png of 256 x 192 in millimetres,
// confidence/000000.png (0 means no measurement), odometry.csv with stamps and the phone's own poses,
// camera_matrix.csv for the video.
#include <fmt/format.h>

#include "images/film_images.hpp"
#include "layout.hpp"
#include "plumbline/dataset/trajectory_io.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

bool looks_like_stray(const fs::path& folder) {
  return is_file(folder / "rgb.mp4") && is_folder(folder / "depth") && is_file(folder / "odometry.csv");
}

core::Result<Layout> read_stray(const fs::path& folder, const LayoutOptions& /*options*/, core::Log& log) {
  auto odometry = read_trajectory_file(folder / "odometry.csv");
  if (!odometry) return tl::unexpected(odometry.error());
  for (const std::string& note : odometry->notes)
    log.warning(fmt::format("{}: {}", (folder / "odometry.csv").string(), note));

  // Pairs need a frame of the film
  const std::string film = (folder / "rgb.mp4").string();
  const auto frames = VideoFrames(film).count();
  if (!frames) return tl::unexpected(frames.error());

  // Colour is a film, depth a folder of images
  Layout layout;
  layout.format = "stray";
  const auto images = std::make_shared<FilmImages>(film);
  layout.images = images;
  const fs::path confidence = folder / "confidence";
  if (is_folder(confidence)) layout.confidence = confidence.string();

  // Depth's number is the row and the film's frame
  const auto rows = static_cast<long long>(odometry->rows.size());
  for (const auto& [number, file] : numbered_images(folder / "depth")) {
    if (number >= rows || number >= *frames) continue;
    const double stamp = odometry->rows[static_cast<std::size_t>(number)];
    const ImageId color{ImageList::kColor, static_cast<std::size_t>(number)};
    layout.pairs.push_back({stamp, stamp, color, images->add(ImageList::kDepth, file)});
  }

  if (layout.pairs.empty()) {
    return core::input_error(
        fmt::format("{}: no number is in rgb.mp4 ({} frames), odometry.csv ({} rows) and depth/ at once",
                    folder.string(), *frames, rows));
  }

  // ARKit's poses are odometry, not ground truth
  layout.truth = std::move(odometry->poses);
  layout.truth_is_odometry = true;
  return layout;
}

}  // namespace

const LayoutFormat& stray_layout() {
  static const LayoutFormat format = {"stray",
                                      "Stray Scanner",
                                      "rgb.mp4 beside depth/ and odometry.csv",
                                      {"rgb.mp4", "depth/", "odometry.csv", "camera_matrix.csv"},
                                      &looks_like_stray,
                                      &read_stray};
  return format;
}

}  // namespace plumbline::dataset
