// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::synth {

namespace {

constexpr const char* kPrefix = "synth:";

struct Parsed {
  std::string scene;
  SynthOptions options;
  int robot = -1;  ///< -1: not named
};

core::Result<Parsed> parse_url(const std::string& url) {
  if (!is_synth_url(url)) return core::usage_error(fmt::format("'{}' does not begin with synth:", url));
  Parsed parsed;
  const std::string body = url.substr(std::string(kPrefix).size());
  const auto question = body.find('?');
  parsed.scene = body.substr(0, question);
  if (parsed.scene.empty())
    return core::usage_error(fmt::format("'{}' names no scene (synth:SCENE?key=value&...)", url));

  // Read as a configuration, with its error messages.
  core::ConfigNode map;
  map.kind = core::ConfigNode::Kind::kMap;
  map.mark.file = url;

  // Pairs of key and value.
  std::string rest = question == std::string::npos ? "" : body.substr(question + 1);
  while (!rest.empty()) {
    const auto amp = rest.find('&');
    const std::string piece = rest.substr(0, amp);
    rest = amp == std::string::npos ? "" : rest.substr(amp + 1);
    const auto equals = piece.find('=');
    if (equals == std::string::npos)
      return core::usage_error(fmt::format("{}: '{}' is not key=value", url, piece));

    core::ConfigNode value;
    value.kind = core::ConfigNode::Kind::kScalar;
    value.scalar = piece.substr(equals + 1);
    value.mark = map.mark;
    map.entries.emplace_back(piece.substr(0, equals), value);
    map.key_marks.push_back(map.mark);
  }

  // Options of the generator, and the robot.
  core::OptionTable table;
  parsed.options.declare(table);
  table.integer("robot", parsed.robot, {0, 63}, "", "Which of the robots, from 0");

  core::ConfigProblems problems;
  table.set_all(map, "", problems);
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));

  // The robot's number implies at least as many.
  if (parsed.options.rig.empty() && parsed.robot >= parsed.options.robots)
    parsed.options.robots = parsed.robot + 1;
  return parsed;
}

}  // namespace

bool is_synth_url(const std::string& input) { return input.rfind(kPrefix, 0) == 0; }

core::Result<std::unique_ptr<dataset::FrameSource>> open_synth(const std::string& url,
                                                               const std::filesystem::path& scenes_folder,
                                                               const core::Executor& executor,
                                                               core::Log& log) {
  auto parsed = parse_url(url);
  if (!parsed) return tl::unexpected<core::Error>(parsed.error());
  auto scene = open_scene(parsed->scene, parsed->options, scenes_folder);
  if (!scene) return tl::unexpected<core::Error>(scene.error());
  auto world = build_world(*scene, parsed->options, executor);
  if (!world) return tl::unexpected<core::Error>(world.error());

  // Each robot is a recording.
  if (parsed->robot < 0 && parsed->options.robots > 1)
    log.warning(fmt::format("{}: robot 0 of {}; add &robot=1 for another", url, parsed->options.robots));
  auto source = SynthSource::create(*world, std::max(0, parsed->robot));
  if (!source) return tl::unexpected<core::Error>(source.error());
  log.debug(fmt::format("{}: {} frames, {} faces, {} lamps, {:.1f} m of path", (*source)->name(),
                        (*source)->size(), scene->faces.size(), scene->lamps.size(),
                        (*source)->path_length()));
  return std::unique_ptr<dataset::FrameSource>(std::move(*source));
}

}  // namespace plumbline::synth
