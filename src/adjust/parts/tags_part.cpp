// SPDX-License-Identifier: BSD-3-Clause
// Tags, by OpenCV's aruco.
#include <opencv2/aruco.hpp>

#include "tag_part.hpp"

namespace plumbline::adjust {
namespace {

cv::aruco::PREDEFINED_DICTIONARY_NAME dictionary_of(const std::string& family) {
  if (family == "4x4") return cv::aruco::DICT_4X4_250;
  if (family == "5x5") return cv::aruco::DICT_5X5_250;
  if (family == "6x6") return cv::aruco::DICT_6X6_250;
  return cv::aruco::DICT_APRILTAG_36h11;
}

std::vector<SeenTag> detect_tags(const cv::Mat& grey, const std::string& family) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(dictionary_of(family));
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, dictionary, corners, ids, parameters);

  std::vector<SeenTag> tags;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::vector<cv::Point2f>& c = corners[i];
    const cv::Point2d along = c[2] - c[0], across = c[3] - c[1], between = c[1] - c[0];
    const double area = along.cross(across);
    if (std::abs(area) < 100.0) continue;
    const cv::Point2d middle = cv::Point2d(c[0]) + along * (between.cross(across) / area);
    tags.push_back({ids[i], {middle.x, middle.y}});
  }
  return tags;
}

}  // namespace
}  // namespace plumbline::adjust

namespace pa = plumbline::adjust;
PLUMBLINE_PART(pa::TagFunctions, &pa::detect_tags)
