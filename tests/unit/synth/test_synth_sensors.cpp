// SPDX-License-Identifier: BSD-3-Clause
// Noise, holes and faults of depth cameras are those of the formulas in docs/method/generated_worlds.md.
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/imgproc.hpp>

#include "plumbline/synth/source.hpp"

namespace plumbline::synth {
namespace {

/// A corner of a room on matt surfaces; $FLOOR and $FRONT are materials.
std::unique_ptr<SynthSource> corner(SynthOptions options, const std::string& floor = "paper",
                                    const std::string& front = "paper") {
  const std::string yaml = R"(
objects:
  - floor: {from: [-2, -3], to: [2, 2.1], material: )" +
                           floor + R"(}
  - ceiling: {from: [-2, -3], to: [2, 2.1], height: 2.5, material: paper}
  - wall: {name: front, from: [-2, 2.05], to: [2, 2.05], thickness: 0.1, material: )" +
                           front + R"(}
  - wall: {name: left, from: [-2, -3], to: [-2, 2], material: paper}
  - wall: {name: right, from: [2, 2], to: [2, -3], material: paper}
  - wall: {name: back, from: [2, -3], to: [-2, -3], material: paper}
  - lamp: {at: [0, 0, 2.5], power: 2}
robots:
  - path: [{at: [0, -1, 1.2], look: [0, 9, 1.2]}, {at: [0.3, -1, 1.2], look: [0.3, 9, 1.2]}]
)";
  const auto scene = parse_scene(yaml, "test.yaml");
  if (!scene) throw std::runtime_error(scene.error().message);
  options.motion = Motion::kWheeled;
  const core::Executor executor(1);
  auto source = SynthSource::create(*build_world(*scene, options, executor), 0);
  if (!source) throw std::runtime_error(source.error().message);
  return std::move(*source);
}

SynthOptions of_sensor(Sensor sensor, int frames = 1, const std::string& faults = "") {
  SynthOptions options;
  options.sensor = sensor;
  options.frames = frames;
  options.width = 320;
  options.height = 240;
  options.depth_faults = faults;
  return options;
}

/// A pixel in the middle of a face: its true and its measured depth (0: none), and the angle of incidence.
struct Reading {
  int x, y;
  double truth, measured, angle, radius2;
};

/// Calls `use` for the pixels of a source that are no nearer than 5 px to a border.
void each_reading(const SynthSource& source, const std::function<void(const Reading&)>& use) {
  const sensor::Camera& camera = source.true_camera();
  const sensor::Pinhole& k = camera.depth ? *camera.depth : camera.color;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const ExactFrame exact = source.exact(i);
    const cv::Mat depth = source.stored(i)->depth.pixels;
    cv::Mat faces, low, high;
    exact.face.convertTo(faces, CV_32F);
    cv::erode(faces, low, cv::Mat::ones(11, 11, CV_8U));
    cv::dilate(faces, high, cv::Mat::ones(11, 11, CV_8U));
    for (int y = 5; y < depth.rows - 5; ++y) {
      for (int x = 20; x < depth.cols - 5; ++x) {
        if (low.at<float>(y, x) != high.at<float>(y, x) || low.at<float>(y, x) < 0.0F) continue;
        // The normal from three neighbours.
        const auto point = [&](int u, int v) {
          return k.unproject(u, v, static_cast<double>(exact.depth.at<float>(v, u)));
        };
        const Eigen::Vector3d p = point(x, y);
        const Eigen::Vector3d n = (point(x + 4, y) - p).cross(point(x, y + 4) - p).normalized();
        const double cx = 0.5 * (depth.cols - 1), cy = 0.5 * (depth.rows - 1);
        use({x, y, p.z(), depth.at<std::uint16_t>(y, x) / 5000.0,
             std::acos(std::min(1.0, std::abs(n.dot(p.normalized())))),
             ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (cx * cx + cy * cy)});
      }
    }
  }
}

