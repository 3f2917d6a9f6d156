// SPDX-License-Identifier: BSD-3-Clause
// What the cameras of a generated world give, one frame after the other.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "recording/source_impl.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;
using geometry::Rigid3;

cv::Size depth_size(const SynthOptions& o) {
  if (o.depth_width > 0) return {o.depth_width, o.depth_height};
  return o.sensor == Sensor::kPhone ? cv::Size(256, 192) : cv::Size(o.width, o.height);
}

float SynthSource::Impl::gain(std::int64_t number) const {
  const sensor::Camera small = make_camera(world->options.sensor, 64, 48, world->options.fps);
  const auto k = static_cast<std::size_t>(number / kGainStep);
  const std::lock_guard<std::mutex> lock(exposures->mutex);
  std::vector<float>& gains = exposures->gains;
  float& level = exposures->level;

  // Exposure follows the scene with a delay.
  for (std::size_t i = gains.size(); i < k + 2; ++i) {
    const double t = static_cast<double>(i * kGainStep) / world->options.fps;
    const float now = std::max(0.02F, mean_level(*world, look(*world, small.color, this->at(t))));
    level = i == 0 ? now : level + 0.25F * (now - level);
    gains.push_back(std::clamp(0.68F / level, 0.35F, 3.0F));
  }

  const float s = static_cast<float>(number % kGainStep) / static_cast<float>(kGainStep);
  return gains[k] + s * (gains[k + 1] - gains[k]);
}

/// Pixels that things move during the exposure, on a grid 8 times coarser than the picture.
cv::Mat2f SynthSource::Impl::flow(const View& view, const Stamps& at, double extra_px) const {
  const double exposure = color_faults.motion_blur > 0.0 ? color_faults.motion_blur : 0.010;
  const Rigid3 later = pose(at.color + 0.5 * exposure).inverse(),
               sooner = pose(at.color - 0.5 * exposure).inverse();
  const int w = (view.ids.cols + 7) / 8, h = (view.ids.rows + 7) / 8;
  cv::Mat2f out(h, w);

  // The direction of event blur changes every 15 frames.
  const double angle = Rng(seed, 0xb1 + static_cast<std::uint64_t>(at.number / 15)).uniform(0.0, 2.0 * M_PI);
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i) {
      const int x = std::min(8 * i + 4, view.ids.cols - 1), y = std::min(8 * j + 4, view.ids.rows - 1);

      // Depth at the cell's middle, 3 m without a surface.
      double z = 3.0;
      if (const int id = view.ids(y, x); id >= 0) {
        const FaceView& f = view.faces[static_cast<std::size_t>(id)];
        z = 1.0 /
            static_cast<double>(f.c[0] * static_cast<float>(x) + f.c[1] * static_cast<float>(y) + f.c[2]);
      }

      // The point moves with its surface during the exposure.
      const Vector3d p = view.world_from_camera * view.camera.unproject(x, y, z);
      const World::Mover* mover = color_faults.motion_blur > 0.0 ? world->mover_of(view.ids(y, x)) : nullptr;
      const auto at_time = [&](double dt) -> Vector3d {
        const double now = at.color - kFirstStamp;
        return mover == nullptr
                   ? p
                   : world->motion(*mover, now + dt) * (world->motion(*mover, now).inverse() * p);
      };

      // Motion in the image, with the blur of events.
      const Eigen::Vector2d d = view.camera.project(later * at_time(0.5 * exposure)) -
                                view.camera.project(sooner * at_time(-0.5 * exposure));
      out(j, i) = {static_cast<float>(d.x() + extra_px * std::cos(angle)),
                   static_cast<float>(d.y() + extra_px * std::sin(angle))};
    }
  }

  return out;
}

/// Renders a few rows at a time, each from the camera's pose when they were read out.
cv::Mat3b SynthSource::Impl::rolling(const Stamps& at, const Exposure& exposure) const {
  constexpr int kRows = 8;
  cv::Mat3b image(camera.color.height, camera.color.width);

  for (int first = 0; first < image.rows; first += kRows) {
    // The camera of this strip.
    sensor::Pinhole strip = camera.color;
    strip.height = std::min(kRows, image.rows - first);
    strip.cy -= first;
    const double middle = (first + 0.5 * strip.height) / image.rows - 0.5;
    const double stamp = at.color + middle * world->options.readout_s;
    View view = look(*world, strip, pose(stamp), stamp - kFirstStamp);
    view.first_row = first;
    view.picture_rows = image.rows;

    cv::Mat3b rows = shade(*world, view, {exposure.gain * row_gain(at, stamp), exposure.vignette});

    // Flicker differs between the rows.
    for (int y = 0; color_faults.flicker > 0.0 && y < rows.rows; ++y) {
      const double row_stamp = stamp + (y + 0.5 - 0.5 * rows.rows) / image.rows * world->options.readout_s;
      rows.row(y) *= row_gain(at, row_stamp) / row_gain(at, stamp);
    }
    rows.copyTo(image.rowRange(first, first + strip.height));
  }
  return image;
}

cv::Mat3b SynthSource::Impl::color(const Stamps& at) const {
  const Sensor sensor = world->options.sensor;
  const View view = look(*world, camera.color, pose(at.color), at.color - kFirstStamp);
  const bool real = sensor != Sensor::kIdeal;

  // Exposure, and the events that change it.
  Exposure exposure{gain(at.number), real ? 0.18F : 0.0F};
  if (event(EventKind::kLampOff, at.color) != 0.0) exposure.gain *= 0.08F;
  if (event(EventKind::kCover, at.color) != 0.0) exposure.gain *= 0.004F;
  if (event(EventKind::kWhiteout, at.color) != 0.0) exposure.gain *= 60.0F;

  // Row by row with a rolling shutter.
  cv::Mat3b image = world->options.readout_s > 0.0
                        ? rolling(at, exposure)
                        : shade(*world, view, {exposure.gain * row_gain(at, at.color), exposure.vignette});
  const double blur = event(EventKind::kBlur, at.color);
  const bool moves = color_faults.motion_blur > 0.0;

  // Real lenses blur, as do motion and events.
  if (real) {
    cv::GaussianBlur(image, image, {3, 3}, 0.6);  // lens and mosaic
    image = motion_blur(image, flow(view, at, blur));
  } else if (blur > 0.0 || moves) {
    image = motion_blur(image, flow(view, at, blur));
  }

  // Marks of the lens, then noise of the chip.
  marks.apply(image);
  const float noise_gain = event(EventKind::kLampOff, at.color) != 0.0 ? 3.0F : exposure.gain;
  add_color_noise(image, sensor, noise_gain, tiles, {seed, at.number});
  return image;
}

dataset::StoredPair SynthSource::rendered(std::size_t index) const {
  const Stamps& at = impl_->first_of(index);
  dataset::StoredPair pair;
  pair.color.pixels = impl_->color(at);

  // A blind sensor measures nothing.
  if (blind(index)) {
    pair.depth.pixels = cv::Mat1w::zeros(depth_size(impl_->world->options));
  } else {
    const View view =
        look(*impl_->world, impl_->depth_camera(), impl_->pose(at.depth), at.depth - kFirstStamp);
    pair.depth.pixels = measure_depth(*impl_->world, view, impl_->world->options.sensor, impl_->faults,
                                      impl_->tiles, {impl_->seed, at.number});
  }
  return pair;
}

}  // namespace plumbline::synth
