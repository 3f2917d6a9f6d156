// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "filter_tools.hpp"

namespace plumbline::cloud {
namespace {

enum class Along { kDepth, kDistance };

class RangeFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("min", min_m_, {0.0, 1000.0}, "m", "Nearer points go");
    table.number("max", max_m_, {0.0, 1000.0}, "m", "Points further away go");
    table.choice<Along>("along", along_, {{"depth", Along::kDepth}, {"distance", Along::kDistance}},
                        "What is measured: z in the cloud's frame, or the distance to the viewpoint");
  }
  std::string check() const override {
    return min_m_ < max_m_ ? "" : fmt::format("min ({} m) must be less than max ({} m)", min_m_, max_m_);
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    const Eigen::Vector3f viewpoint = viewpoint_of(*input, context);
    const auto min = static_cast<float>(min_m_);
    const auto max = static_cast<float>(max_m_);
    return select(*input, [&](std::size_t, const Point& p) {
      const float range = along_ == Along::kDepth ? p.z : (p.getVector3fMap() - viewpoint).norm();
      return range >= min && range <= max;
    });
  }

 private:
  double min_m_ = 0.0;
  double max_m_ = 4.0;
  Along along_ = Along::kDepth;
};

}  // namespace

FilterInfo range_filter() {
  return {"range", "Keeps points within a range of depth or distance.",
          "The depth noise of structured light grows with the square of the depth, so what is far away does "
          "a map "
          "more harm than good. For clouds in the camera frame; elsewhere use `along: distance`.",
          "- type: range\n  min: 0.4 m\n  max: 3.5 m\n", [] { return std::make_unique<RangeFilter>(); }};
}

}  // namespace plumbline::cloud
