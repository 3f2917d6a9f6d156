// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A sequence of pictures as a film, by ffmpeg where that is installed.
#include <filesystem>

#include "plumbline/core/error.hpp"

namespace plumbline::cli {

/// True if the file is a film by its name: .gif or .mp4.
bool is_film(const std::filesystem::path& file);

/// "" or why films cannot be made here.
core::Result<void> can_film();

/// folder/0000.png ... as `file`, replaced if it is there. Errors (kOutput).
core::Result<void> make_film(const std::filesystem::path& folder, int pictures_per_s,
                             const std::filesystem::path& file);

}  // namespace plumbline::cli
