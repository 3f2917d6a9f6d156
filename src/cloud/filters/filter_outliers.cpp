// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>

#include <algorithm>

#include "filters/filter_tools.hpp"

namespace plumbline::cloud {
namespace {

class StatisticalOutlierFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.integer("neighbours", neighbours_, {1, 1000}, "", "Number of nearest neighbours");
    table.number(
        "deviations", deviations_, {0.0, 100.0}, "",
        "Remove points whose mean distance exceeds the mean of all by this many standard deviations");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& /*context*/) const override {
    const CloudConstPtr points = finite_list(input);
    if (points->size() < 3) return finite_list(*points);

    // A point is not its own neighbour
    pcl::StatisticalOutlierRemoval<Point> removal;
    removal.setMeanK(std::min(neighbours_, static_cast<int>(points->size()) - 1));
    removal.setStddevMulThresh(deviations_);
    return chosen_by(removal, points);
  }

 private:
  int neighbours_ = 16;
  double deviations_ = 2.0;
};

class RadiusOutlierFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("radius", radius_m_, {1e-4, 100.0}, "m", "Radius within which neighbours are counted");
    table.integer("min_neighbours", min_neighbours_, {1, 100000}, "", "Remove points with fewer neighbours");
  }
  [[nodiscard]] std::optional<double> reach_m() const override { return radius_m_; }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& /*context*/) const override {
    const CloudConstPtr points = finite_list(input);

    // No point can have enough neighbours
    if (points->size() <= static_cast<std::size_t>(min_neighbours_)) return like(*input);
    pcl::RadiusOutlierRemoval<Point> removal;
    removal.setRadiusSearch(radius_m_);
    removal.setMinNeighborsInRadius(min_neighbours_);
    return chosen_by(removal, points);
  }

 private:
  double radius_m_ = 0.05;
  int min_neighbours_ = 5;
};

}  // namespace

FilterInfo statistical_outlier_filter() {
  return {"statistical_outlier", "Removes points that lie further from their neighbours than most do.",
          "PCL's StatisticalOutlierRemoval. Points without measurement are left out of the statistics; the "
          "result is a list, not organised.",
          "- type: statistical_outlier\n  neighbours: 16\n  deviations: 2\n",
          [] { return std::make_unique<StatisticalOutlierFilter>(); }};
}

FilterInfo radius_outlier_filter() {
  return {"radius_outlier", "Removes points with few neighbours within a radius.",
          "PCL's RadiusOutlierRemoval. The result is a list, not organised.",
          "- type: radius_outlier\n  radius: 3 cm\n  min_neighbours: 6\n",
          [] { return std::make_unique<RadiusOutlierFilter>(); }};
}

}  // namespace plumbline::cloud
