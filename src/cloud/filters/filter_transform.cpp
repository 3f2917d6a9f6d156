// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/common/transforms.h>

#include "filters/filter_tools.hpp"
#include "plumbline/cloud/io/frame.hpp"

namespace plumbline::cloud {
namespace {

/// The frame after the motion: only its up axis is known, and only if that is z or -y.
CloudFrame moved_frame(const CloudFrame& frame, const Eigen::Matrix3d& rotation) {
  constexpr double kSame = 1e-6;
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d minus_y = -Eigen::Vector3d::UnitY();
  if (frame.up() == Up::kUnknown) return {};

  const Eigen::Vector3d up = rotation * (frame.up() == Up::kZ ? z : minus_y);
  if ((up - z).norm() < kSame) return frame_with(Up::kZ);
  return frame_with((up - minus_y).norm() < kSame ? Up::kMinusY : Up::kUnknown);
}

class TransformFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.numbers("translation", translation_m_, 3, {-1e8, 1e8}, "m", "x, y, z, added after the rotation");
    table.numbers("rotation", rotation_rad_, 3, {-6.2832, 6.2832}, "rad",
                  "Roll, pitch, yaw: about x first, then y, then z of the fixed frame");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    // About the fixed x axis first, then y, then z
    Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
    transform.linear() = (Eigen::AngleAxisd(rotation_rad_[2], Eigen::Vector3d::UnitZ()) *
                          Eigen::AngleAxisd(rotation_rad_[1], Eigen::Vector3d::UnitY()) *
                          Eigen::AngleAxisd(rotation_rad_[0], Eigen::Vector3d::UnitX()))
                             .toRotationMatrix();
    transform.translation() << translation_m_[0], translation_m_[1], translation_m_[2];

    // Up in the file's header turns with the cloud
    if (context.frame != nullptr) *context.frame = moved_frame(*context.frame, transform.linear());
    if (input->empty()) return like(*input);

    // Points are relative to the shift, which stays
    transform.translation() += transform.linear() * context.shift - context.shift;
    auto output = std::make_shared<Cloud>();
    pcl::transformPointCloudWithNormals(*input, *output, transform.matrix().cast<float>().eval());

    // The sensor pose moves with the points
    const Eigen::Vector3d origin = input->sensor_origin_.head<3>().cast<double>();
    output->sensor_origin_.head<3>() = (transform * origin).cast<float>();
    const Eigen::Quaterniond turned(transform.linear() *
                                    input->sensor_orientation_.cast<double>().toRotationMatrix());
    output->sensor_orientation_ = turned.cast<float>();
    return output;
  }

 private:
  std::vector<double> translation_m_{0.0, 0.0, 0.0};
  std::vector<double> rotation_rad_{0.0, 0.0, 0.0};
};

}  // namespace

FilterInfo transform_filter() {
  return {"transform", "Moves the cloud, its normals and its viewpoint.",
          "PCL's transformPointCloudWithNormals; an organised cloud stays organised. A viewpoint given by "
          "the run does not move with it. What a file's header says is up is turned with "
          "it, and lost if neither z nor -y is up then.",
          "- type: transform\n  rotation: [-90 deg, 0 deg, 0 deg]\n  translation: [0 m, 0 m, 1.2 m]\n",
          [] { return std::make_unique<TransformFilter>(); }};
}

}  // namespace plumbline::cloud
