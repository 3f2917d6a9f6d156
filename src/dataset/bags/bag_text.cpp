// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "bags/survey.hpp"
#include "bags/topics.hpp"

namespace plumbline::dataset {
namespace {

double seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

/// Rate and time span are left out if they are unknown.
std::string topic_line(const SurveyedTopic& topic) {
  std::string line = fmt::format("topic: {} {}, {} messages", topic.topic.name,
                                 topic.topic.type.empty() ? "of no type" : topic.topic.type, topic.count);
  if (topic.rate() > 0.0) line += fmt::format(", {:.1f} a second", topic.rate());
  if (topic.count > 0)
    line += fmt::format(", {:.6f} to {:.6f}", seconds(topic.first_ns), seconds(topic.last_ns));
  if (topic.decoder == nullptr) line += fmt::format(", in {}: not read", topic.topic.encoding);
  return line + "\n";
}

std::string choice_line(const char* what, const ChosenTopic& chosen) {
  if (chosen.topic == nullptr) return "";
  const std::string encoding = chosen.encoding.empty() ? "" : fmt::format(" ({})", chosen.encoding);
  return fmt::format("{}: {}{}, {}\n", what, chosen.topic->topic.name, encoding, chosen.why);
}

}  // namespace

std::string choice_text(const ChosenTopics& chosen) {
  return choice_line("colour", chosen.color) + choice_line("depth", chosen.depth) +
         choice_line("camera of colour", chosen.info) + choice_line("camera of depth", chosen.depth_info);
}

core::Result<std::string> bag_to_text(const std::filesystem::path& path, const TopicNames& named) {
  const auto survey = survey_bag(path);
  if (!survey) return tl::unexpected(survey.error());
  std::string text =
      fmt::format("bag: {} ({}{})\n", survey->path, survey->kind,
                  survey->files.size() > 1 ? fmt::format(", {} files", survey->files.size()) : "");
  for (const SurveyedTopic& topic : survey->topics) text += topic_line(topic);
  for (const std::string& note : survey->notes) text += "damaged: " + note + "\n";

  // Without a choice the topics are still listed
  const auto chosen = choose_topics(*survey, named);
  if (!chosen) return text;  // opening it reports the reason
  return text + choice_text(*chosen);
}

}  // namespace plumbline::dataset
