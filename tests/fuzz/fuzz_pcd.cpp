// SPDX-License-Identifier: BSD-3-Clause
// The PCD reader.
#include "fuzz_cloud.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // LZF makes at most 88 bytes of one.
  plumbline::fuzz::read_as_cloud(data, size, ".pcd", 88);
  return 0;
}
