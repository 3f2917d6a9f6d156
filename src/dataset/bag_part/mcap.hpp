// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// MCAP files, read in sequence: index and summary, which many files lack, are not needed.
#include "bags/bag_file.hpp"

namespace plumbline::dataset {

bool is_mcap(const std::filesystem::path& file);

/// `shown`: name of the file in messages. Error (kInput): cannot be read, or is not MCAP.
OpenedBag open_mcap(const std::filesystem::path& file, const std::string& shown);

}  // namespace plumbline::dataset
