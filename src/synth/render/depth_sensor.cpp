// SPDX-License-Identifier: BSD-3-Clause
#include "render/depth_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "plumbline/sensor/depth_noise.hpp"
#include "render/sensor_model.hpp"
#include "scene/random.hpp"

namespace plumbline::synth {

namespace {

constexpr int kNoiseTile = 512;  // a power of two

/// Sensor constants; baseline and disparity step are those of the devices.
struct Device {
  float focal_baseline;  ///< px m
  float step;            ///< px of disparity
  float wander;          ///< px that borders wander to and fro
  float flying;          ///< share of border pixels that float between front and back
  float fixed_share;     ///< share of the noise variance that is fixed while the picture does not change
  /// The depth camera sees less than the colour camera it is registered to: shares of width (left, right) and
  /// height (top, bottom) without depth.
  float left, right, top, bottom;
};
Device device(Sensor sensor) {
  if (sensor == Sensor::kTof) return {0.0F, 0.0F, 0.5F, 0.35F, 0.3F, 0.0F, 0.0F, 0.0F, 0.0F};
  if (sensor == Sensor::kStereo) return {23.1F, 1.0F / 32.0F, 2.0F, 0.3F, 0.3F, 0.04F, 0.0F, 0.0F, 0.0F};
  if (sensor == Sensor::kPhone) return {0.0F, 0.0F, 1.0F, 0.9F, 0.3F, 0.0F, 0.0F, 0.0F, 0.0F};
  if (sensor == Sensor::kRealsense) return {31.0F, 1.0F / 32.0F, 1.6F, 0.35F, 0.5F, 0.03F, 0.0F, 0.0F, 0.0F};
  return {43.5F, 1.0F / 8.0F, 1.2F, 0.06F, 0.5F, 0.010F, 0.046F, 0.026F, 0.023F};
}

cv::Mat1f white_tile(std::uint64_t seed) {
  cv::Mat1f tile(kNoiseTile, kNoiseTile);
  Rng rng(seed, 0x711e);
  for (float& v : tile) v = static_cast<float>(rng.normal());
  return tile;
}

/// Blurs round the edges and brings the variance back to 1.
void correlate(cv::Mat1f& tile, double sigma) {
  cv::Mat1f wide;
  cv::copyMakeBorder(tile, wide, 64, 64, 64, 64, cv::BORDER_WRAP);
  cv::GaussianBlur(wide, wide, {0, 0}, sigma);
  tile = wide(cv::Rect(64, 64, kNoiseTile, kNoiseTile)).clone();
  cv::Scalar mean, deviation;
  cv::meanStdDev(tile, mean, deviation);
  tile = (tile - mean[0]) / deviation[0];
}

/// A tile with an independent shift.
class Field {
 public:
  Field(const cv::Mat1f& tile, std::uint64_t key)
      : tile_(tile), dx_(static_cast<int>(key & 511U)), dy_(static_cast<int>(key >> 9U & 511U)) {}
  [[nodiscard]] const float* row(int y) const { return tile_[(y + dy_) & (kNoiseTile - 1)]; }
  [[nodiscard]] int column(int x) const { return (x + dx_) & (kNoiseTile - 1); }
  [[nodiscard]] float at(int x, int y) const { return row(y)[column(x)]; }

