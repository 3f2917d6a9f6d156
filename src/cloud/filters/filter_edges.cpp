// SPDX-License-Identifier: BSD-3-Clause
#include "filters/filter_tools.hpp"
#include "plumbline/cloud/filters/flying_pixels.hpp"

namespace plumbline::cloud {
namespace {

class FlyingPixelsFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("sigmas", sigmas_, {1.0, 100.0}, "",
                 "Smallest depth difference at a jump, in sigma_z of the depth");
    table.number("max_angle", max_angle_rad_, {0.5, 1.57}, "rad",
                 "Largest slope of a surface, from facing the camera; what is steeper is a jump");
    table.integer("margin", margin_, {0, 8}, "", "Number of further cells to remove on both sides of a jump");
    table.integer("min_neighbours", min_neighbours_, {0, 8}, "",
                  "Remove points with fewer of their 8 neighbours on the same surface");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    if (input->empty()) return like(*input);

    // Jumps are between neighbouring pixels
    if (!organised(*input)) {
      return core::usage_error("needs an organised cloud; put it before filters that resample");
    }
    FlyingPixels<Point> filter;
    filter.setViewpoint(viewpoint_of(*input, context));
    filter.setSigmas(sigmas_);
    filter.setMaxAngle(max_angle_rad_);
    filter.setMargin(margin_);
    filter.setMinNeighbours(min_neighbours_);
    return chosen_by(filter, input);
  }

 private:
  double sigmas_ = 4.0;
  double max_angle_rad_ = 1.36;
  int margin_ = 0;
  int min_neighbours_ = 3;
};

}  // namespace

FilterInfo flying_pixels_filter() {
  return {"flying_pixels", "Removes points at depth jumps of an organised cloud.",
          "At the border of an object a pixel sees foreground and background at once and its depth hangs in "
          "the air between them. Two neighbouring points whose distance along the ray is more than `sigmas` "
          "times the depth noise plus the difference on a surface at `max_angle` are taken to be on "
          "different surfaces, and both are removed, with specks that have few neighbours.",
          "- type: flying_pixels\n  sigmas: 4\n  max_angle: 78 deg\n",
          [] { return std::make_unique<FlyingPixelsFilter>(); }};
}

}  // namespace plumbline::cloud
