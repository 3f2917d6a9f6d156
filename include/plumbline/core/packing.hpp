// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Bytes packed by zstd.
#include <cstddef>
#include <cstdint>

#include "plumbline/core/archive.hpp"

namespace plumbline::core {

/// One zstd frame with checksum. Same bytes, same frame.
Bytes pack(const Bytes& bytes);
/// Throws BadBytes: truncated, damaged, or more than `most` bytes.
Bytes unpack(const std::uint8_t* bytes, std::size_t size, std::size_t most = std::size_t{1} << 30U);

}  // namespace plumbline::core
