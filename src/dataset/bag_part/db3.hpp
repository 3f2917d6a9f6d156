// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The bags of rosbag2 before MCAP: SQLite databases with the tables `topics` and `messages`.
#include "bags/bag_file.hpp"

namespace plumbline::dataset {

/// `shown`: name of the file in messages. What a recorder that was killed left in FILE-wal is read too.
/// Error (kInput): no database, or not of rosbag2.
OpenedBag open_db3(const std::filesystem::path& file, const std::string& shown);

}  // namespace plumbline::dataset
