// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A camera that is filming while its frames are read.
#include <filesystem>
#include <memory>
#include <string>

#include "plumbline/dataset/live_frame_source.hpp"
#include "plumbline/dataset/message_stream.hpp"

namespace plumbline::dataset {

/// True if an input is the address of a live source ("ros2://0"), not a path.
bool is_live_address(const std::string& input);

/// Finds the topics and the camera as in a bag (OpenOptions::topics over what is found), takes messages in a
/// separate thread, and pairs them by stamp. Frames that arrive while LiveOptions::most_waiting_bytes of
/// others wait are dropped before they get a number, as are those whose stamp is not later than the last
/// one's; both are counted and reported. The source ends when LiveOptions::stop says so or its time is over.
/// Errors: kInput (no camera
/// within LiveOptions::patience: topics and types that were seen are named; no camera calibration),
/// kUsage (options that make no sense for what is live; topics that are not certain), kOutput (the record).
core::Result<std::unique_ptr<LiveFrameSource>> open_live(const std::string& address,
                                                         std::unique_ptr<MessageStream> stream,
                                                         const OpenOptions& options, core::Log& log);

/// A few lines for people: what is published, and what open_live would take and why.
core::Result<std::string> live_to_text(const std::string& address, MessageStream& stream,
                                       const OpenOptions& options);

}  // namespace plumbline::dataset
