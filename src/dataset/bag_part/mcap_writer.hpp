// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// MCAP files with chunks compressed by zstd, index and summary, as any program reads them.
#include "bags/bag_writer.hpp"

namespace plumbline::dataset {

std::unique_ptr<BagWriter> create_mcap(const std::filesystem::path& file, const std::string& made_by);

}  // namespace plumbline::dataset
