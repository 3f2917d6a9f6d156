// SPDX-License-Identifier: BSD-3-Clause
#include "results/debug_video.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <opencv2/core/mat.hpp>
#include <string>
#include <system_error>

#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "plumbline/tracking/overlay.hpp"

namespace plumbline::pipeline {
namespace {

namespace fs = std::filesystem;

std::string picture_name(std::size_t number) { return fmt::format("{:06}.png", number); }

bool is_picture_name(const std::string& name) {
  const std::size_t dot = name.find('.');
  return dot != std::string::npos && dot >= 6 && name.substr(dot) == ".png" &&
         std::all_of(name.begin(), name.begin() + static_cast<std::ptrdiff_t>(dot),
                     [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// True for a folder of debug pictures. Numbered pictures alone may be anybody's.
bool is_debug_folder(const fs::path& folder) {
  std::error_code ec;
  if (!fs::is_regular_file(folder / maps::kFilesMarker, ec)) return false;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ec)) {
    const std::string name = entry.path().filename().string();
    const bool marker = name.rfind(".plumbline-", 0) == 0;
    if (!entry.is_regular_file(ec) || (!marker && !is_picture_name(name))) return false;
  }
  return !ec;
}

fs::path resolved(const fs::path& path) {
  std::error_code ec;
  const fs::path result = fs::weakly_canonical(fs::absolute(path), ec);
  return ec ? fs::absolute(path).lexically_normal() : result;
}

/// `path` as seen from `folder` when it lies in it ("." is the folder itself), else empty.
fs::path inside(const fs::path& folder, const fs::path& path) {
  fs::path relative = resolved(path / ".").lexically_relative(resolved(folder / "."));
  if (!relative.empty() && *relative.begin() == "..") relative.clear();
  return relative;
}

}  // namespace

core::Result<DebugFolder> DebugFolder::prepare(const fs::path& folder, const fs::path& out,
                                               const fs::path& out_path, bool replace) {
  DebugFolder result;

  // A folder of debug pictures is replaced as a whole by the next run, so it must not hold a result.
  if (!inside(folder, out).empty()) {
    return core::usage_error(
        fmt::format("{}: holds the result folder {}; debug pictures need a folder of their own",
                    folder.string(), out.string()));
  }

  const fs::path relative = inside(out, folder);
  if (relative.empty()) {
    static const maps::FolderKind kind{is_debug_folder, {"*.png"}, true};
    auto own = maps::OutputFolder::prepare(folder, replace, false, kind);
    if (!own) return tl::unexpected(own.error());
    result.path_ = own->path();
    result.own_.emplace(std::move(*own));
    return result;
  }

  // Inside the result the pictures are written to its temporary folder and appear together with it.
  result.path_ = out_path / relative;
  result.within_ = relative;
  if (auto made = core::make_folder(result.path_); !made) return tl::unexpected(made.error());
  return result;
}

core::FileNames DebugFolder::files() const {
  if (own_) return {};
  return {(within_ / "*.png").lexically_normal().generic_string()};
}

core::Result<void> write_debug_picture(const fs::path& folder, std::size_t number,
                                       const sensor::RgbdFrame& frame,
                                       const features::FrameFeatures& features, const maps::Map& map,
                                       const mapping::FrameReport& report, const sensor::Pinhole& camera) {
  sensor::RgbdFrame shown = frame;
  shown.index = static_cast<std::int64_t>(number);  // as in frames.csv
  tracking::TrackResult track = *report.track;
  // A keyframe has moved with the landmarks when the map was adjusted to it.
  if (report.keyframe.valid()) track.camera_from_world = map.camera_from_world(report.keyframe);
  const cv::Mat picture = tracking::draw_overlay(shown, features, track, map, camera);
  return dataset::write_png(folder / picture_name(number), picture);
}

}  // namespace plumbline::pipeline