 private:
  const cv::Mat1f& tile_;
  int dx_, dy_;
};

std::uint64_t frame_bits(const FrameKey& key, std::uint64_t purpose, std::int64_t frame) {
  return mix(key.seed, purpose, static_cast<std::uint64_t>(frame));
}

/// Exact depth looked up where the matching window of the device really was: borders become ragged.
cv::Mat1f wander(const cv::Mat1f& exact, const Device& d, const NoiseTiles& tiles, const FrameKey& key,
                 cv::Mat1b& from) {
  const Field still_x(tiles.coarse, mix(key.seed, 11)), still_y(tiles.coarse, mix(key.seed, 12));
  const Field now_x(tiles.medium, frame_bits(key, 13, key.index)),
      now_y(tiles.medium, frame_bits(key, 14, key.index));
  cv::Mat1f out(exact.size());
  from.create(exact.size());  // 1 where the neighbourhood is not smooth

  for (int y = 0; y < exact.rows; ++y) {
    const float* row = exact[y];
    const float *up = exact[std::max(0, y - 2)], *low = exact[std::min(exact.rows - 1, y + 2)];
    for (int x = 0; x < exact.cols; ++x) {
      const float z = row[x], tolerance = 0.02F + 0.02F * z;
      const float left = row[std::max(0, x - 2)], right = row[std::min(exact.cols - 1, x + 2)];
      const bool border =
          std::abs(left + right - 2.0F * z) > tolerance || std::abs(up[x] + low[x] - 2.0F * z) > tolerance;
      from(y, x) = border ? 1 : 0;

      // Smooth surfaces do not depend on the window.
      if (!border) {
        out(y, x) = z;
        continue;
      }

      // A constant part of the offset and a changing one.
      const float jx = d.wander * (0.6F * still_x.at(x, y) + 0.8F * now_x.at(x, y));
      const float jy = d.wander * (0.6F * still_y.at(x, y) + 0.8F * now_y.at(x, y));
      const int sx = std::clamp(x + static_cast<int>(std::lround(jx)), 0, exact.cols - 1);
      const int sy = std::clamp(y + static_cast<int>(std::lround(jy)), 0, exact.rows - 1);
      out(y, x) = exact(sy, sx);
    }
  }

  return out;
}

/// Columns that the projector, to the right of the camera, cannot light: behind the left edge of near things.
void cast_shadow(cv::Mat1f& depth, float focal_baseline) {
  for (int y = 0; y < depth.rows; ++y) {
    float* row = depth[y];
    float nearest = 1e9F;
    for (int x = depth.cols - 1; x >= 0; --x) {
      if (row[x] <= 0.0F) continue;
      const float column = static_cast<float>(x) - focal_baseline / row[x];
      if (column > nearest + 1.2F) {
        row[x] = 0.0F;
      } else {
        nearest = std::min(nearest, column);
      }
    }
  }
}

constexpr float kLeastLight = 0.075F;  // smallest share of the projector's light that gives a measurement

/// Share of the projector's light that comes back: 1 = plenty.
float light_back(const Material& m, float cosine, float z) {
  if (m.gloss > 0.25F && cosine > 0.997F) return 0.0F;  // glint straight back
  return m.infrared * cosine * (1.0F - m.gloss * (1.0F - cosine)) * 3.0F / (0.6F + 0.4F * z * z);
}

/// Columns from `first` to before `end` of a row have depth. The registered picture's edge is a little askew.
struct Seen {
  int first, end;
};
Seen seen_columns(const Device& d, int width, int height, int y) {
  const auto w = static_cast<float>(width), h = static_cast<float>(height), fy = static_cast<float>(y);
  if (fy < h * d.top || fy > h * (1.0F - d.bottom)) return {0, 0};
  const float lean = 0.3F * fy / h;
  return {static_cast<int>(w * d.left * (0.7F + lean)),
          width - static_cast<int>(w * d.right * (0.9F + 0.6F * lean))};
}

class Measurement {
 public:
  Measurement(const World& world, const View& view, Sensor sensor, const DepthFaults& faults,
              const NoiseTiles& tiles, const FrameKey& key)
      : world_(world),
        view_(view),
        seen_(faulty_depth(world, view, faults, frame_bits(key, 41, key.index))),
        sensor_(sensor),
        device_(device(sensor)),
        range_(depth_range(sensor)),
        tiles_(tiles),
        key_(key) {}

  cv::Mat1w run() {
    cv::Mat1b border;
    cv::Mat1f depth = wander(seen_.depth, device_, tiles_, key_, border);
    cast_shadow(depth, device_.focal_baseline);
    cv::Mat1w raw(depth.size());
    for (int y = 0; y < raw.rows; ++y) {
      // By formulas, or by simulated matching.
      if (modelled(sensor_)) {
        model_row(y, depth, border, raw[y]);
      } else {
        row(y, depth, border, raw[y]);
      }
    }
    return raw;
  }

 private:
  [[nodiscard]] float signal(int face, int x, int y, float z) const {
    return light_back(*world_.materials[static_cast<std::size_t>(face)], incidence(view_, face, x, y), z);
  }

  [[nodiscard]] bool mirrors(int x, int y) const { return !seen_.mirror.empty() && seen_.mirror(y, x) != 0; }

  /// Depth at a border: 0 if the window saw two surfaces; some pixels float between them.
  [[nodiscard]] float border_depth(const cv::Mat1f& depth, int x, int y, float chance) const {
    const float z = depth(y, x);
    if (chance > 0.9F) return 0.0F;
    if (!(chance < -1.0F && std::abs(chance + 1.0F) < 2.5F * device_.flying)) return z;
    const float other = depth(y, std::max(0, x - 2));
    return other > 0.0F ? 0.5F * (z + other) : z;
  }

