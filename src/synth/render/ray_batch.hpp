// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rays through the pixels of one picture, cast in packets. Private to the module.
#include "render/render.hpp"

namespace plumbline::synth {

/// Collects rays and casts them in packets.
class RayBatch {
 public:
  RayBatch(const World& world, const View& view) : world_(world) {
    const geometry::Rigid3& pose = view.world_from_camera;
    for (int k = 0; k < 3; ++k) {
      origin_[k] = static_cast<float>(pose.translation[k]);
      const double x = pose.rotation(k, 0) / view.camera.fx, y = pose.rotation(k, 1) / view.camera.fy;
      right_[k] = static_cast<float>(x);
      down_[k] = static_cast<float>(y);
      corner_[k] = static_cast<float>(pose.rotation(k, 2) - x * view.camera.cx - y * view.camera.cy);
    }
  }
  void add(float x, float y, int* target) {
    dx_[count_] = corner_[0] + x * right_[0] + y * down_[0];
    dy_[count_] = corner_[1] + x * right_[1] + y * down_[1];
    dz_[count_] = corner_[2] + x * right_[2] + y * down_[2];
    targets_[count_] = target;
    if (++count_ == World::kPacket) flush();
  }
  void flush() {
    if (count_ == 0) return;

    // Copies fill the packet.
    for (int k = count_; k < World::kPacket; ++k) {
      dx_[k] = dx_[0];
      dy_[k] = dy_[0];
      dz_[k] = dz_[0];
    }
    int faces[World::kPacket];
    world_.cast_packet(origin_, dx_, dy_, dz_, faces);
    for (int k = 0; k < count_; ++k) *targets_[k] = faces[k];
    count_ = 0;
  }

 private:
  const World& world_;
  float origin_[3], right_[3], down_[3], corner_[3];
  float dx_[World::kPacket], dy_[World::kPacket], dz_[World::kPacket];
  int* targets_[World::kPacket];
  int count_ = 0;
};

}  // namespace plumbline::synth
