// SPDX-License-Identifier: BSD-3-Clause
// The merged cloud in a report: extent, plan, numbers.
#include "report_cloud.hpp"

#include <fmt/format.h>
#include <pcl/common/point_tests.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <opencv2/core/mat.hpp>

#include "plumbline/core/numbers.hpp"
#include "plumbline/dataset/image_io.hpp"
#include "report_fill.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

constexpr double kOuter = 0.005;
constexpr int kPlanPixels = 800;  ///< of the longer side

/// Share of the points that each robot saw most.
void add_robots(const ReportData& data, Facts& facts) {
  const std::vector<std::uint8_t>& robots = data.cloud->columns.robot;
  if (robots.empty()) return;
  std::array<std::size_t, 256> counts{};
  for (const std::uint8_t robot : robots) ++counts[robot];
  std::string text;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    const auto name = data.robot_names.find(static_cast<std::int32_t>(i));
    text += fmt::format("{}{}: {}", text.empty() ? "" : ", ",
                        name != data.robot_names.end() ? name->second : fmt::format("robot {}", i),
                        count_text(static_cast<double>(counts[i])));
  }
  facts.emplace_back("Points by the robot that saw them most", text);
}

/// Adds the points that filters removed from the clouds of keyframes, or from the merged one.
void add_left_out(const ReportData& data, const char* place, const char* name, Facts& facts) {
  std::string text;
  for (const auto& part : list_at(data.summary, place)) {
    const double points = number_at(part, "/points");
    if (points > 0.0) {
      text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", text_at(part, "/by"), count_text(points));
    }
  }
  if (!text.empty()) facts.emplace_back(name, text);
}

std::string box_text(const Eigen::Vector3d& size) {
  return fmt::format("{:.3f} × {:.3f} × {:.3f} m (x × y × z)", size.x(), size.y(), size.z());
}
std::string range_text(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return fmt::format("x {:.3f} to {:.3f}, y {:.3f} to {:.3f}, z {:.3f} to {:.3f} m", low.x(), high.x(),
                     low.y(), high.y(), low.z(), high.z());
}

/// Corners of the plan's area: all but points far away from all others.
std::pair<Eigen::Vector3d, Eigen::Vector3d> shown(const CloudExtent& extent) {
  const Eigen::Vector3d margin = 0.25 * extent.central_size();
  return {extent.low.cwiseMax(extent.central_low - margin),
          extent.high.cwiseMin(extent.central_high + margin)};
}

/// Number of points in each cell; rows from the top.
cv::Mat counted(const ReportData& data, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                double cell_m) {
  const auto [across, up] = plan_axes(data);
  const auto cells = [&](int axis) {
    return std::max(1, static_cast<int>(std::ceil((high[axis] - low[axis]) / cell_m)));
  };
  cv::Mat counts = cv::Mat::zeros(cells(up), cells(across), CV_32S);
  for (const cloud::Point& p : *data.cloud->cloud) {
    if (!pcl::isXYZFinite(p)) continue;
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>();
    const double column = (at[across] - low[across]) / cell_m;
    const double row = (at[up] - low[up]) / cell_m;
    if (!(column >= 0.0 && column < counts.cols && row >= 0.0 && row < counts.rows)) continue;
    ++counts.at<int>(counts.rows - 1 - static_cast<int>(row), static_cast<int>(column));
  }
  return counts;
}

/// Count of the darkest cells: the 97th percentile of the counts above zero.
double darkest(const cv::Mat& counts) {
  std::vector<double> known;
  std::copy_if(counts.begin<int>(), counts.end<int>(), std::back_inserter(known),
               [](int n) { return n > 0; });
  return std::max(1.0, core::quantile(std::move(known), 0.97));
}

}  // namespace

