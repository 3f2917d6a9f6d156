// SPDX-License-Identifier: BSD-3-Clause
// Walkers that move through a world while it is filmed.
#include <algorithm>
#include <cmath>

#include "render/render.hpp"
#include "scene/builder.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;

Vector3d Walker::at(double t) const {
  const double length = (to - from).norm();
  const double way = std::fmod(std::max(t, 0.0) * speed, 2.0 * length);
  const double share = way < length ? way / length : 2.0 - way / length;
  return from + share * (to - from);
}

void add_walker(Builder& b, const Walker& walker) {
  const Vector3d way = walker.to - walker.from;
  const geometry::Rigid3 frame = upright(walker.from, std::atan2(way.y(), way.x()));
  b.begin_object("walker", "", walker.mark);
  const Skin clothes{walker.material};
  b.box(frame, {-0.15, -0.25, 0.0}, {0.15, 0.25, 1.42}, clothes);
  b.box(frame, {-0.1, -0.09, 1.42}, {0.12, 0.09, 1.7}, Skin{"terracotta"});
}

namespace {

float inverse_depth(const View& view, int face, float x, float y) {
  if (face < 0) return 0.0F;
  const FaceView& f = view.faces[static_cast<std::size_t>(face)];
  return f.c[0] * x + f.c[1] * y + f.c[2];
}

}  // namespace

int MovingFaces::in_front(const View& view, int fixed, float x, float y) const {
  int best = fixed;
  float nearest = inverse_depth(view, fixed, x, y);
  const Vector3d ray = view.world_from_camera.rotation * view.camera.unproject(x, y, 1.0);
  for (const Spot& spot : spots_) {
    if (!spot.reach.contains({static_cast<int>(x), static_cast<int>(y)})) continue;
    const float here = inverse_depth(view, static_cast<int>(spot.face), x, y);
    if (here <= nearest) continue;
    const Face& face = world_.scene.faces[spot.face];
    const Vector3d d =
        view.world_from_camera.translation + ray / static_cast<double>(here) - spot.shift - face.origin;
    if (!face.contains({d.dot(face.u_axis), d.dot(face.v_axis)})) continue;
    best = static_cast<int>(spot.face);
    nearest = here;
  }
  return best;
}

MovingFaces::MovingFaces(const World& world, const View& view, double t) : world_(world) {
  const geometry::Rigid3 camera_from_world = view.world_from_camera.inverse();
  for (const World::Mover& mover : world.movers) {
    const Vector3d shift = mover.walker.at(t) - mover.walker.from;
    for (std::size_t i = mover.first; i < mover.first + mover.count; ++i) {
      const Face& face = world.scene.faces[i];
      if (face.normal.dot(view.world_from_camera.translation - shift - face.origin) <= 0.0) continue;

      cv::Rect reach({0, 0}, view.ids.size());
      std::vector<cv::Point> pixels;
      for (const Eigen::Vector2d& uv : face.polygon) {
        const Vector3d p = camera_from_world * (face.at(uv.x(), uv.y()) + shift);
        if (p.z() < 0.05) break;
        const Eigen::Vector2d pixel = view.camera.project(p);
        pixels.emplace_back(static_cast<int>(std::clamp(pixel.x(), -1e6, 1e6)),
                            static_cast<int>(std::clamp(pixel.y(), -1e6, 1e6)));
      }

      if (pixels.size() == face.polygon.size()) {  // else part of it is behind the camera: look everywhere
        cv::Rect box(pixels[0], cv::Size(1, 1));
        for (const cv::Point& p : pixels) box |= cv::Rect(p, cv::Size(1, 1));
        reach &= cv::Rect(box.x - 2, box.y - 2, box.width + 4, box.height + 4);
      }

      if (!reach.empty()) spots_.push_back({i, shift, reach});
    }
  }
}

void MovingFaces::draw(View& view) const {
  cv::Rect reach;
  for (const Spot& spot : spots_) reach |= spot.reach;
  for (int y = reach.y; y < reach.y + reach.height; ++y) {
    int* row = view.ids[y];
    for (int x = reach.x; x < reach.x + reach.width; ++x) {
      row[x] = in_front(view, row[x], static_cast<float>(x), static_cast<float>(y));
    }
  }
}

}  // namespace plumbline::synth
