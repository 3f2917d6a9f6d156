// SPDX-License-Identifier: BSD-3-Clause
// plumbline map INPUT -o OUT
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app.hpp"
#include "live_page.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/pipeline/map_recording.hpp"
#include "terminal/print.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

/// "83 of 400 frames" for the result of a run that Ctrl-C ended; "" for others.
std::string stopped_after(const std::filesystem::path& result) {
  const auto summary = core::read_json(result / "summary.json");
  if (!summary || !summary->is_object() || summary->value("stopped", nlohmann::ordered_json()) != true)
    return "";
  const auto count = [&](const char* name) {
    const nlohmann::ordered_json::json_pointer place(name);
    return summary->contains(place) ? core::json_text(summary->at(place), -1) : std::string("?");
  };
  return fmt::format("{} of {} frames", count("/frames/read"), count("/frames/available"));
}

int map(Session& session, pipeline::MapRequest request, const std::vector<std::string>& inputs,
        PublishRequest publish, const PageAddress& page) {
  // Given poses need another pipeline
  const bool as_given = request.open.poses == dataset::PoseUse::kGiven;
  if (as_given && request.pipeline == pipeline::MapRequest().pipeline) request.pipeline = "known_poses";
  request.input = inputs.front();
  request.others.assign(inputs.begin() + 1, inputs.end());

  if (auto equipped = session.equip(request); !equipped) return session.fail(equipped.error());

  // A finished run is not continued
  const auto finished = request.resume ? pipeline::is_finished(request.output, request.replace) : false;
  if (!finished) return session.fail(finished.error());
  if (*finished) {
    if (const std::string stopped = stopped_after(request.output); !stopped.empty()) {
      return session.fail({core::ErrorKind::kUsage,
                           fmt::format("{}: was stopped after {} and cannot be continued; leave out --resume "
                                       "and add --force to map again",
                                       request.output.string(), stopped)});
    }

    // Nothing to do is not an error
    if (!session.quiet) {
      print(
          "{}: is finished; there is nothing to continue; to map again, with other options too, leave "
          "out --resume and add --force\n",
          request.output.string());
    }
    return 0;
  }

  // Live cameras and publication
  prepare_live(request);
  publish.robots = inputs.size();
  if (auto prepared = prepare_publisher(session, publish, net::PublishedNames::kOfOne, "", request);
      !prepared)
    return session.fail(prepared.error());

  // The map while it grows
  Console& console = session.console();
  const auto live =
      live_map(page, request.into.empty() ? request.output : pipeline::visit_folder(request.output), console);
  if (!live) return session.fail(live.error());

  // From recording to result
  const auto summary = pipeline::map_recording(request, session.executor(), console, stop_on_signals(),
                                               console.counting("frames"));
  return session.finish(summary, request.output);
}

}  // namespace

void add_recording_options(CLI::App& command, pipeline::MapRequest& request) {
  command.add_option("--camera", request.open.camera, "Shipped calibration or file")->type_name("NAME|FILE");
  command.add_option("--format", request.open.format, "Layout of INPUT (default: auto)")
      ->check(CLI::IsMember(dataset::layout_names()));

  // The part of the recording.
  add_topic_option(command, request.open);
  add_time_range(command, request.open);
  command.add_option("--every", request.open.every, "Use every N-th frame")
      ->type_name("N")
      ->check(CLI::Range(1, 100000));
  command
      .add_option("--pace", request.pace_hz,
                  "Play recordings at this rate, like a live camera (default: as fast as possible)")
      ->type_name("HZ")
      ->check(CLI::Range(0.0, 1000.0));
  add_live_options(command, request);
}

void add_rig_option(CLI::App& command, std::filesystem::path& rig) {
  command
      .add_option(
          "--rig", rig,
          "YAML file with the cameras of one robot, by the names of their recordings or maps: they are "
          "joined by their poses on it, given or found from their motion")
      ->type_name("FILE");
}

/// Options that map and robot share.
void add_map_options(CLI::App& command, Session& session, pipeline::MapRequest& request) {
  add_recording_options(command, request);
  const std::map<std::string, dataset::PoseUse> uses = {{"prior", dataset::PoseUse::kPrior},
                                                        {"given", dataset::PoseUse::kGiven},
                                                        {"ignore", dataset::PoseUse::kIgnore}};
  command
      .add_option("--poses", request.open.poses,
                  "Poses that come with a recording: prior lets a phone's odometry start each frame's search "
                  "(default), given maps with the recording's poses as they are, ignore leaves them out")
      ->type_name("prior|given|ignore")
      ->transform(one_of(uses));
  command.add_flag("--resume", request.resume,
                   "Continue an interrupted run from OUT.partial, with the same input and settings");
  add_pipeline_options(command, session, request);
}

void add_map(CLI::App& app, Session& session) {
  // Shared by the command and its options
  const auto request = std::make_shared<pipeline::MapRequest>();
  const auto inputs = std::make_shared<std::vector<std::string>>();
  const auto publish = std::make_shared<PublishRequest>();
  const auto page = std::make_shared<PageAddress>();
  const auto poses_are = std::make_shared<std::string>();

  // Conventions of poses become options of stages
  CLI::App* command =
      add_command(app, session, "map", "Map a recording: trajectory, dense cloud, pictures",
                  [&session, request, inputs, publish, page, poses_are] {
                    if (!poses_are->empty()) {
                      const bool given = request->open.poses == dataset::PoseUse::kGiven;
                      request->overrides.push_back((given ? "poses.are=" : "read.poses_are=") + *poses_are);
                    }
                    return map(session, *request, *inputs, *publish, *page);
                  });

  // Input and output
  command
      ->add_option(
          "INPUT", *inputs,
          "A recording (docs/guide/inputs.md), ros2://DOMAIN for a live camera, or "
          "synth:SCENE?frames=900&texture=none&seed=3; give several recordings, one per robot, to fuse "
          "them into one map")
      ->required();
  command->add_option("-o,--output", request->output, "Folder for the result")->required()->type_name("OUT");

  // Conventions of given poses
  command
      ->add_option(
          "--poses-are", *poses_are,
          "Convention of the poses that come with a recording: inverted (camera from world), opengl (y up, z "
          "backwards), wxyz (quaternions begin with w)")
      ->check(CLI::IsMember({"inverted", "opengl", "wxyz"}));

  // A map that exists already
  command
      ->add_option(
          "--into", request->into,
          "Another visit of this map (result folder or map.db), which stays as it is: OUT holds both, in "
          "its frame, without what is gone")
      ->type_name("MAP");

  // Cameras of one robot
  add_rig_option(*command, request->rig);

  // Display, pipeline and debugging
  add_frames_options(*command, *publish);
  add_map_options(*command, session, *request);
  add_live_options(*command, *page);
  command
      ->add_option("--debug-video", request->debug_video,
                   "Also write a picture of every frame with what the tracker sees")
      ->type_name("DIR");
}

}  // namespace plumbline::cli
