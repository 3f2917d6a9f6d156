// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pcl/filters/crop_box.h>
#include <pcl/filters/passthrough.h>

#include <functional>
#include <string>
#include <vector>

#include "filters/filter_tools.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"

namespace plumbline::cloud {
namespace {

class CropBoxFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.numbers("min", min_m_, 3, {-1e8, 1e8}, "m", "Corner with the smallest x, y, z");
    table.numbers("max", max_m_, 3, {-1e8, 1e8}, "m", "Corner with the largest x, y, z");
    table.boolean("inside", inside_, "Keep points inside (on) or outside (off)");
  }
  std::string check() const override {
    for (std::size_t i = 0; i < 3; ++i) {
      if (min_m_[i] >= max_m_[i]) return fmt::format("min must be less than max in {}", "xyz"[i]);
    }
    return "";
  }
  [[nodiscard]] std::optional<double> reach_m() const override { return 0.0; }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    pcl::CropBox<Point> crop;
    crop.setMin(corner(min_m_, context.shift));
    crop.setMax(corner(max_m_, context.shift));
    crop.setNegative(!inside_);
    return chosen_by(crop, input);
  }

 private:
  static Eigen::Vector4f corner(const std::vector<double>& v, const Eigen::Vector3d& shift) {
    return Eigen::Vector4d(v[0] - shift.x(), v[1] - shift.y(), v[2] - shift.z(), 1.0).cast<float>();
  }
  std::vector<double> min_m_{-1.0, -1.0, -1.0};
  std::vector<double> max_m_{1.0, 1.0, 1.0};
  bool inside_ = true;
};

class PassThroughFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.choice("field", field_, {"x", "y", "z", "normal_x", "normal_y", "normal_z", "curvature"},
                 "Field of a point to compare");
    table.text(
        "column", column_,
        "Instead of field: a further column of the file by its name, such as confidence, observations, robot "
        "or intensity; empty: field",
        core::EmptyValue::kAllowed);
    table.number("min", min_, {-1e9, 1e9}, "",
                 "Smallest value to keep, in the field's own unit (metres for x, y, z)");
    table.number("max", max_, {-1e9, 1e9}, "", "Largest value to keep");
    table.boolean("inside", inside_, "Keep points within the limits (on) or outside them (off)");
  }
  std::string check() const override {
    return min_ < max_ ? "" : fmt::format("min ({}) must be less than max ({})", min_, max_);
  }
  [[nodiscard]] std::optional<double> reach_m() const override { return 0.0; }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    if (!column_.empty()) return by_column(*input, context);
    pcl::PassThrough<Point> pass;
    pass.setFilterFieldName(field_);

    // Limits are absolute, points relative to the shift
    const std::size_t axis = field_.size() == 1 ? std::string("xyz").find(field_) : std::string::npos;
    const double shift = axis < 3 ? context.shift[static_cast<Eigen::Index>(axis)] : 0.0;
    pass.setFilterLimits(static_cast<float>(min_ - shift), static_cast<float>(max_ - shift));
    pass.setNegative(!inside_);
    return chosen_by(pass, input);
  }

 private:
  [[nodiscard]] core::Result<CloudPtr> by_column(const Cloud& input, const FilterContext& context) const {
    const CloudColumns none;
    const CloudColumns& columns = context.columns != nullptr ? *context.columns : none;
    std::vector<std::string> names;
    std::function<double(std::size_t)> value;

    // Any column of the file, by its name
    const auto offer = [&](const std::string& name, const auto& values) {
      if (values.empty()) return;
      names.push_back(name);
      if (name == column_) value = [&values](std::size_t i) { return static_cast<double>(values[i]); };
    };

    offer("confidence", columns.confidence);
    offer("observations", columns.observations);
    offer("robot", columns.robot);
    for (const auto& other : columns.others) offer(other.name, other.values);

    // The message lists the columns that exist
    if (!value && !input.empty()) {
      return core::usage_error(
          fmt::format("column: the cloud has no '{}' (it has: {})", column_,
                      names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
    }

    // A value that is not a number is never kept
    return select(input, [&](std::size_t i, const Point&) {
      const double v = value(i);
      return std::isfinite(v) && (v >= min_ && v <= max_) == inside_;
    });
  }

  std::string field_ = "z";
  std::string column_;
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
  return {"pass_through", "Keeps points of which one field lies within limits.",
          "PCL's PassThrough. Points whose field is not a number are removed. In a camera's own frame "
          "`field: z` is the depth: the noise of structured light grows with its square, so distant points "
          "do a map more harm than good. `column` selects another column of the file: `column: confidence, "
          "min: 0.5` keeps well-seen points.",
          "- type: pass_through\n  field: normal_y\n  min: -1\n  max: -0.9\n",
          [] { return std::make_unique<PassThroughFilter>(); }};
}

}  // namespace plumbline::cloud
