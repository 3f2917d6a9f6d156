// SPDX-License-Identifier: BSD-3-Clause
// Trajectories of all formats.
#include <cmath>

#include "fuzz_target.hpp"
#include "plumbline/dataset/trajectory_io.hpp"

using namespace plumbline;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::InputFile file(data, size, ".txt");
  const fuzz::MemoryWatch watch;
  const auto reading = dataset::read_trajectory_file(file.path());
  fuzz::check_memory(watch, size);
  if (!reading) {
    fuzz::require_message(reading.error().message.substr(0, 50000), file.path().filename().string());
    return 0;
  }
  fuzz::require(reading->poses.size() <= reading->rows.size(), "no pose without a row");
  for (std::size_t i = 0; i < reading->poses.size(); ++i) {
    const geometry::StampedPose& pose = reading->poses[i];
    fuzz::require(std::isfinite(pose.stamp), "stamps are finite");
    fuzz::require(pose.world_from_camera.rotation.allFinite(), "rotations are finite");
    fuzz::require(i == 0 || reading->poses[i - 1].stamp <= pose.stamp, "poses are in the order of time");
  }
  return 0;
}
