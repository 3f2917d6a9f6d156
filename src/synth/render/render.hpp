// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pictures of a world from a pose. Const functions, no shared buffers: frames may be rendered in parallel.
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"
#include "render/world.hpp"

namespace plumbline::synth {

/// One face as it appears in one picture. With p = (x, y, 1) in pixels: 1/z = c.p, and texture coordinates
/// (level 0 texels) are (a.p) z and (b.p) z: flat faces need no rays but for visibility.
struct FaceView {
  float a[3], b[3], c[3];
};

/// Everything one picture needs.
struct View {
  sensor::Pinhole camera;
  geometry::Rigid3 world_from_camera;
  std::vector<FaceView> faces;
  cv::Mat1i ids;               ///< face per pixel, -1 = nothing
  int first_row = 0;           ///< of the whole picture, of which this may be a strip
  int picture_rows = 0;        ///< of the whole picture; 0: this is it
  std::optional<double> time;  ///< s after the first frame: walkers are where they are then; none: no walkers
};

/// The walkers' faces as one picture sees them.
class MovingFaces {
 public:
  MovingFaces(const World& world, const View& view, double t);
  /// `fixed`, the face that is seen there without walkers, or the walker's that is in front of it.
  [[nodiscard]] int in_front(const View& view, int fixed, float x, float y) const;
  void draw(View& view) const;
  [[nodiscard]] bool empty() const { return spots_.empty(); }

 private:
  struct Spot {
    std::size_t face;
    geometry::Rigid3 motion;  ///< from where the walk begins
    cv::Rect reach;           ///< pixels
  };
  /// The face of a spot if it is in front of `best` at a pixel, else `best`.
  [[nodiscard]] int nearer(const View& view, const Spot& spot, int best, float x, float y) const;
  const World& world_;
  std::vector<Spot> spots_;
};

/// Texels of level 0 per metre along a face's u and v.
struct TexelScale {
  double u, v;
};
TexelScale texel_scale(const World& world, std::size_t face);

/// Finds the face behind every pixel. Rays are cast only where an edge may cross the picture: there at every
/// second pixel of every second row, and at the pixels between where their neighbours differ.
/// `time`: as in View.
View look(const World& world, const sensor::Pinhole& camera, const geometry::Rigid3& world_from_camera,
          std::optional<double> time = {});

/// Depth along z of the faces in `ids`, metres; 0 = nothing.
cv::Mat1f exact_depth(const View& view);

/// Effects of lens and exposure on light.
struct Exposure {
  float gain = 1.0F;      ///< multiplies the square root of radiance
  float vignette = 0.0F;  ///< share of it lost in the corners
};

/// CV_8UC3 BGR with smoothed borders, before any noise.
cv::Mat3b shade(const World& world, const View& view, const Exposure& exposure);

/// BGR of a spot of a face at unit gain.
cv::Vec3b surface_color(const World& world, std::size_t face, double u, double v);

/// Mean square root of radiance of a picture (0-1 and more) for the automatic exposure.
float mean_level(const World& world, const View& view);

}  // namespace plumbline::synth
