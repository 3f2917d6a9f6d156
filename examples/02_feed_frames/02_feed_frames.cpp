// SPDX-License-Identifier: BSD-3-Clause
// Feeds frames one by one, here those of a camera that slides along a tiled wall, 2 m away: feed_frames
#include <cstdio>
#include <opencv2/core.hpp>

#include "plumbline/plumbline.hpp"

int main() {
  plumbline::sensor::Camera camera;
  camera.color = {320, 240, 260.0, 260.0, 159.5, 119.5};  // size, focal lengths and centre, pixels
  auto mapper = plumbline::Mapper::start(camera);         // without a folder: a temporary one

  // A wall of random tiles, 2 m away everywhere
  cv::Mat_<cv::Vec3b> tiles(40, 70), wall(240, 420);
  cv::randu(tiles, 0, 255);
  wall.forEach([&](cv::Vec3b& pixel, const int* at) { pixel = tiles(at[0] / 6, at[1] / 6); });
  const cv::Mat depth(wall.rows, camera.color.width, CV_32FC1, cv::Scalar(2.0));  // metres

  // The camera slides by two pixels from frame to frame
  for (int i = 0; mapper && i < 30; ++i) {
    const cv::Mat color = wall.colRange(2 * i, 2 * i + camera.color.width);
    const auto number = mapper->push({i / 30.0, {}, color, depth, {}});
    if (!number) return std::fprintf(stderr, "%s\n", number.error().message.c_str()), 1;
    const auto tracked = mapper->pose(**number, 10.0);
    if (tracked && tracked->world_from_camera)
      std::printf("%.3f m to the right\n", tracked->world_from_camera->translation.x());
  }

  const auto path =
      mapper.and_then([](auto& run) { return run.finish(); }).and_then([](auto map) { return map.path(); });
  if (!path) return std::fprintf(stderr, "%s\n", path.error().message.c_str()), 1;
  std::printf("%zu of 30 frames tracked\n", path->size());
}
