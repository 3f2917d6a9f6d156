// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "filter_tools.hpp"
#include "parallel_search.hpp"

namespace plumbline::cloud {
namespace {

class NormalConsistencyFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.integer("neighbours", neighbours_, {1, 1000}, "", "Nearest neighbours looked at");
    table.number("max_angle", max_angle_rad_, {0.0, 3.1416}, "rad", "Between normals that agree");
    table.number("min_share", min_share_, {0.0, 1.0}, "ratio",
                 "Of the neighbours with a normal, so many must agree; more than 1/2 eats edges");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    auto points = std::make_shared<Cloud>();
    for (const Point& p : input->points) {
      if (finite(p) && has_normal(p)) points->push_back(p);
    }
    std::vector<std::uint8_t> keep(points->size(), 0);
    if (points->size() > 1) {
      ParallelSearch search(context.executor, true);
      search.setInputCloud(points);
      search.for_each(points->size(),
                      [&](std::size_t i) { keep[i] = consistent(search, *points, i) ? 1 : 0; });
    }
    std::size_t next = 0;  // select asks in the order of the input
    return select(*input, [&](std::size_t, const Point& p) { return has_normal(p) && keep[next++] != 0; });
  }

 private:
  bool consistent(const ParallelSearch& search, const Cloud& points, std::size_t i) const {
    pcl::Indices indices;
    std::vector<float> squared;
    // One more: the point itself is among them.
    const int most =
        static_cast<int>(std::min<std::size_t>(points.size(), 1U + static_cast<unsigned>(neighbours_)));
    search.nearestKSearch(points[i], most, indices, squared);
    const auto least = static_cast<float>(std::cos(max_angle_rad_));
    int agree = 0;
    int others = 0;
    for (const auto index : indices) {
      const auto j = static_cast<std::size_t>(index);
      if (j == i) continue;
      ++others;
      agree += points[i].getNormalVector3fMap().dot(points[j].getNormalVector3fMap()) >= least ? 1 : 0;
    }
    return others > 0 && agree >= min_share_ * others;
  }

  int neighbours_ = 16;
  double max_angle_rad_ = 0.5236;
  double min_share_ = 0.3;
};

}  // namespace

FilterInfo normal_consistency_filter() {
  return {
      "normal_consistency", "Removes points whose normal disagrees with those around it.",
      "Where depth is noisy, at borders and on shiny things, normals point anywhere; a point stays when "
      "enough of its nearest neighbours have a normal within `max_angle` of its own. Points without normal "
      "go: put the filter normals before it.",
      "- type: normal_consistency\n  neighbours: 16\n  max_angle: 30 deg\n  min_share: 30 %\n",
      [] { return std::make_unique<NormalConsistencyFilter>(); }};
}

}  // namespace plumbline::cloud
