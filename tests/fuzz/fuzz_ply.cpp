// SPDX-License-Identifier: BSD-3-Clause
// The PLY reader.
#include "fuzz_cloud.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  plumbline::fuzz::read_as_cloud(data, size, ".ply", 1);
  return 0;
}
