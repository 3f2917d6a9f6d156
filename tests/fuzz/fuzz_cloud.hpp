// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What every reader of clouds must keep, whatever the bytes.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "fuzz_target.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"

namespace plumbline::fuzz {

/// Reads the input as a file with this ending, of which one byte can hold at most `points_per_byte` points.
inline void read_as_cloud(const std::uint8_t* data, std::size_t size, const char* ending,
                          std::size_t points_per_byte) {
  const InputFile file(data, size, ending);
  const MemoryWatch watch;
  const auto cloud = cloud::read_cloud(file.path());
  if (!cloud) {
    require_message(cloud.error().message, file.path().filename().string());
    check_memory(watch, size);
    return;
  }
  const cloud::Cloud& points = *cloud->cloud;
  const auto& others = cloud->columns.others;
  check_memory(watch, size + points.size() * (sizeof(cloud::Point) + others.size() * sizeof(float)));
  require(points.size() == std::size_t{points.width} * points.height, "width x height is the size");
  require(points.size() <= points_per_byte * size, "the file can hold its points");
  for (const std::size_t column :
       {cloud->columns.confidence.size(), cloud->columns.observations.size(), cloud->columns.robot.size()}) {
    require(column == 0 || column == points.size(), "columns are as long as the cloud");
  }
  for (const auto& other : others) {
    require(other.values.size() == points.size(), "columns are as long as the cloud");
  }
  const auto shifted = cloud::read_cloud(file.path(), cloud::LargeCoordinates::kShifted);
  require(shifted.has_value() && shifted->cloud->size() == points.size(),
          "digits that are kept change no count");
}

}  // namespace plumbline::fuzz