std::optional<CloudExtent> measure_extent(const cloud::Cloud& cloud) {
  std::array<std::vector<float>, 3> values;
  for (const cloud::Point& p : cloud) {
    if (!pcl::isXYZFinite(p)) continue;
    values[0].push_back(p.x);
    values[1].push_back(p.y);
    values[2].push_back(p.z);
  }

  // Number of outer points on each side.
  const std::size_t count = values[0].size();
  if (count == 0) return std::nullopt;
  CloudExtent extent;
  const auto outer = static_cast<std::ptrdiff_t>(kOuter * static_cast<double>(count));

  // Bounds of each axis.
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float>& v = values[static_cast<std::size_t>(axis)];
    const auto [low, high] = std::minmax_element(v.begin(), v.end());
    extent.low[axis] = *low;

    // Bounds without outliers.
    extent.high[axis] = *high;
    std::nth_element(v.begin(), v.begin() + outer, v.end());
    extent.central_low[axis] = v[static_cast<std::size_t>(outer)];
    std::nth_element(v.begin(), v.end() - 1 - outer, v.end());
    extent.central_high[axis] = *(v.end() - 1 - outer);
  }

  return extent;
}

std::pair<int, int> plan_axes(const ReportData& data) { return {0, data.z_up ? 1 : 2}; }

std::optional<viz::SvgBackground> plan_of(const ReportData& data) {
  if (!data.extent) return std::nullopt;
  const auto [low, high] = shown(*data.extent);
  const auto [across, up] = plan_axes(data);

  // Cells no finer than pixels and voxels.
  const double longest = std::max(high[across] - low[across], high[up] - low[up]);
  const double cell_m =
      std::max({longest / kPlanPixels, 1.5 * number_at(data.summary, "/cloud/voxel_m"), 1e-3});
  const cv::Mat counts = counted(data, low, high, cell_m);
  const double most = std::log1p(darkest(counts));

  // Opacity by the logarithm of the count.
  cv::Mat picture(counts.size(), CV_8UC4);
  for (int row = 0; row < counts.rows; ++row) {
    for (int column = 0; column < counts.cols; ++column) {
      const double share = std::min(1.0, std::log1p(counts.at<int>(row, column)) / most);
      picture.at<cv::Vec4b>(row, column) = {130, 122, 115, static_cast<unsigned char>(215.0 * share * share)};
    }
  }

  constexpr int kSmall = 9;
  const auto png = dataset::encode_png(picture, kSmall);
  if (!png) return std::nullopt;

  // The image becomes part of the page.
  viz::SvgBackground plan;
  plan.data_uri =
      "data:image/png;base64," + base64({reinterpret_cast<const char*>(png->data()), png->size()});
  plan.x = {low[across], low[across] + cell_m * counts.cols};
  plan.y = {low[up], low[up] + cell_m * counts.rows};
  return plan;
}

std::string cloud_html(const ReportData& data) {
  const double voxel_m = number_at(data.summary, "/cloud/voxel_m");
  Facts facts{
      {"Points", count_at(data.summary, "/cloud/points")},
      {"Voxel size", voxel_m > 0.0 ? number_text(1e3 * voxel_m, 1, "mm") : "no cloud was to be made"}};
  add_left_out(data, "/cloud/left_out", "Left out of what keyframes measured, points", facts);
  add_left_out(data, "/cloud/left_out_of_map", "Left out of the merged cloud, points", facts);

  // Sizes, with and without outliers.
  std::string out;
  if (const std::optional<CloudExtent>& extent = data.extent) {
    facts.emplace_back("File", data.cloud_file);
    facts.emplace_back("Bounding box", box_text(extent->size()));
    facts.emplace_back("Bounding box without the outer 0.5 % of each side", box_text(extent->central_size()));
    facts.emplace_back("Coordinates", range_text(extent->low, extent->high));

    // Uncertainty, if the cloud has it.
    if (number_at(data.summary, "/cloud/sigma_m/median") > 0.0) {
      facts.emplace_back("Standard deviation along the normal, of poses and depth",
                         filled(data.summary,
                                "{/cloud/sigma_m/median:1 mm} in the middle, below {/cloud/sigma_m/p90:1 mm} "
                                "for 90 % of the points"));
    }

    add_robots(data, facts);

    // The file may have been changed since.
    const double counted = number_at(data.summary, "/cloud/points");
    const auto found = static_cast<double>(data.cloud->cloud->size());
    if (counted != found) {
      out = note(fmt::format("{} holds {} points, but the run wrote {}: the file was changed since.",
                             data.cloud_file, count_text(found), count_text(counted)));
    }
  }

  const bool sigma = number_at(data.summary, "/cloud/sigma_m/median") > 0.0;
  return facts_html(facts) + (sigma ? note(kSigmaNote) : "") + out;
}

}  // namespace plumbline::report
