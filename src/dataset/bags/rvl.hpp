// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// RVL, a quick lossless compression of depth: Wilson, "Fast lossless depth image compression", ISS 2017.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace plumbline::dataset {

/// Decodes `pixels` depths from `size` bytes; none if there are not that many.
std::optional<std::vector<std::uint16_t>> decode_rvl(const std::uint8_t* data, std::size_t size,
                                                     std::size_t pixels);

}  // namespace plumbline::dataset
