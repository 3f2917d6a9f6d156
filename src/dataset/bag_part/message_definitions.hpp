// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace plumbline::dataset {

/// The definition of one of the messages that are written, with those that it is made of, as MCAP's schemas
/// have it ("ros2msg"). `type`: "sensor_msgs/msg/Image".
std::string message_definition(const std::string& type);

}  // namespace plumbline::dataset
