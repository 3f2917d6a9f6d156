// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/filters/conditional_removal.h>
#include <pcl/point_types_conversion.h>

#include "filters/filter_tools.hpp"

namespace plumbline::cloud {
namespace {

/// True for each point that meets both comparisons. ConditionalRemoval itself cannot invert its choice, and
/// does not remove the rejected points of an organised cloud.
template <typename Compare>
std::vector<bool> within(const Cloud& input, const std::string& name, double min, double max) {
  pcl::ConditionAnd<Point> both;
  both.addComparison(std::make_shared<Compare>(name, pcl::ComparisonOps::GE, min));
  both.addComparison(std::make_shared<Compare>(name, pcl::ComparisonOps::LE, max));
  std::vector<bool> result;
  result.reserve(input.size());
  for (const Point& p : input.points) result.push_back(both.evaluate(p));
  return result;
}

class ColorFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.choice("channel", channel_, {"red", "green", "blue", "hue", "saturation", "value"},
                 "Channel of the colour");
    table.number(
        "min", min_, {0.0, 360.0}, "",
        "Smallest value to keep: red, green, blue 0 to 255, hue 0 to 360, saturation and value 0 to 1");
    table.number("max", max_, {0.0, 360.0}, "", "Largest value to keep");
    table.boolean("inside", inside_, "Keep points within the limits (on) or outside them (off)");
  }
  std::string check() const override {
    if (!(min_ < max_)) return fmt::format("min ({}) must be less than max ({})", min_, max_);
    const double most = is_byte() ? 255.0 : channel_ == "hue" ? 360.0 : 1.0;
    return min_ <= most ? "" : fmt::format("min ({}) is more than {} can be ({})", min_, channel_, most);
  }
  [[nodiscard]] std::optional<double> reach_m() const override { return 0.0; }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext&) const override {
    if (is_byte()) {
      const std::vector<bool> met =
          within<pcl::PackedRGBComparison<Point>>(*input, channel_.substr(0, 1), min_, max_);
      return select(*input, [&](std::size_t i, const Point&) { return met[i] == inside_; });
    }
    // PCL's PackedHSIComparison keeps the last colour in static variables; its conversion to HSV does not.
    const auto min = static_cast<float>(min_);
    const auto max = static_cast<float>(max_);
    return select(*input, [&](std::size_t, const Point& p) {
      pcl::PointXYZRGB rgb(p.r, p.g, p.b);
      pcl::PointXYZHSV hsv;
      pcl::PointXYZRGBtoXYZHSV(rgb, hsv);
      const float value = channel_ == "hue" ? hsv.h : channel_ == "saturation" ? hsv.s : hsv.v;
      return (value >= min && value <= max) == inside_;
    });
  }

 private:
  [[nodiscard]] bool is_byte() const {
    return channel_ == "red" || channel_ == "green" || channel_ == "blue";
  }
  std::string channel_ = "value";
  double min_ = 0.0;
  double max_ = 360.0;
  bool inside_ = true;
};

class CurvatureFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("min", min_, {0.0, 1.0}, "", "Remove points with a smaller curvature");
    table.number("max", max_, {0.0, 1.0}, "", "Remove points with a larger curvature");
  }
  std::string check() const override {
    return min_ < max_ ? "" : fmt::format("min ({}) must be less than max ({})", min_, max_);
  }
  [[nodiscard]] std::optional<double> reach_m() const override { return 0.0; }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext&) const override {
    // PCL's comparison treats NaN as equal to anything.
    const CloudConstPtr known =
        select(*input, [](std::size_t, const Point& p) { return std::isfinite(p.curvature); });
    const std::vector<bool> met = within<pcl::FieldComparison<Point>>(*known, "curvature", min_, max_);
    return select(*known, [&](std::size_t i, const Point&) { return met[i]; });
  }

 private:
  double min_ = 0.0;
  double max_ = 0.05;
};

}  // namespace

FilterInfo color_filter() {
  return {
      "color", "Keeps points whose colour lies within limits.",
      "PCL's condition on packed colours for red, green and blue, PCL's conversion for hue, saturation and "
      "value. Red lies at both ends of the hue: keep it with `channel: hue, min: 20, max: 340, inside: "
      "off`. Grey and black points have hue 0. Two channels are two filters.",
      "- type: color\n  channel: hue\n  min: 80\n  max: 160\n",
      [] { return std::make_unique<ColorFilter>(); }};
}

FilterInfo curvature_filter() {
  return {
      "curvature", "Keeps points where the curvature of the surface lies within limits.",
      "PCL's condition on a field. The curvature is that of the filters normals and mls: the share of the "
      "smallest eigenvalue of a neighbourhood's covariance, 0 on a plane, 1/3 if points lie in all "
      "directions alike. It is 0 if neither filter was run; points for which it could not be computed are "
      "removed.",
      "- type: curvature\n  max: 0.02\n", [] { return std::make_unique<CurvatureFilter>(); }};
}

}  // namespace plumbline::cloud
