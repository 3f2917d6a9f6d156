// SPDX-License-Identifier: BSD-3-Clause
// Maps a recording: map RECORDING [FOLDER]
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>

#include "plumbline/plumbline.hpp"

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const auto result = plumbline::map(argv[1], argc > 2 ? argv[2] : "");  // without a folder: a temporary one
  const auto cloud = result.and_then([](const auto& map) { return map.cloud(); });
  if (!cloud) return std::fprintf(stderr, "%s\n", cloud.error().message.c_str()), 1;

  const auto path = result->path();
  std::printf("%s\n%zu points, %zu poses\n", result->verdict().sentence.c_str(), cloud->cloud->size(),
              path->size());
}
