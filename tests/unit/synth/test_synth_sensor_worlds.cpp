// SPDX-License-Identifier: BSD-3-Clause
// What depth cameras measure in worlds by number is what their formulas say: noise, bias and holes.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "plumbline/core/executor.hpp"
#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/source.hpp"
#include "render/depth_sensor.hpp"

namespace plumbline::synth {
namespace {

/// A sensor's published formulas, written down once more.
struct Formula {
  Sensor sensor;
  /// Metres; of depth, angle of incidence, focal length.
  std::function<double(double, double, double)> sigma;
  /// Light above the least, in standard deviations of that; of the cosine of incidence, and depth.
  std::function<double(const Material&, double, double)> spare;
  double shadow;  ///< px m; 0: casts none
};

double grazing(double a) { return a * a / ((M_PI_2 - a) * (M_PI_2 - a)); }

std::function<double(const Material&, double, double)> spare_light(double least, double range) {
  return [=](const Material& m, double cosine, double z) {
    return 10.0 * (static_cast<double>(m.infrared) * cosine / least * std::pow(range / z, 2) - 1.0);
  };
}

std::vector<Formula> formulas() {
  const auto structured = [](double z, double) { return 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4); };
  return {{Sensor::kKinect, [=](double z, double a, double) { return structured(z, a); },
           [](const Material& m, double cosine, double z) {
             const double s = static_cast<double>(m.gloss);
             if (s > 0.25 && cosine > 0.997) return -9.0;
             const double light = static_cast<double>(m.infrared) * cosine * (1.0 - s * (1.0 - cosine)) *
                                  3.0 / (0.6 + 0.4 * z * z);
             return (light - 0.075) / std::hypot(0.018, 0.012);
           },
           43.5},
          {Sensor::kTof,
           [](double z, double a, double) {
             return 1e-3 * (1.5 - 0.5 * z + 0.3 * z * z + 0.1 * std::pow(z, 1.5) * grazing(a));
           },
           spare_light(0.15, 5.46), 0.0},
          {Sensor::kStructured,
           [=](double z, double a, double) { return structured(z, a) + 1e-4 / std::sqrt(z) * grazing(a); },
           spare_light(0.10, 5.0), 43.5},
          {Sensor::kStereo, [](double z, double, double f) { return 0.08 * z * z / (f * 0.05); },
           spare_light(0.05, 10.0), 23.1},
          {Sensor::kPhone, [](double, double, double) { return 0.01; }, spare_light(0.10, 5.0), 0.0}};
}

/// Pixels far from borders and shadows: 1.
cv::Mat1b undisturbed(const cv::Mat1i& faces, const cv::Mat1f& depth, double shadow) {
  cv::Mat1f numbers, low, high;
  faces.convertTo(numbers, CV_32F);
  cv::erode(numbers, low, cv::Mat::ones(11, 11, CV_8U));
  cv::dilate(numbers, high, cv::Mat::ones(11, 11, CV_8U));
  cv::Mat1b dark(faces.size(), uchar{0});
  for (int y = 0; y < depth.rows && shadow > 0.0; ++y) {
    double nearest = 1e9;
    for (int x = depth.cols - 1; x >= 0; --x) {
      const double column = x - shadow / std::max(0.1, static_cast<double>(depth(y, x)));
      dark(y, x) = column > nearest + 1.0 ? 1 : 0;
      nearest = std::min(nearest, column);
    }
  }
  cv::dilate(dark, dark, cv::Mat::ones(15, 15, CV_8U));
  const cv::Mat1b out((low == high) & (low >= 0.0F) & (dark == 0));
  const cv::Rect inner(depth.cols / 12, depth.rows / 12, depth.cols * 5 / 6, depth.rows * 5 / 6);
  cv::Mat1b within(out.size(), uchar{0});
  out(inner).copyTo(within(inner));
  return within;
}

/// Sums over pixels by distance: under 1.5 m, under 2.5 m, further.
struct Sums {
  double count[3] = {}, residual[3] = {}, squares[3] = {}, expected_holes = 0.0, holes = 0.0;

