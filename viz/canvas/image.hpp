// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pictures in memory and on disk.
#include <cstdint>
#include <filesystem>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::viz {

/// 8-bit RGB; rows run from the bottom to the top, as OpenGL has them.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Means of factor x factor pixels; width and height must be multiples of `factor`.
Image downsample(const Image& image, int factor);

/// Writes beside the file first and renames, so that no half picture is ever seen. Errors name the file.
core::Result<void> write_png(const Image& image, const std::filesystem::path& file);

}  // namespace plumbline::viz
