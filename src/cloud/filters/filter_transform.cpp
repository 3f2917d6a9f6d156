// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/common/transforms.h>

#include "filters/filter_tools.hpp"

namespace plumbline::cloud {
namespace {

class TransformFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.numbers("translation", translation_m_, 3, {-1e8, 1e8}, "m", "x, y, z, added after the rotation");
    table.numbers("rotation", rotation_rad_, 3, {-6.2832, 6.2832}, "rad",
                  "Roll, pitch, yaw: about x first, then y, then z of the fixed frame");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    if (input->empty()) return like(*input);
    Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
    transform.linear() = (Eigen::AngleAxisd(rotation_rad_[2], Eigen::Vector3d::UnitZ()) *
                          Eigen::AngleAxisd(rotation_rad_[1], Eigen::Vector3d::UnitY()) *
                          Eigen::AngleAxisd(rotation_rad_[0], Eigen::Vector3d::UnitX()))
                             .toRotationMatrix();
    transform.translation() << translation_m_[0], translation_m_[1], translation_m_[2];
    transform.translation() += transform.linear() * context.shift - context.shift;
    auto output = std::make_shared<Cloud>();
    pcl::transformPointCloudWithNormals(*input, *output, transform.matrix().cast<float>().eval());
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
          "the run does not move with it.",
          "- type: transform\n  rotation: [-90 deg, 0 deg, 0 deg]\n  translation: [0 m, 0 m, 1.2 m]\n",
          [] { return std::make_unique<TransformFilter>(); }};
}

}  // namespace plumbline::cloud
