// SPDX-License-Identifier: BSD-3-Clause
// A filter of one's own: takes the colour out of a cloud, all of it or a share.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <memory>

#include "plumbline/cloud/filters/filter_plugin.hpp"

namespace {

using namespace plumbline;

class GreyFilter : public cloud::Filter {
 public:
  /// Key, variable, allowed range, unit, help: parser, checks and reference are made from these.
  void declare(core::OptionTable& table) override {
    table.number("share", share_, {0.0, 1.0}, "ratio", "Share of the colour to remove");
  }

  /// The input is never changed; the result is a new cloud.
  core::Result<cloud::CloudPtr> apply(const cloud::CloudConstPtr& input,
                                      const cloud::FilterContext& /*context*/) const override {
    auto output = std::make_shared<cloud::Cloud>(*input);
    for (cloud::Point& p : output->points) {
      const double grey = 0.299 * p.r + 0.587 * p.g + 0.114 * p.b;  // luma of ITU-R BT.601
      for (std::uint8_t* channel : {&p.r, &p.g, &p.b}) {
        *channel = static_cast<std::uint8_t>(std::lround(*channel + share_ * (grey - *channel)));
      }
    }
    return output;
  }

 private:
  double share_ = 1.0;
};

}  // namespace

PLUMBLINE_FILTER_PLUGIN(registry) {
  registry.add({"grey", "Takes the colour out of a cloud.", "Weighs red, green and blue as the eye does.",
                "- type: grey\n  share: 80 %\n", [] { return std::make_unique<GreyFilter>(); }});
}
