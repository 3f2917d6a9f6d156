// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Survey of a stream of messages, which is received for a moment and then treated like a bag.
#include <memory>
#include <string>
#include <vector>

#include "bags/topics.hpp"
#include "live/live_queue.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/message_stream.hpp"

namespace plumbline::dataset {

struct LiveMessage {
  std::string topic;
  std::int64_t received_ns = 0;
  SharedBytes bytes;
};

struct LiveSurvey {
  BagSurvey survey;
  std::vector<BagTopic> body;       ///< topics of wheels and inertial sensors that stay subscribed
  std::vector<LiveMessage> images;  ///< all received so far, in order, so that none is lost during the survey
};

/// Subscribes to all topics that could be a camera's until colour, depth and their calibration have arrived,
/// for at most `patience`; then unsubscribes from all but the chosen images and, if `with_body`, what tells
/// of the body. `named` as in choose_topics. Errors: those of choose_topics; kInput: no image arrived (names
/// the topics and types that were seen).
core::Result<LiveSurvey> survey_stream(const std::string& address, MessageStream& stream,
                                       const TopicNames& named, std::chrono::milliseconds patience,
                                       const core::StopToken& stop, bool with_body = false);

/// The published topics, one line each.
std::string published_text(const std::vector<StreamTopic>& topics);

}  // namespace plumbline::dataset
