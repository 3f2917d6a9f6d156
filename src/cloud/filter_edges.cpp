// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>

#include "filter_tools.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::cloud {
namespace {

class FlyingPixelsFilter : public Filter {
 public:
  void declare(core::OptionTable& table) override {
    table.number("sigmas", sigmas_, {1.0, 100.0}, "", "A jump is more than this many sigma_z of the depth");
    table.number("max_angle", max_angle_rad_, {0.5, 1.57}, "rad",
                 "Surfaces up to this angle from face on may be that steep; beyond it is a jump");
    table.integer("margin", margin_, {0, 8}, "", "Cells removed beside the two at a jump");
    table.integer("min_neighbours", min_neighbours_, {0, 8}, "",
                  "Points with fewer of their 8 neighbours on the same surface go");
  }
  core::Result<CloudPtr> apply(const CloudConstPtr& input, const FilterContext& context) const override {
    if (input->empty()) return like(*input);
    if (!organised(*input)) {
      return core::usage_error("needs an organised cloud; put it before filters that resample");
    }
    Marks marks = mark(*input, viewpoint_of(*input, context));
    for (int i = 0; i < margin_; ++i) marks.jump = widened(marks.jump, input->width);
    return select(*input, [&](std::size_t i, const Point&) {
      return marks.jump[i] == 0 && marks.neighbours[i] >= min_neighbours_;
    });
  }

 private:
  struct Marks {
    std::vector<std::uint8_t> jump;        ///< 1: at a depth jump
    std::vector<std::uint8_t> neighbours;  ///< of 8, those on the same surface
  };
  struct View {
    Eigen::Vector3f ray{0, 0, 1};  ///< unit, from the viewpoint
    float noise = 0.0F;            ///< metres along the ray that are no jump
  };

  /// Looks at every pair of neighbours once. A pair is a jump when it is longer along the ray than the noise
  /// and the steepest allowed surface explain.
  Marks mark(const Cloud& cloud, const Eigen::Vector3f& viewpoint) const {
    const std::size_t width = cloud.width;
    Marks marks{std::vector<std::uint8_t>(cloud.size()), std::vector<std::uint8_t>(cloud.size())};
    const auto tangent = static_cast<float>(std::tan(max_angle_rad_));
    const auto pair = [&](std::size_t a, std::size_t b, const View& view) {
      if (!finite(cloud[b])) return;
      const Eigen::Vector3f difference = cloud[b].getVector3fMap() - cloud[a].getVector3fMap();
      const float along = difference.dot(view.ray);
      const float across = std::sqrt(std::max(0.0F, difference.squaredNorm() - along * along));
      if (std::abs(along) > view.noise + tangent * across) {
        marks.jump[a] = marks.jump[b] = 1;
      } else {
        ++marks.neighbours[a];
        ++marks.neighbours[b];
      }
    };
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (!finite(cloud[i])) continue;
      const View view = view_of(cloud[i], viewpoint);
      const std::size_t column = i % width;
      const bool below = i + width < cloud.size();
      if (column + 1 < width) pair(i, i + 1, view);
      if (below) pair(i, i + width, view);
      if (below && column + 1 < width) pair(i, i + width + 1, view);
      if (below && column > 0) pair(i, i + width - 1, view);
    }
    return marks;
  }

  View view_of(const Point& p, const Eigen::Vector3f& viewpoint) const {
    const Eigen::Vector3f offset = p.getVector3fMap() - viewpoint;
    const float range = offset.norm();
    View view;
    if (range > 0.0F) view.ray = offset / range;
    view.noise = static_cast<float>(sigmas_ * sensor::depth_sigma(static_cast<double>(range)));
    return view;
  }

  static std::vector<std::uint8_t> widened(const std::vector<std::uint8_t>& marks, std::size_t width) {
    std::vector<std::uint8_t> wider = marks;
    for (std::size_t i = 0; i < marks.size(); ++i) {
      if (marks[i] == 0) continue;
      if (i % width > 0) wider[i - 1] = 1;
      if (i % width + 1 < width) wider[i + 1] = 1;
      if (i >= width) wider[i - width] = 1;
      if (i + width < marks.size()) wider[i + width] = 1;
    }
    return wider;
  }

  double sigmas_ = 4.0;
  double max_angle_rad_ = 1.36;
  int margin_ = 0;
  int min_neighbours_ = 3;
};

}  // namespace

FilterInfo flying_pixels_filter() {
  return {"flying_pixels", "Removes points at depth jumps of an organised cloud.",
          "At the border of an object a pixel sees foreground and background at once and its depth hangs in "
          "the air "
          "between them. Two neighbouring points whose distance along the ray is more than `sigmas` times "
          "the depth "
          "noise plus what a surface at `max_angle` would explain are held to be on different surfaces, and "
          "both go. "
          "Specks with few neighbours go with them.",
          "- type: flying_pixels\n  sigmas: 4\n  max_angle: 78 deg\n",
          [] { return std::make_unique<FlyingPixelsFilter>(); }};
}

}  // namespace plumbline::cloud
