// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "plumbline/core/error.hpp"

namespace plumbline::viz {

/// RGB, rows from the bottom to the top. The file appears whole or not at all; errors name it. May be called
/// from several threads at a time.
core::Result<void> write_png(const cv::Mat3b& picture, const std::filesystem::path& file);

}  // namespace plumbline::viz
