// SPDX-License-Identifier: BSD-3-Clause
#include "filters/filter_tools.hpp"
#include "filters/pcl_functions.hpp"
#include "plumbline/cloud/columns.hpp"

namespace plumbline::cloud {
namespace {

class MlsFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("radius", radius_m_, {1e-4, 10.0}, "m",
                 "Radius around a point within which the surface is fitted");
    table.integer("order", order_, {0, 5}, "",
                  "Order of the polynomial; 0 and 1 fit a plane, which is faster and rounds edges more");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const CloudConstPtr points = finite_list(input);
    if (points->size() < 3) return like(*input);
    const auto& pcl = pcl_functions();
    if (!pcl) return tl::unexpected<core::Error>(pcl.error());

    pcl::Indices indices;
    const CloudPtr output = (*pcl)->moving_least_squares(points, radius_m_, order_, indices);

    // Normals stay on their side of the surface
    const Eigen::Vector3f viewpoint = viewpoint_of(*input, context);
    std::vector<std::size_t> sources;  // of the kept points
    for (std::size_t i = 0; i < output->size(); ++i) {
      const auto source = static_cast<std::size_t>(indices[i]);
      turn((*output)[i], (*points)[source], viewpoint);
      if (finite((*output)[i])) sources.push_back(source);
    }

    // Columns of the remaining points
    if (context.columns != nullptr && context.made_columns != nullptr) {
      *context.made_columns = pick_columns(carry_columns(*input, *context.columns, *points), sources);
    }

    // Points without a fitted surface are removed
    output->header = input->header;
    output->sensor_origin_ = input->sensor_origin_;
    output->sensor_orientation_ = input->sensor_orientation_;
    return select(*output, [](std::size_t, const Point&) { return true; });
  }

 private:
  /// A fitted normal has either sign: it keeps to the side of the normal that was there, else to the
  /// viewpoint.
  static void turn(Point& p, const Point& before, const Eigen::Vector3f& viewpoint) {
    const Eigen::Vector3f side =
        has_normal(before) ? Eigen::Vector3f(before.getNormalVector3fMap()) : viewpoint - p.getVector3fMap();
    if (p.getNormalVector3fMap().dot(side) < 0.0F) p.getNormalVector3fMap() *= -1.0F;
  }

  double radius_m_ = 0.03;
  int order_ = 2;
};

}  // namespace

FilterInfo mls_filter() {
  return {
      "mls", "Smooths the surface: moves every point onto a polynomial fitted to its neighbours.",
      "PCL's MovingLeastSquares, neighbours weighed by a Gaussian as wide as `radius`. Points that have "
      "fewer than three points within the radius are removed. Normals and curvature are those of the fitted "
      "surface; a normal stays on its side of the surface, or points to the viewpoint if there was none. The "
      "result is a list, not organised.",
      "- type: mls\n  radius: 3 cm\n  order: 2\n", [] { return std::make_unique<MlsFilter>(); }};
}

}  // namespace plumbline::cloud