  /// A row of a sensor whose noise and limits are formulas.
  void model_row(int y, const cv::Mat1f& depth, const cv::Mat1b& border, std::uint16_t* out) const {
    const Field still(tiles_.fine, mix(key_.seed, 21)), now(tiles_.fine, frame_bits(key_, 22, key_.index));
    const Field flicker(tiles_.medium, frame_bits(key_, 24, key_.index));
    const auto share = static_cast<double>(device_.fixed_share);
    const double fixed = std::sqrt(share), fresh = std::sqrt(1.0 - share);
    std::fill(out, out + depth.cols, std::uint16_t{0});

    // Columns that the device covers.
    const auto [first, end] = seen_columns(device_, depth.cols, depth.rows, y);
    for (int x = first; x < end; ++x) {
      const int face = view_.ids(y, x);
      if (!(depth(y, x) > 0.0F) || face < 0) continue;
      const float chance = flicker.at(x, y);
      const auto z = static_cast<double>(border(y, x) != 0 ? border_depth(depth, x, y, chance) : depth(y, x));
      if (z < range_.min || z > range_.max) continue;

      // Too little light returns.
      const auto cosine = std::min(1.0, static_cast<double>(incidence(view_, face, x, y)));
      const auto reflectance =
          static_cast<double>(world_.materials[static_cast<std::size_t>(face)]->infrared);
      const double least = 1.0 + kSignalFlicker * static_cast<double>(chance);
      if (!mirrors(x, y) && model_signal(sensor_, reflectance, cosine, z) < least) continue;

      // Fixed pattern and temporal noise.
      const double sigma = model_sigma(sensor_, z, std::acos(cosine), view_.camera.fx);
      const double noise =
          fixed * static_cast<double>(still.at(x, y)) + fresh * static_cast<double>(now.at(x, y));
      const double raw = 5000.0 * stepped(z, sigma, noise);
      if (raw > 0.0 && raw < 65534.5) out[x] = static_cast<std::uint16_t>(raw + 0.5);
    }
  }
  /// Depth with noise; if the sensor measures disparity, in steps of it, which are a part of the noise.
  [[nodiscard]] double stepped(double z, double sigma, double noise) const {
    if (!(device_.step > 0.0F)) return z + sigma * noise;
    const auto focal_baseline = static_cast<double>(device_.focal_baseline);
    const double step = static_cast<double>(device_.step), spread = sigma * focal_baseline / (z * z);
    const double own = std::sqrt(std::max(0.15 * spread * spread, spread * spread - step * step / 12.0));
    return focal_baseline / (step * std::round((focal_baseline / z + own * noise) / step));
  }

  void row(int y, const cv::Mat1f& depth, const cv::Mat1b& border, std::uint16_t* out) const {
    const Field still(tiles_.fine, mix(key_.seed, 21)), now(tiles_.fine, frame_bits(key_, 22, key_.index));
    const Field blobs(tiles_.coarse, mix(key_.seed, 23)),
        flicker(tiles_.medium, frame_bits(key_, 24, key_.index));
    const int* ids = view_.ids[y];
    const float fixed = std::sqrt(device_.fixed_share), fresh = std::sqrt(1.0F - device_.fixed_share);
    const float step2 = device_.step * device_.step / 12.0F;
    std::fill(out, out + depth.cols, std::uint16_t{0});

    const auto [first, end] = seen_columns(device_, depth.cols, depth.rows, y);
    int lit = -1;  // the face for which `weak` was computed; computed again every four pixels
    float weak = 0.0F;
    for (int x = first; x < end; ++x) {
      float z = depth(y, x);
      if (!(z > 0.0F) || ids[x] < 0) continue;

      // Borders take the depth of one side, or none.
      const float chance = flicker.at(x, y);
      if (border(y, x) != 0) z = border_depth(depth, x, y, chance);
      if (!(z > 0.0F)) continue;

      if (ids[x] != lit || (x & 3) == 0) weak = signal(ids[x], x, y, z);
      lit = ids[x];
      if (!mirrors(x, y) && weak < kLeastLight + 0.018F * blobs.at(x, y) + 0.012F * chance) continue;

      // The limit of range is not sharp.
      const auto zd = static_cast<double>(z);
      if (zd < range_.min || zd > range_.max + 0.15 * static_cast<double>(blobs.at(x, y))) continue;

      // Noise and steps are those of disparity.
      const float per_metre = device_.focal_baseline / (z * z);
      const float sigma = static_cast<float>(sensor::depth_sigma(zd)) * per_metre;
      const float own = std::sqrt(std::max(0.15F * sigma * sigma, sigma * sigma - step2));
      const float noise = fixed * still.at(x, y) + fresh * now.at(x, y);
      const float disparity = device_.focal_baseline / z + own * noise;
      const float stepped =
          static_cast<float>(static_cast<int>(disparity / device_.step + 0.5F)) * device_.step;
      if (stepped <= device_.step) continue;

      const float raw = device_.focal_baseline / stepped * 5000.0F;
      if (raw < 65534.5F) out[x] = static_cast<std::uint16_t>(raw + 0.5F);
    }
  }

