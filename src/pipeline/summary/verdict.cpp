// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "plumbline/check/self_check.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

bool is_of_coverage(const Doubt& doubt) {
  return doubt.about == Doubt::About::kLostFrames || doubt.about == Doubt::About::kComponents ||
         doubt.about == Doubt::About::kUnconnectedMaps;
}

/// The gravest doubt: a mistake made with the recording comes first, as the cause of others; lost frames are
/// reported together with components that stayed apart.
std::string gravest(std::vector<Doubt>& doubts) {
  if (doubts.empty()) return {};
  const auto rank = [](const Doubt& doubt) {
    return doubt.about == Doubt::About::kRecording ? -1 : static_cast<int>(doubt.about);
  };
  std::stable_sort(doubts.begin(), doubts.end(),
                   [&](const Doubt& x, const Doubt& y) { return rank(x) < rank(y); });

  std::string reason = doubts.front().text;
  const auto apart = std::find_if(doubts.begin(), doubts.end(), [](const Doubt& doubt) {
    return doubt.about == Doubt::About::kComponents;
  });
  if (doubts.front().about == Doubt::About::kLostFrames && apart != doubts.end())
    reason += "; " + apart->text;
  return reason;
}

std::vector<std::string> unchecked_of(const Json& summary) {
  std::vector<std::string> all;
  const auto add = [&](const Json& list) {
    for (const Json& one : list) {
      const auto text = one.get<std::string>();
      if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(text);
    }
  };
  add(summary.at("unchecked"));
  if (summary.contains("check"))
    add(summary.at("check").at("unchecked"));
  else
    add(Json::array({"scale", "shape"}));
  return all;
}

std::string told(const Json& summary) {
  const Json& verdict = summary.at("verdict");
  const std::string reason = reason_of(summary);
  if (!reason.empty()) return fmt::format("Not trustworthy: {}.", reason);
  const auto unchecked = verdict.at("unchecked").get<std::vector<std::string>>();
  const Json& accuracy = verdict.at("accuracy");
  if (accuracy.at("expected_m").is_null()) return check::shape_sentence({}, unchecked);
  return check::shape_sentence(
      check::Shape{accuracy.at("expected_m"), accuracy.at("p95_m"), accuracy.at("lengths")}, unchecked);
}

}  // namespace

void set_verdict(std::vector<Doubt> doubts, Json& summary) {
  const std::string reason = gravest(doubts);
  summary["trustworthy"] = reason.empty();
  summary["reason"] = reason;

  if (!summary.contains("components")) return;  // no map was made: a camera was located in one

  Json shape = Json::array(), coverage = Json::array();
  for (const Doubt& doubt : doubts) (is_of_coverage(doubt) ? coverage : shape).push_back(doubt.text);
  const bool trusted = shape.empty();

  const Json* check =
      summary.contains("check") && summary.at("check").at("pairs") > 0 ? &summary.at("check") : nullptr;
  const auto number = [&](const char* name) { return check != nullptr ? check->at(name) : Json(); };

  // Parts of the map, and time in which nothing could be seen.
  const Json& list = summary.at("components").at("list");
  const auto apart =
      std::count_if(list.begin(), list.end(), [](const Json& c) { return !c.at("joined").get<bool>(); });
  const Json& frames = summary.at("frames");

  const double period_s = frames.at("period_s"), lost = frames.at("lost"), blind = frames.at("blind");
  const double tracked = frames.at("tracked"), seen = frames.at("read").get<double>() - blind;

  Json& verdict = summary["verdict"];
  verdict = {{"sentence", ""},
             {"accuracy",
              {{"expected_m", number("expected_m")},
               {"p95_m", number("p95_m")},
               {"lengths", number("lengths")},
               {"trusted", trusted},
               {"reasons", std::move(shape)}}},
             {"coverage",
              {{"tracked", rounded(seen > 0.0 ? tracked / seen : 0.0)},
               {"blind_s", rounded(blind * period_s)},
               {"lost_s", rounded((lost - blind) * period_s)},
               {"components", apart + 1},
               {"reasons", std::move(coverage)}}},
             {"unchecked", unchecked_of(summary)}};

  verdict["sentence"] = told(summary);
}

void add_to_verdict(const std::string& doubt, Json& summary) {
  if (doubt.empty()) return;
  const std::string before = reason_of(summary);
  summary["trustworthy"] = false;
  summary["reason"] = before.empty() ? doubt : before + "; " + doubt;
  if (!summary.contains("verdict")) return;
  summary["verdict"]["coverage"]["reasons"].push_back(doubt);
  summary["verdict"]["sentence"] = told(summary);
}

std::string reason_of(const Json& summary) { return summary.value("reason", std::string()); }

std::string sentence_of(const Json& summary) {
  return summary.contains("verdict") ? summary.at("verdict").value("sentence", std::string()) : std::string();
}

}  // namespace plumbline::pipeline
