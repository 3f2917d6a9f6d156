// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Correspondences for PCL's registration loop, both ways at once: samples of the source on the target, and
// samples of the target on the source. Surfaces that overlap in part pull each other alike, whichever is
// called source.
#include <pcl/registration/correspondence_estimation.h>

#include <memory>

#include "plumbline/cloud/registration/surface_cloud.hpp"

namespace plumbline::cloud {

/// For pcl::IterativeClosestPoint::setCorrespondenceEstimation. Points correspond to the nearest one that
/// faces the same way. The loop moves the source: the way back into the unmoved one, whose tree is built
/// once, is found from the moved points.
class TwoWayCorrespondences
    : public pcl::registration::CorrespondenceEstimationBase<SurfacePoint, SurfacePoint, double> {
 public:
  using Base = pcl::registration::CorrespondenceEstimationBase<SurfacePoint, SurfacePoint, double>;

  /// Both with trees, as the loop's source (unmoved) and target.
  TwoWayCorrespondences(const SurfaceSearch& source, const SurfaceSearch& target, float min_cosine)
      : source_(source), target_search_(target), min_cosine_(min_cosine) {}

  /// Points to match with the other side: indices into source and target.
  void setSamples(pcl::Indices of_source, pcl::Indices of_target) {
    of_source_ = std::move(of_source);
    of_target_ = std::move(of_target);
  }

  void determineCorrespondences(pcl::Correspondences& correspondences, double max_distance) override;
  /// The same: correspondences are two-way already.
  void determineReciprocalCorrespondences(pcl::Correspondences& correspondences,
                                          double max_distance) override {
    determineCorrespondences(correspondences, max_distance);
  }
  [[nodiscard]] Base::Ptr clone() const override { return std::make_shared<TwoWayCorrespondences>(*this); }

 private:
  [[nodiscard]] Eigen::Matrix4f source_from_moved() const;

  SurfaceSearch source_;
  SurfaceSearch target_search_;
  float min_cosine_;
  pcl::Indices of_source_;
  pcl::Indices of_target_;
};

}  // namespace plumbline::cloud
