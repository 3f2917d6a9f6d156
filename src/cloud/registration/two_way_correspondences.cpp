// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/registration/two_way_correspondences.hpp"

#include <pcl/common/point_tests.h>

#include <Eigen/Geometry>

namespace plumbline::cloud {
namespace {

SurfacePoint moved(const SurfacePoint& point, const Eigen::Matrix4f& target_from_point) {
  SurfacePoint result = point;
  result.getVector3fMap() = target_from_point.topLeftCorner<3, 3>() * point.getVector3fMap() +
                            target_from_point.topRightCorner<3, 1>();
  result.getNormalVector3fMap() = target_from_point.topLeftCorner<3, 3>() * point.getNormalVector3fMap();
  return result;
}

}  // namespace

/// The motion of all points, from some that are spread over the cloud.
Eigen::Matrix4f TwoWayCorrespondences::source_from_moved() const {
  constexpr std::size_t kEnough = 64;
  const SurfaceCloud& source = *source_.cloud();
  const std::size_t count = std::min(kEnough, source.size());
  Eigen::Matrix3Xd before(3, static_cast<Eigen::Index>(count)), after(3, static_cast<Eigen::Index>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = i * source.size() / count;
    before.col(static_cast<Eigen::Index>(i)) = source[k].getVector3fMap().cast<double>();
    after.col(static_cast<Eigen::Index>(i)) = (*input_)[k].getVector3fMap().cast<double>();
  }
  return Eigen::umeyama(after, before, false).cast<float>();
}

void TwoWayCorrespondences::determineCorrespondences(pcl::Correspondences& correspondences,
                                                     double max_distance) {
  correspondences.clear();
  const auto reach = static_cast<float>(max_distance);
  const auto add = [&](int query, int match) {
    const float squared = ((*input_)[static_cast<std::size_t>(query)].getVector3fMap() -
                           (*target_search_.cloud())[static_cast<std::size_t>(match)].getVector3fMap())
                              .squaredNorm();
    correspondences.emplace_back(query, match, squared);
  };

  // From source to target
  for (const int i : of_source_) {
    const int match =
        nearest_facing(*target_search_.tree(), (*input_)[static_cast<std::size_t>(i)], reach, min_cosine_);
    if (match >= 0) add(i, match);
  }

  // From target to source, in the source's frame
  const Eigen::Matrix4f back = source_from_moved();
  for (const int i : of_target_) {
    const SurfacePoint sample = moved((*target_search_.cloud())[static_cast<std::size_t>(i)], back);
    const int match = nearest_facing(*source_.tree(), sample, reach, min_cosine_);
    if (match >= 0) add(match, i);
  }
}

}  // namespace plumbline::cloud
