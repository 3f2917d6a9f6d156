// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// CycloneDDS as ROS 2 uses it, in the part plumbline_ros2.so (core/part.hpp).
#include <memory>

#include "plumbline/core/part.hpp"
#include "plumbline/dataset/message_stream.hpp"
#include "plumbline/net/options.hpp"

namespace plumbline::net {

struct Ros2Part {
  static constexpr const char* kPart = "ros2";
  static constexpr std::uint64_t layout() {
    return core::layout_of<Ros2Part, NetworkOptions, dataset::StreamTopic, dataset::StreamMessage>();
  }

  core::Result<std::unique_ptr<dataset::MessageStream>> (*open_stream)(const NetworkOptions& options);
  core::Result<std::unique_ptr<dataset::MessageSink>> (*open_sink)(const NetworkOptions& options);
};

}  // namespace plumbline::net
