// SPDX-License-Identifier: BSD-3-Clause
// What recordings hold beside images: calibrations of Azure Kinects, arrays of NumPy.
#include <cmath>

#include "fuzz_target.hpp"
#include "images/azure_kinect.hpp"
#include "images/image_decoders.hpp"

using namespace plumbline;

namespace {

void try_calibration(const std::string& text) {
  const auto camera = dataset::azure_kinect_camera(text, "NFOV_UNBINNED", 1080);
  if (!camera) {
    fuzz::require(!camera.error().message.empty(), "an error has a message");
    return;
  }
  fuzz::require(std::isfinite(camera->color.fx) && std::isfinite(camera->depth->cy), "numbers are finite");
  for (const double k : camera->distortion) fuzz::require(std::isfinite(k), "coefficients are finite");
  fuzz::require(camera->color_from_depth->rotation.allFinite(), "the rotation is finite");
  const auto ray = camera->depth_lens.ray_of({0.3, 0.2});
  fuzz::require(!ray || ray->allFinite(), "rays are finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::MemoryWatch watch;
  const dataset::Bytes bytes(data, data + size);
  if (dataset::is_npy(bytes)) {
    const auto image = dataset::decode_npy(bytes);
    if (!image) fuzz::require(!image.error().empty(), "an error has a message");
    if (image) fuzz::require(image->total() * image->elemSize() <= size, "no more numbers than there are");
  } else {
    try_calibration(std::string(bytes.begin(), bytes.end()));
  }
  fuzz::check_memory(watch, size);
  return 0;
}
