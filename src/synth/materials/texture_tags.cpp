// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <opencv2/imgproc.hpp>

#include "materials/texture_draw.hpp"

namespace plumbline::synth {

namespace {
/// The first numbers of the family 36h11: 6 x 6 cells, row by row from the upper left one, the first is the
/// highest bit; 1 = white. As published with AprilTag, in the orientation of OpenCV's DICT_APRILTAG_36h11.
constexpr std::array<std::uint64_t, 60> kCodes = {
    0x21a146bab, 0x92d18fe9b, 0x7089014bb, 0x193979e27, 0x44153d3d7, 0x35cd5b8cf, 0xa10ba56a0, 0x2b874a608,
    0xb57fb8d44, 0x4e20b5a64, 0x61d897f2c, 0xab3469ffc, 0x594ca45c2, 0xfa1c2d2e2, 0x97c24b972, 0x75928624a,
    0x1caafe99a, 0x3236ddc16, 0x884e527d6, 0x5771a8c7e, 0xf52925b81, 0x2e59cc1a1, 0x7fa58ab31, 0xeb43384f9,
    0x3913d5345, 0xd79b1a3b5, 0x0dfbe768d, 0x5cd7a031d, 0xb9c8f7a4b, 0x46987e06b, 0x6e0c5d527, 0x5bc567bb4,
    0x1e6302bc2, 0x8ac7d046a, 0xa65fe2326, 0x5400eb616, 0xf7a066836, 0x2dd0afdf6, 0x3b9cb60b1, 0xad6a1caf9,
    0x93b62efb5, 0xbb210d93d, 0xdee55094b, 0xa0cd1479b, 0x2a23abb27, 0x4f67f4b5f, 0x58a815818, 0x743427d64,
    0x1dec40874, 0x892ab3a02, 0x38d5742ee, 0x0c43567a1, 0x5db311cb1, 0xc957ca1f9, 0xa22457823, 0x29ace98f3,
    0xccc52c528, 0xda8b3578c, 0xd5b4b9e36, 0xac9cdd3ce,
};
}  // namespace

Canvas draw_tag(const Material&, cv::Size size, std::uint64_t seed) {
  constexpr int kCells = 10;  // 6 of the code, then a black and a white border
  constexpr float kBlack = 0.03F, kWhite = 0.85F;
  const std::uint64_t code = kCodes[seed % kCodes.size()];
  Canvas cells(kCells, kCells);

  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      const bool margin = x == 0 || y == 0 || x == kCells - 1 || y == kCells - 1;
      const bool inside = x > 1 && y > 1 && x < kCells - 2 && y < kCells - 2;
      const bool white = margin || (inside && ((code >> (35 - 6 * (y - 2) - (x - 2))) & 1U) != 0);
      cells(y, x) = cv::Vec3f::all(white ? kWhite : kBlack);
    }
  }

  Canvas canvas;
  cv::resize(cells, canvas, size, 0, 0, cv::INTER_NEAREST);
  return canvas;
}

}  // namespace plumbline::synth
