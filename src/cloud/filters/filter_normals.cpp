// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/features/normal_3d_omp.h>
#include <pcl/search/kdtree.h>

#include "filters/filter_tools.hpp"
#include "plumbline/core/executor.hpp"

namespace plumbline::cloud {
namespace {

class NormalsFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.integer("neighbours", neighbours_, {0, 1000}, "",
                  "Number of nearest neighbours for the plane; 0: all within radius");
    table.number("radius", radius_m_, {0.0, 10.0}, "m", "Radius of the neighbourhood if neighbours is 0");
  }
  std::string check() const override {
    if (neighbours_ == 0 && radius_m_ <= 0.0) return "one of neighbours and radius must be more than 0";
    return neighbours_ == 1 || neighbours_ == 2
               ? "neighbours must be 0 or at least 3: a plane has three points"
               : "";
  }
  [[nodiscard]] std::optional<double> reach_m() const override {
    return neighbours_ == 0 ? std::optional(radius_m_) : std::nullopt;
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const CloudPtr points = finite_list(*input);
    if (points->empty()) return points;
    const Eigen::Vector3f viewpoint = viewpoint_of(*input, context);
    const int threads = context.executor != nullptr ? context.executor->threads() : 1;

    // The nearest neighbours, or all within the radius
    pcl::NormalEstimationOMP<Point, pcl::Normal> estimation(static_cast<unsigned int>(threads));
    estimation.setSearchMethod(std::make_shared<pcl::search::KdTree<Point>>());
    estimation.setKSearch(neighbours_);
    estimation.setRadiusSearch(neighbours_ > 0 ? 0.0 : radius_m_);
    estimation.setViewPoint(viewpoint.x(), viewpoint.y(), viewpoint.z());
    estimation.setInputCloud(points);
    pcl::PointCloud<pcl::Normal> normals;
    estimation.compute(normals);

    // Not a number for points with too few neighbours
    for (std::size_t i = 0; i < points->size(); ++i) {
      (*points)[i].getNormalVector3fMap() = normals[i].getNormalVector3fMap();
      (*points)[i].curvature = normals[i].curvature;
    }
    return points;
  }

 private:
  int neighbours_ = 16;
  double radius_m_ = 0.03;
};

}  // namespace

FilterInfo normals_filter() {
  return {"normals", "Estimates normals and curvature from the neighbours, turned to the viewpoint.",
          "PCL's NormalEstimation. The viewpoint is that of the run (the camera of a keyframe) or the one in "
          "the file. Points with fewer than three neighbours get NaN normals. The result is a list, not "
          "organised.",
          "- type: normals\n  neighbours: 0\n  radius: 3 cm\n",
          [] { return std::make_unique<NormalsFilter>(); }};
}

}  // namespace plumbline::cloud
