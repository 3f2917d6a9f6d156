// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "filters/filter_tools.hpp"
#include "filters/parallel_search.hpp"

namespace plumbline::cloud {
namespace {

// PCL's removal filters ask for one neighbourhood after another and, before PCL 1.14, take no search but
// their own. These ask PCL's tree on all threads and judge as PCL does; tests compare with PCL point for
// point.

class StatisticalOutlierFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.integer("neighbours", neighbours_, {1, 1000}, "", "Nearest neighbours looked at");
    table.number("deviations", deviations_, {0.0, 100.0}, "",
                 "Points whose mean distance exceeds the mean of all by this many standard deviations go");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const CloudConstPtr points = finite_list(input);
    if (points->size() < 3) return finite_list(*points);
    const std::vector<float> distances = mean_distances(points, context);
    const double most = threshold(distances);
    return select(*points, [&](std::size_t i, const Point&) { return !(distances[i] > most); });
  }

 private:
  std::vector<float> mean_distances(const CloudConstPtr& points, const FilterContext& context) const {
    const int neighbours = std::min(neighbours_, static_cast<int>(points->size()) - 1);
    ParallelSearch search(context.executor, false);
    search.setInputCloud(points);
    std::vector<float> distances(points->size());
    search.for_each(points->size(), [&](std::size_t i) {
      thread_local pcl::Indices indices;
      thread_local std::vector<float> squared;
      search.nearestKSearch((*points)[i], neighbours + 1, indices, squared);  // the first is the point itself
      double sum = 0.0;
      for (std::size_t k = 1; k < squared.size(); ++k) sum += static_cast<double>(std::sqrt(squared[k]));
      distances[i] = static_cast<float>(sum / neighbours);
    });
    return distances;
  }

  [[nodiscard]] double threshold(const std::vector<float>& distances) const {
    double sum = 0.0;
    double squares = 0.0;
    for (const float distance : distances) {
      sum += static_cast<double>(distance);
      squares += static_cast<double>(distance * distance);
    }
    const auto count = static_cast<double>(distances.size());
    const double variance = (squares - sum * sum / count) / (count - 1.0);
    return sum / count + deviations_ * std::sqrt(std::max(0.0, variance));
  }

  int neighbours_ = 16;
  double deviations_ = 2.0;
};

class RadiusOutlierFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("radius", radius_m_, {1e-4, 100.0}, "m", "How far a neighbour may be");
    table.integer("min_neighbours", min_neighbours_, {1, 100000}, "", "Points with fewer neighbours go");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const CloudConstPtr points = finite_list(input);
    if (points->size() <= static_cast<std::size_t>(min_neighbours_)) return like(*input);
    ParallelSearch search(context.executor, false);
    search.setInputCloud(points);
    std::vector<std::uint8_t> keep(points->size());
    search.for_each(points->size(), [&](std::size_t i) {
      thread_local pcl::Indices indices;
      thread_local std::vector<float> squared;
      search.nearestKSearch((*points)[i], min_neighbours_ + 1, indices, squared);
      keep[i] = static_cast<double>(squared.back()) <= radius_m_ * radius_m_ ? 1 : 0;
    });
    return select(*points, [&](std::size_t i, const Point&) { return keep[i] != 0; });
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