TEST(SynthSensors, NoiseIsThePublishedOne) {
  const auto graze = [](double a) { return a * a / ((M_PI_2 - a) * (M_PI_2 - a)); };
  const std::pair<Sensor, std::function<double(double, double)>> sensors[] = {
      {Sensor::kTof,
       [&](double z, double a) {  // Fankhauser et al. 2015
         return 1e-3 * (1.5 - 0.5 * z + 0.3 * z * z + 0.1 * z * std::sqrt(z) * graze(a));
       }},
      {Sensor::kStructured,
       [&](double z, double a) {  // Nguyen et al. 2012
         return 0.0012 + 0.0019 * std::pow(z - 0.4, 2) + 0.0001 / std::sqrt(z) * graze(a);
       }},
      {Sensor::kStereo, [](double z, double) { return z * z * 0.08 / (231.0 * 0.05); }},
      {Sensor::kPhone, [](double, double) { return 0.01; }},
  };

  for (const auto& [sensor, sigma] : sensors) {
    const auto source = corner(of_sensor(sensor, 16));
    double sum = 0.0, squares = 0.0;
    std::size_t count = 0;
    each_reading(*source, [&, f = sigma](const Reading& r) {
      if (r.measured == 0.0) return;
      const double residual = (r.measured - r.truth) / f(r.truth, r.angle);
      sum += residual;
      squares += residual * residual;
      ++count;
    });
    ASSERT_GT(count, 200000U) << to_string(sensor);
    EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 1.0, 0.05) << to_string(sensor);
    EXPECT_NEAR(sum / static_cast<double>(count), 0.0, 0.05) << to_string(sensor);
  }
}

TEST(SynthSensors, HolesAreWhereTooLittleLightComesBack) {
  struct Case {
    Sensor sensor;
    double least, range;  ///< reflectance and distance of the weakest surface that is measured
    const char* material;
    double reflectance;
  };
  const Case cases[] = {{Sensor::kTof, 0.15, 5.46, "plastic_black", 0.06},
                        {Sensor::kStructured, 0.10, 5.0, "screen", 0.03},
                        {Sensor::kPhone, 0.10, 5.0, "screen", 0.03}};
  for (const Case& c : cases) {
    const auto source = corner(of_sensor(c.sensor, 12), c.material, c.material);
    double expected = 0.0, found = 0.0;
    each_reading(*source, [&](const Reading& r) {
      if (r.y < 140) return;  // ceiling and side walls are white
      const double signal = c.reflectance * std::cos(r.angle) / c.least * std::pow(c.range / r.truth, 2);
      expected += 0.5 * std::erfc((signal - 1.0) / (0.1 * std::sqrt(2.0)));
      found += r.measured == 0.0 ? 1.0 : 0.0;
    });
    ASSERT_GT(expected, 5000.0) << to_string(c.sensor);
    EXPECT_NEAR(found / expected, 1.0, 0.05) << to_string(c.sensor);
  }
}

TEST(SynthSensors, SystematicFaultsAreTheirFormulas) {
  const auto biased = [](const std::string& faults, const std::function<double(const Reading&)>& model) {
    const auto source = corner(of_sensor(Sensor::kIdeal, 2, faults));
    double worst = 0.0, effect = 0.0;
    each_reading(*source, [&](const Reading& r) {
      worst = std::max(worst, std::abs(r.measured - model(r)));
      effect = std::max(effect, std::abs(r.measured - r.truth));
    });
    EXPECT_LT(worst, 0.05 * effect) << faults;
    EXPECT_GT(effect, 0.01) << faults;
  };
  biased("offset", [](const Reading& r) { return 1.0 / (1.0 / r.truth + 0.01); });
  biased("offset=-0.02,scale=2%", [](const Reading& r) { return 1.02 / (1.0 / r.truth - 0.02); });
  biased("radial=3%", [](const Reading& r) { return r.truth * (1.0 + 0.03 * r.radius2); });
  biased("ray", [](const Reading& r) {
    const double u = (r.x - 159.5) / 262.5, v = (r.y - 119.5) / 262.5;
    return r.truth * std::sqrt(1.0 + u * u + v * v);
  });

  // Warming up takes minutes.
  auto slow = of_sensor(Sensor::kIdeal, 2, "drift=5%");
  slow.fps = 1.0;
  slow.frames = 61;
  const auto source = corner(slow);
  const ExactFrame exact = source->exact(60);
  const double z = static_cast<double>(exact.depth.at<float>(120, 160));
  const double measured = source->stored(60)->depth.pixels.at<std::uint16_t>(120, 160) / 5000.0;
  EXPECT_NEAR(measured / z - 1.0, 0.05 * (1.0 - std::exp(-1.0)), 0.001);
}