  void add(const Formula& formula, const World& world, const View& view, const cv::Mat1w& measured) {
    const cv::Mat1f depth = exact_depth(view);
    const cv::Mat1b use = undisturbed(view.ids, depth, formula.shadow);
    const DepthRange range = depth_range(formula.sensor);
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        const auto z = static_cast<double>(depth(y, x));
        if (use(y, x) == 0 || z < range.min || z > 0.9 * range.max) continue;
        const auto face = static_cast<std::size_t>(view.ids(y, x));
        const Eigen::Vector3d ray = view.world_from_camera.rotation * view.camera.unproject(x, y, 1.0);
        const double cosine = std::abs(world.scene.faces[face].normal.dot(ray.normalized()));
        expected_holes += 0.5 * std::erfc(formula.spare(*world.materials[face], cosine, z) / std::sqrt(2.0));
        holes += measured(y, x) == 0 ? 1.0 : 0.0;
        if (measured(y, x) == 0) continue;

        const std::size_t bin = z < 1.5 ? 0 : z < 2.5 ? 1 : 2;
        const double r = (measured(y, x) / 5000.0 - z) / formula.sigma(z, std::acos(cosine), view.camera.fx);
        ++count[bin];
        residual[bin] += r;
        squares[bin] += r * r;
      }
    }
  }
};

TEST(SynthSensorWorlds, NoiseBiasAndHolesAreTheFormulas) {
  const char* kinds[] = {"home", "office", "corridor", "building"};
  const std::vector<Formula> all = formulas();
  std::vector<Sums> sums(all.size());
  for (int layout = 0; layout < 10; ++layout) {
    SynthOptions options;
    options.layout = options.seed = layout;
    options.floors = 2;
    options.frames = 2;
    options.fps = 0.1;
    const auto scene = make_layout(kinds[layout % 4], options);
    ASSERT_TRUE(scene) << scene.error().message;
    const auto world = build_world(*scene, options, core::Executor(1));
    ASSERT_TRUE(world) << world.error().message;
    const auto source = SynthSource::create(*world, 0);
    ASSERT_TRUE(source);

    for (std::size_t k = 0; k < all.size(); ++k) {
      const auto seed = static_cast<std::uint64_t>(layout);
      const NoiseTiles tiles = make_noise(all[k].sensor, seed);
      for (std::size_t i = 0; i < (*source)->size(); ++i) {
        const View view = look(**world, make_camera(all[k].sensor, 320, 240, 30.0).color,
                               (*source)->world_from_camera((*source)->info(i).stamp));
        sums[k].add(all[k], **world, view,
                    measure_depth(**world, view, all[k].sensor, {}, tiles, {seed, static_cast<int>(i)}));
      }
    }
  }

  for (std::size_t k = 0; k < all.size(); ++k) {
    const std::string name(to_string(all[k].sensor));
    const Sums& s = sums[k];
    RecordProperty(name + "_holes", std::to_string(s.holes / s.expected_holes));
    EXPECT_GT(s.expected_holes, 500.0) << name;
    EXPECT_NEAR(s.holes / s.expected_holes, 1.0, 0.05) << name;
    for (std::size_t b = 0; b < 3; ++b) {
      const double noise = std::sqrt(s.squares[b] / s.count[b]), bias = s.residual[b] / s.count[b];
      RecordProperty(name + std::to_string(b), std::to_string(noise) + ", " + std::to_string(bias) + " of " +
                                                   std::to_string(s.count[b]));
      ASSERT_GT(s.count[b], 20000.0) << name;
      EXPECT_NEAR(noise, 1.0, 0.05) << name << b;
      EXPECT_NEAR(bias, 0.0, 0.05) << name << b;
    }
  }
}

}  // namespace
}  // namespace plumbline::synth
