// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The choice of a bag's topics for colour, depth and their cameras, with the reasons.
#include <optional>
#include <string>

#include "bags/survey.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

struct ChosenTopic {
  const SurveyedTopic* topic = nullptr;  ///< null: there is none
  std::string why;
  std::string encoding;  ///< encoding of an image topic's first message
};

struct ChosenTopics {
  ChosenTopic color;
  ChosenTopic depth;
  ChosenTopic info;        ///< CameraInfo of colour
  ChosenTopic depth_info;  ///< CameraInfo of depth
};

/// Chooses the topics to map; names in `named` take precedence. Error (kUsage): a topic that does not exist
/// or is of another type; an ambiguous choice, with the candidates and the option. Error (kInput): no colour
/// or no depth.
core::Result<ChosenTopics> choose_topics(const BagSurvey& survey, const TopicNames& named);

/// A line for each of the chosen, with the reason.
std::string choice_text(const ChosenTopics& chosen);

}  // namespace plumbline::dataset
