// SPDX-License-Identifier: BSD-3-Clause
// The PLY reader.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "fuzz_target.hpp"
#include "plumbline/cloud/cloud_io.hpp"

using namespace plumbline;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::InputFile file(data, size, ".ply");
  const fuzz::MemoryWatch watch;
  const auto cloud = cloud::read_cloud(file.path());
  if (!cloud) {
    fuzz::require_message(cloud.error().message, file.path().filename().string());
    fuzz::check_memory(watch, size);
    return 0;
  }
  const cloud::Cloud& points = *cloud->cloud;
  fuzz::check_memory(watch, size + points.size() * sizeof(cloud::Point));
  fuzz::require(points.size() == std::size_t{points.width} * points.height, "width x height is the size");
  fuzz::require(points.size() <= size, "the file can hold its points");
  for (const std::size_t column :
       {cloud->columns.confidence.size(), cloud->columns.observations.size(), cloud->columns.robot.size()}) {
    fuzz::require(column == 0 || column == points.size(), "columns are as long as the cloud");
  }
  return 0;
}
