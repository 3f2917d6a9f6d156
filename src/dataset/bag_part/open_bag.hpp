// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bags/bag_file.hpp"

namespace plumbline::dataset {

/// An MCAP file, a database of rosbag2, either also compressed by zstd, or a bag of ROS 1; recognised by
/// content. Error (kInput).
OpenedBag open_bag_file(const std::filesystem::path& file);

}  // namespace plumbline::dataset
