// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// ROS 1's bags (format 2.0), read in sequence: an index, which cut bags and ".active" ones lack, is not
// needed.
#include "bags/bag_file.hpp"

namespace plumbline::dataset {

/// `shown`: name of the file in messages. Error (kInput): cannot be read, of an older format, encrypted.
OpenedBag open_ros1_bag(const std::filesystem::path& file, const std::string& shown);

}  // namespace plumbline::dataset
