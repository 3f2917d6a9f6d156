// SPDX-License-Identifier: BSD-3-Clause
// Camera files of all programs: the first byte chooses the ending.
#include "fuzz_target.hpp"
#include "plumbline/sensor/camera_file.hpp"

using namespace plumbline;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::InputFile file(data, size, size > 0 && data[0] == '{' ? ".json" : ".txt");
  const fuzz::MemoryWatch watch;
  const auto reading = sensor::read_camera_file(file.path());
  fuzz::check_memory(watch, size);
  if (!reading) {
    fuzz::require_message(reading.error().message.substr(0, 50000), file.path().filename().string());
    return 0;
  }
  sensor::Camera camera = reading->camera;
  if (!reading->has_size) return 0;
  if (camera.depth && camera.depth->width == 0) camera.depth->width = camera.depth->height = 1;
  fuzz::require(sensor::camera_problem(camera).empty(), "what is accepted is a camera");
  return 0;
}
