// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <pcl/filters/crop_box.h>
#include <pcl/filters/passthrough.h>

#include "filter_tools.hpp"

namespace plumbline::cloud {
namespace {

class CropBoxFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.numbers("min", min_m_, 3, {-1e6, 1e6}, "m", "Corner with the smallest x, y, z");
    table.numbers("max", max_m_, 3, {-1e6, 1e6}, "m", "Corner with the largest x, y, z");
    table.boolean("inside", inside_, "Keep what is inside (on) or outside (off)");
  }
  std::string check() const override {
    for (std::size_t i = 0; i < 3; ++i) {
      if (min_m_[i] >= max_m_[i]) return fmt::format("min must be less than max in {}", "xyz"[i]);
    }
    return "";
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext&) const override {
    pcl::CropBox<Point> crop(true);  // true: PCL prints a line otherwise
    crop.setMin(corner(min_m_));
    crop.setMax(corner(max_m_));
    crop.setNegative(!inside_);
    crop.setKeepOrganized(organised(*input));
    crop.setInputCloud(input);
    auto output = std::make_shared<Cloud>();
    crop.filter(*output);
    return select(*output, [](std::size_t, const Point&) { return true; });
  }

 private:
  static Eigen::Vector4f corner(const std::vector<double>& v) {
    return Eigen::Vector4d(v[0], v[1], v[2], 1.0).cast<float>();
  }
  std::vector<double> min_m_{-1.0, -1.0, -1.0};
  std::vector<double> max_m_{1.0, 1.0, 1.0};
  bool inside_ = true;
};

class PassThroughFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.choice("field", field_, {"x", "y", "z", "normal_x", "normal_y", "normal_z", "curvature"},
                 "The number of a point that is looked at");
    table.number("min", min_, {-1e9, 1e9}, "",
                 "Smallest value that passes, in the field's own unit (metres for x, y, z)");
    table.number("max", max_, {-1e9, 1e9}, "", "Largest value that passes");
    table.boolean("inside", inside_, "Keep what is within the limits (on) or beyond them (off)");
  }
  std::string check() const override {
    return min_ < max_ ? "" : fmt::format("min ({}) must be less than max ({})", min_, max_);
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext&) const override {
    pcl::PassThrough<Point> pass(true);
    pass.setFilterFieldName(field_);
    pass.setFilterLimits(static_cast<float>(min_), static_cast<float>(max_));
    pass.setNegative(!inside_);
    pass.setKeepOrganized(organised(*input));
    pass.setInputCloud(input);
    auto output = std::make_shared<Cloud>();
    pass.filter(*output);
    return select(*output, [](std::size_t, const Point&) { return true; });
  }

 private:
  std::string field_ = "z";
  double min_ = -1e9;
  double max_ = 1e9;
  bool inside_ = true;
};

}  // namespace

FilterInfo crop_box_filter() {
  return {"crop_box", "Keeps points inside (or outside) a box.",
          "PCL's CropBox, axes along the cloud's frame.",
          "- type: crop_box\n  min: [-2 m, -1 m, 0 m]\n  max: [2 m, 1 m, 3 m]\n",
          [] { return std::make_unique<CropBoxFilter>(); }};
}

FilterInfo pass_through_filter() {
  return {"pass_through", "Keeps points one of whose numbers lies within limits.",
          "PCL's PassThrough. Points whose field is not a number go.",
          "- type: pass_through\n  field: normal_y\n  min: -1\n  max: -0.9\n",
          [] { return std::make_unique<PassThroughFilter>(); }};
}

}  // namespace plumbline::cloud
