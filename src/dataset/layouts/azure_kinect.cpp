// SPDX-License-Identifier: BSD-3-Clause
// Azure Kinect: what k4arecorder writes, one Matroska file.
#include "images/azure_kinect.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <fstream>

#include "layout.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

bool looks_like_matroska(const fs::path& file) {
  if (!is_file(file)) return false;
  std::array<char, 4> magic{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(magic.data(), magic.size());
  return stream && magic == std::array<char, 4>{'\x1A', '\x45', '\xDF', '\xA3'};
}

std::vector<StampedFile> stamps_in(const AzureKinectFile& file, ImageList list) {
  std::vector<StampedFile> stamps;
  for (const std::int64_t stamp : file.stamps(list))
    stamps.push_back({1e-6 * static_cast<double>(stamp), "", 0});
  return stamps;
}

core::Result<Layout> read_azure_kinect(const fs::path& path, const LayoutOptions& options, core::Log& log) {
  auto file = AzureKinectFile::open(path.string());
  if (!file) return tl::unexpected(file.error());

  const auto color = stamps_in(**file, ImageList::kColor);
  const auto depth = stamps_in(**file, ImageList::kDepth);
  Layout layout;
  layout.format = "azure-kinect";
  layout.pairs = pair_by_stamp(color, depth, options.max_pair_gap_s, options.depth_delay_s);

  // Without pairs the message names the reason
  if (layout.pairs.empty()) {
    return core::input_error(color.empty() || depth.empty()
                                 ? fmt::format("{}: holds {} colour and {} depth images; both are needed",
                                               path.string(), color.size(), depth.size())
                                 : no_common_time("colour", color, "depth", depth, options.max_pair_gap_s));
  }

  // Images without a partner are reported
  const std::size_t unmatched = color.size() + depth.size() - 2 * layout.pairs.size();
  if (unmatched > 0)
    log.warning(fmt::format("{}: {} images have no partner and are skipped", path.string(), unmatched));

  // The file holds the factory's calibration
  sensor::CameraReading camera;
  camera.program = fmt::format("Azure Kinect (its factory's calibration, {}, {})", (*file)->color_mode(),
                               (*file)->depth_mode());
  camera.camera = (*file)->camera();
  layout.camera = std::move(camera);
  layout.images = std::move(*file);
  return layout;
}

}  // namespace

const LayoutFormat& azure_kinect_layout() {
  static const LayoutFormat format = {"azure-kinect", "Azure Kinect",       "an .mkv file of k4arecorder",
                                      {"output.mkv"}, &looks_like_matroska, &read_azure_kinect};
  return format;
}

}  // namespace plumbline::dataset