TEST(SynthSensors, LightThatGoesAstrayDoesWhatItDoes) {
  // A mirror at 3 m shows the wall 2 m behind the camera.
  const auto mirror = corner(of_sensor(Sensor::kIdeal, 1, "mirrors"), "paper", "metal");
  const auto depth = mirror->stored(0)->depth.pixels;
  EXPECT_NEAR(depth.at<std::uint16_t>(120, 160) / 5000.0, 3.0 + 4.94, 0.01);
  EXPECT_NEAR(corner(of_sensor(Sensor::kTof, 1, "mirrors"), "paper", "metal")
                  ->stored(0)
                  ->depth.pixels.at<std::uint16_t>(120, 160),
              0, 0);  // beyond its range

  // Corners of the room are rounded, the middle of a wall is where it is.
  const auto round = corner(of_sensor(Sensor::kIdeal, 1, "multipath=0.1"));
  double middle = 0.0, edge = 0.0;
  each_reading(*round, [&](const Reading& r) {
    const double bias = r.measured - r.truth;
    if (std::abs(r.x - 160) < 20 && std::abs(r.y - 110) < 20) middle = std::max(middle, std::abs(bias));
    edge = std::max(edge, bias);
  });
  EXPECT_LT(middle, 1e-3);
  EXPECT_GT(edge, 0.02);
  EXPECT_LT(edge, 0.1);

  // Stripes wander, are as strong as asked for, and have no mean.
  const auto striped = corner(of_sensor(Sensor::kIdeal, 1, "stripes=1%"));
  double sum = 0.0, squares = 0.0, count = 0.0;
  each_reading(*striped, [&](const Reading& r) {
    const double share = r.measured / r.truth - 1.0;
    sum += share;
    squares += share * share;
    ++count;
  });
  EXPECT_NEAR(std::sqrt(squares / count), 0.01 / std::sqrt(2.0), 0.05 * 0.01);
  EXPECT_NEAR(sum / count, 0.0, 5e-4);

  // Surfaces at more than 60 degrees are lost.
  const auto holes = corner(of_sensor(Sensor::kIdeal, 1, "holes=0.5"));
  each_reading(*holes, [&](const Reading& r) {
    if (std::abs(std::cos(r.angle) - 0.5) > 0.01) {
      EXPECT_EQ(r.measured == 0.0, std::cos(r.angle) < 0.5);
    }
  });
}

TEST(SynthSensors, DepthOfAPhoneIsSmallerThanItsPicture) {
  const auto source = corner(of_sensor(Sensor::kPhone, 2));
  ASSERT_TRUE(source->camera().depth);
  EXPECT_EQ(source->stored(0)->depth.pixels.size(), cv::Size(256, 192));
  const auto frame = source->read(0);
  EXPECT_EQ(frame->depth.size(), frame->color.size());
  EXPECT_NEAR(frame->depth.at<float>(100, 160), 3.0F, 0.06F);

  auto options = of_sensor(Sensor::kIdeal);
  options.depth_width = 80;
  options.depth_height = 60;
  const auto coarse = corner(options);
  EXPECT_EQ(coarse->stored(0)->depth.pixels.size(), cv::Size(80, 60));
  EXPECT_NEAR(coarse->read(0)->depth.at<float>(100, 160), 3.0F, 0.002F);
  options.depth_height = 0;
  EXPECT_FALSE(check(options));
}

TEST(SynthSensors, MistakesInFaultsAreNamed) {
  SynthOptions options;
  options.depth_faults = "hole";
  const auto wrong = check(options);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("holes"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::synth