  const World& world_;
  const View& view_;
  FaultyDepth seen_;
  Sensor sensor_;
  Device device_;
  DepthRange range_;
  const NoiseTiles& tiles_;
  FrameKey key_;
};

}  // namespace

DepthRange depth_range(Sensor sensor) {
  if (sensor == Sensor::kKinect) return {0.45, 7.0};
  if (sensor == Sensor::kRealsense) return {0.25, 9.0};
  if (sensor == Sensor::kTof) return {0.5, 5.46};
  if (sensor == Sensor::kStructured) return {0.5, 5.0};
  if (sensor == Sensor::kStereo) return {0.2, 10.0};
  if (sensor == Sensor::kPhone) return {0.2, 5.0};
  return {0.05, 13.1};
}

bool measures(Sensor sensor, const Material& material, const cv::Size& size, const cv::Point2d& pixel,
              double z, double cosine) {
  if (sensor == Sensor::kIdeal) return true;
  constexpr float kFlicker = 0.05F;  // about two standard deviations of the least light

  // Columns that the device does not cover.
  const Seen seen = seen_columns(device(sensor), size.width, size.height, static_cast<int>(pixel.y));
  if (pixel.x < seen.first || pixel.x >= seen.end) return false;
  if (modelled(sensor))
    return model_signal(sensor, static_cast<double>(material.infrared), cosine, z) >
           1.0 + 2.0 * kSignalFlicker;
  return light_back(material, static_cast<float>(cosine), static_cast<float>(z)) > kLeastLight + kFlicker;
}

NoiseTiles make_noise(Sensor sensor, std::uint64_t seed) {
  NoiseTiles tiles;
  if (sensor == Sensor::kIdeal) return tiles;

  // Correlation lengths of the devices.
  tiles.fine = white_tile(mix(seed, 1));
  correlate(tiles.fine, sensor == Sensor::kRealsense || sensor == Sensor::kStereo ? 1.8 : 1.1);
  tiles.medium = white_tile(mix(seed, 7));
  correlate(tiles.medium, 3.0);
  tiles.coarse = white_tile(mix(seed, 2));
  correlate(tiles.coarse, 6.0);
  tiles.color.create(kNoiseTile, kNoiseTile);

  // Neighbouring colours are interpolated from a mosaic, hence smooth; the three channels share a part.
  cv::Mat1f channel[4];
  for (std::uint64_t k = 0; k < 4; ++k) {
    channel[k] = white_tile(mix(seed, 3 + k));
    correlate(channel[k], k == 3 ? 0.6 : 1.0);
  }

  tiles.fine = 0.72 * tiles.fine + 0.58 * tiles.medium +
               0.38 * tiles.coarse;  // a sharp core with a skirt, as measured

  for (int y = 0; y < kNoiseTile; ++y) {
    for (int x = 0; x < kNoiseTile; ++x) {
      for (int k = 0; k < 3; ++k) {
        const float v = 16.0F * (0.75F * channel[3](y, x) + 0.66F * channel[k](y, x));
        tiles.color(y, x)[k] = static_cast<std::int8_t>(std::clamp(std::lround(v), -120L, 120L));
      }
    }
  }

  return tiles;
}

cv::Mat1w measure_depth(const World& world, const View& view, Sensor sensor, const DepthFaults& faults,
                        const NoiseTiles& tiles, const FrameKey& key) {
  if (sensor != Sensor::kIdeal) return Measurement(world, view, sensor, faults, tiles, key).run();

  // An ideal sensor only clips and rounds.
  const cv::Mat1f exact = faulty_depth(world, view, faults, frame_bits(key, 41, key.index)).depth;
  cv::Mat1w raw(exact.size());
  const auto range = depth_range(sensor);
  const auto min = static_cast<float>(range.min), max = static_cast<float>(range.max);
  for (int y = 0; y < raw.rows; ++y) {
    const float* z = exact[y];
    std::uint16_t* out = raw[y];
    for (int x = 0; x < raw.cols; ++x) {
      out[x] =
          z[x] > min && z[x] < max ? static_cast<std::uint16_t>(z[x] * 5000.0F + 0.5F) : std::uint16_t{0};
    }
  }
  return raw;
}

void add_color_noise(cv::Mat3b& image, Sensor sensor, float gain, const NoiseTiles& tiles,
                     const FrameKey& key) {
  if (sensor == Sensor::kIdeal) return;

  // Shot noise: after the square-root coding it is the same for all levels, but for the shadows; more gain,
  // more noise.
  const float sigma = std::clamp(0.72F * std::sqrt(std::max(gain, 0.3F)), 0.5F, 3.6F);
  const int scale = static_cast<int>(std::lround(256.0F * sigma / 16.0F));
  const std::uint64_t bits = frame_bits(key, 31, key.index);
  const int dx = static_cast<int>(bits & 511U), dy = static_cast<int>(bits >> 9U & 511U);

  for (int y = 0; y < image.rows; ++y) {
    const auto* noise = tiles.color[(y + dy) & (kNoiseTile - 1)];
    auto* p = image.ptr<std::uint8_t>(y);

    for (int x = 0; x < image.cols;) {
      const int start = (x + dx) & (kNoiseTile - 1), run = std::min(kNoiseTile - start, image.cols - x);
      const auto* n = reinterpret_cast<const std::int8_t*>(noise + start);
      for (int i = 0; i < 3 * run; ++i) {
        const int v = p[3 * x + i] + ((n[i] * scale + 128) >> 8);
        p[3 * x + i] = static_cast<std::uint8_t>(v < 0 ? 0 : v > 255 ? 255 : v);
      }
      x += run;
    }
  }
}

namespace {
/// Mean of `taps` copies of a cell's pixels, shifted along `f`.
void smear(const cv::Mat3b& image, const cv::Rect& cell, const cv::Vec2f& f, int taps, cv::Mat3b& out) {
  int dx[16], dy[16];
  for (int k = 0; k < taps; ++k) {
    const float s = static_cast<float>(k) / static_cast<float>(taps - 1) - 0.5F;
    dx[k] = static_cast<int>(std::lround(s * f[0]));
    dy[k] = static_cast<int>(std::lround(s * f[1]));
  }

  // Rounded division in integers.
  const int divide = (65536 + taps / 2) / taps;

  for (int y = cell.y; y < cell.y + cell.height; ++y) {
    int sum[3 * 8] = {};

    for (int k = 0; k < taps; ++k) {
      const auto* row = image.ptr<std::uint8_t>(std::clamp(y + dy[k], 0, image.rows - 1));

      // Far from the border no pixel needs clamping.
      if (cell.x + dx[k] >= 0 && cell.x + dx[k] + cell.width <= image.cols) {
        const std::uint8_t* p = row + 3 * (cell.x + dx[k]);
        for (int i = 0; i < 3 * cell.width; ++i) sum[i] += p[i];
      } else {
        for (int i = 0; i < cell.width; ++i) {
          const std::uint8_t* p = row + 3 * std::clamp(cell.x + i + dx[k], 0, image.cols - 1);
          for (int c = 0; c < 3; ++c) sum[3 * i + c] += p[c];
        }
      }
    }

    // Back to bytes, rounded.
    auto* q = out.ptr<std::uint8_t>(y) + 3 * cell.x;
    for (int i = 0; i < 3 * cell.width; ++i)
      q[i] = static_cast<std::uint8_t>(std::min(255, (sum[i] * divide + 32768) >> 16));
  }
}
}  // namespace

cv::Mat3b motion_blur(const cv::Mat3b& image, const cv::Mat2f& flow) {
  double longest = 0.0;
  for (const cv::Vec2f& f : flow) longest = std::max(longest, static_cast<double>(std::hypot(f[0], f[1])));

  // Less than a pixel is not visible.
  if (longest < 0.8) return image;
  constexpr int kCell = 8;  // pixels that share a direction
  const int taps = std::clamp(static_cast<int>(std::ceil(longest)) + 1, 3, 16);
  cv::Mat3b out(image.size());
  for (int y0 = 0; y0 < image.rows; y0 += kCell) {
    for (int x0 = 0; x0 < image.cols; x0 += kCell) {
      const cv::Vec2f f = flow[std::min(y0 / kCell, flow.rows - 1)][std::min(x0 / kCell, flow.cols - 1)];
      const cv::Rect cell = cv::Rect(x0, y0, kCell, kCell) & cv::Rect({0, 0}, image.size());
      smear(image, cell, f, taps, out);
    }
  }
  return out;
}

}  // namespace plumbline::synth
