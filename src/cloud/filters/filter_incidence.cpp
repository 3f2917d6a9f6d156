// SPDX-License-Identifier: BSD-3-Clause
#include "filters/filter_tools.hpp"
#include "plumbline/cloud/filters/incidence_angle.hpp"

namespace plumbline::cloud {
namespace {

class IncidenceAngleFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("max", max_rad_, {0.0, 1.5708}, "rad",
                 "Largest angle between normal and ray to the viewpoint");
    table.boolean("keep_unknown", keep_unknown_, "Keep points without normal");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    IncidenceAngle<Point> filter;
    filter.setViewpoint(viewpoint_of(*input, context));
    filter.setMaxAngle(max_rad_);
    filter.setKeepUnknown(keep_unknown_);
    return chosen_by(filter, input);
  }

 private:
  double max_rad_ = 1.3;
  bool keep_unknown_ = false;
};

}  // namespace

FilterInfo incidence_angle_filter() {
  return {"incidence_angle", "Removes points that were seen at a grazing angle.",
          "Depth of obliquely seen surfaces is noisy and biased. Both sides of a surface count. Points "
          "without normal are removed as well unless `keep_unknown` is on.",
          "- type: incidence_angle\n  max: 75 deg\n",
          [] { return std::make_unique<IncidenceAngleFilter>(); }};
}

}  // namespace plumbline::cloud
