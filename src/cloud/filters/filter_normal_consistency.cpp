// SPDX-License-Identifier: BSD-3-Clause
#include "filters/filter_tools.hpp"
#include "plumbline/cloud/filters/normal_consistency.hpp"

namespace plumbline::cloud {
namespace {

class NormalConsistencyFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.integer("neighbours", neighbours_, {1, 1000}, "", "Number of nearest neighbours");
    table.number("max_angle", max_angle_rad_, {0.0, 3.1416}, "rad",
                 "Largest angle between normals that agree");
    table.number("min_share", min_share_, {0.0, 1.0}, "ratio",
                 "Smallest share of neighbours with normals that must agree; more than 1/2 removes edges");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    NormalConsistency<Point> filter;
    filter.setNeighbours(neighbours_);
    filter.setMaxAngle(max_angle_rad_);
    filter.setMinShare(min_share_);
    filter.setExecutor(context.executor);
    return chosen_by(filter, input);
  }

 private:
  int neighbours_ = 16;
  double max_angle_rad_ = 0.5236;
  double min_share_ = 0.3;
};

}  // namespace

FilterInfo normal_consistency_filter() {
  return {"normal_consistency", "Removes points whose normal disagrees with those around it.",
          "Where depth is noisy, at borders and on shiny surfaces, normals point anywhere; a point is kept "
          "if enough of its nearest neighbours have a normal within `max_angle` of its own. Points without "
          "normal are removed: put the filter normals before it.",
          "- type: normal_consistency\n  neighbours: 16\n  max_angle: 30 deg\n  min_share: 30 %\n",
          [] { return std::make_unique<NormalConsistencyFilter>(); }};
}

}  // namespace plumbline::cloud
