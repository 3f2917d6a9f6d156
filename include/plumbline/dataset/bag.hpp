// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// ROS bags: MCAP files, databases of rosbag2, folders of either, ROS 1's bags. open_recording reads them.
#include <filesystem>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

/// True if the path is a bag, by its content: a file of any of the kinds, or a folder of rosbag2 files that
/// is not laid out as a recording of another kind.
bool is_bag(const std::filesystem::path& path);

/// A few lines: kind, one line per topic (type, message count and rate, first and last time), damage, and the
/// topics that would be mapped with the reasons. Error (kInput): nothing can be read.
core::Result<std::string> bag_to_text(const std::filesystem::path& path, const TopicNames& named);

}  // namespace plumbline::dataset
