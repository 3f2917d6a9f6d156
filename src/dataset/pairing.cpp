// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <system_error>
#include <tuple>

#include "layout.hpp"

namespace plumbline::dataset {
namespace {

constexpr double kStampResolution = 1e-6;  // of seconds since 1970 in a double, rounded up

bool earlier(const StampedFile& file, double stamp) { return file.stamp < stamp; }

}  // namespace

long long stamp_gap_us(double color_stamp, double depth_stamp, double depth_delay_s) {
  return std::llround(std::abs(depth_stamp - (color_stamp - depth_delay_s)) / kStampResolution);
}

std::shared_ptr<ImageSource> images_of(const std::vector<StampedFile>& color,
                                       const std::vector<StampedFile>& depth) {
  auto images = std::make_shared<FileImages>();
  for (const StampedFile& file : color) images->add(ImageList::kColor, file.file);
  for (const StampedFile& file : depth) images->add(ImageList::kDepth, file.file);
  return images;
}

std::vector<PairInfo> pair_by_stamp(const std::vector<StampedFile>& color,
                                    const std::vector<StampedFile>& depth, double max_gap_s,
                                    double depth_delay_s) {
  const double reach = max_gap_s + kStampResolution;
  // Gap, colour, depth.
  std::vector<std::tuple<long long, std::size_t, std::size_t>> candidates;

  for (std::size_t i = 0; i < color.size(); ++i) {
    const double stamp = color[i].stamp - depth_delay_s;  // of depth taken at the same moment
    for (auto d = std::lower_bound(depth.begin(), depth.end(), stamp - reach, earlier);
         d != depth.end() && d->stamp <= stamp + reach; ++d) {
      candidates.emplace_back(stamp_gap_us(color[i].stamp, d->stamp, depth_delay_s), i,
                              static_cast<std::size_t>(d - depth.begin()));
    }
  }

  std::sort(candidates.begin(), candidates.end());

  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> depth_of(color.size(), none);
  std::vector<bool> used(depth.size(), false);
  for (const auto& [gap, i, j] : candidates) {
    if (depth_of[i] != none || used[j]) continue;
    depth_of[i] = j;
    used[j] = true;
  }

  std::vector<PairInfo> pairs;
  for (std::size_t i = 0; i < color.size(); ++i) {
    if (depth_of[i] == none) continue;
    const std::size_t j = depth_of[i];
    pairs.push_back({color[i].stamp, depth[j].stamp, {ImageList::kColor, i}, {ImageList::kDepth, j}});
  }

  return pairs;
}

std::string no_common_time(const std::string& color_name, const std::vector<StampedFile>& color,
                           const std::string& depth_name, const std::vector<StampedFile>& depth,
                           double max_gap_s) {
  double nearest = std::numeric_limits<double>::infinity();

  // Neighbours in time on both sides
  for (const StampedFile& c : color) {
    const auto after = std::lower_bound(depth.begin(), depth.end(), c.stamp, earlier);
    if (after != depth.end()) nearest = std::min(nearest, after->stamp - c.stamp);
    if (after != depth.begin()) nearest = std::min(nearest, c.stamp - (after - 1)->stamp);
  }
  return fmt::format(
      "{} and {} have no frame in common in time: the nearest stamps are {:.3f} s apart (allowed: {:.3f} s); "
      "colour covers {:.3f} to {:.3f}, depth {:.3f} to {:.3f}; check that both lists are of one recording "
      "and one clock",
      color_name, depth_name, nearest, max_gap_s, color.front().stamp, color.back().stamp,
      depth.front().stamp, depth.back().stamp);
}

core::Result<void> check_files(const std::string& list, const std::vector<StampedFile>& files) {
  bool denied = false;

  // One existing file is enough
  for (const StampedFile& file : files) {
    std::error_code why;
    if (std::filesystem::exists(file.file, why)) return {};
    if (&file == &files.front()) denied = why == std::errc::permission_denied;
  }

  // Missing permission has another remedy
  const StampedFile& first = files.front();
  if (denied) {
    return core::input_error(
        fmt::format("{}:{}: names {}, which cannot be reached: no permission for its folder", list,
                    first.line, first.file));
  }

  // If all files are missing, their place is wrong
  return core::input_error(
      fmt::format("{}:{}: names {}, which does not exist, and none of its {} files does; copy the image "
                  "folder beside the list or correct the list",
                  list, first.line, first.file, files.size()));
}

}  // namespace plumbline::dataset
