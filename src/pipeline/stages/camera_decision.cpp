// SPDX-License-Identifier: BSD-3-Clause
#include "stages/camera_decision.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include "plumbline/core/hash.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::pipeline {
namespace {

constexpr double kLeastGain = 0.01;  // of a number that may well be right
constexpr int kMostAsked = 2;        // what a wrong camera has bent shows in a map made with a better one
constexpr double kGuessedFocalSigma = 0.01;  // a guess is confirmed when its focal length is known so well

/// The first line of a camera.yaml: what it was made of.
std::string made_of(const sensor::Camera& given) {
  core::Hash hash;
  const std::string text = sensor::to_yaml(given);
  hash.bytes(text.data(), text.size());
  return fmt::format("# what the run used; was given: {:016x}", hash.value());
}

std::string found_text(const std::vector<mapping::CameraFinding>& findings) {
  std::string text;
  for (const mapping::CameraFinding& f : findings) {
    if (f.used)
      text += fmt::format("{}{} {:.5g} +- {:.2g} in place of {:.5g}", text.empty() ? "" : ", ", f.name,
                          f.found, f.sigma, f.given);
  }
  return text;
}

/// Why typical values in the place of a camera file are no camera; empty: the recording agrees.
std::string doubt_of(const core::Result<mapping::CameraCalibration>& found) {
  const std::string doubt = "no camera file was given, and the recording cannot confirm the guessed camera: ";
  if (!found) return doubt + found.error().message;
  const auto& findings = found->findings;
  const auto fx =
      std::find_if(findings.begin(), findings.end(), [](const auto& f) { return f.name == "fx"; });
  if (fx->sigma < kGuessedFocalSigma * fx->given) return "";
  return fmt::format("{}fx is known to {:.1f} px only, {:.1f} px are needed", doubt, fx->sigma,
                     kGuessedFocalSigma * fx->given);
}

}  // namespace

/// What an earlier question found stays, and all is told against what was given at first.
static void keep_earlier(const std::vector<mapping::CameraFinding>& earlier,
                         std::vector<mapping::CameraFinding>& findings) {
  for (std::size_t i = 0; i < earlier.size(); ++i) {
    mapping::CameraFinding& f = findings[i];
    if (!f.used && earlier[i].used) f.found = f.given;
    if (earlier[i].used) f.gain = earlier[i].gain;
    f.used = f.used || earlier[i].used;
    f.given = earlier[i].given;
  }
}

void CameraDecision::ask(const RobotInfo& robot, const mapping::CalibrationRun& run,
                         const core::Executor& executor, core::Log& log) {
  const auto number = static_cast<std::size_t>(robot.number);
  const bool guess = asked > 0 ? given[number].guess : robot.camera.guess;
  used.resize(std::max(used.size(), number + 1), robot.camera);
  said.resize(used.size());
  news.resize(used.size());
  mapping::CalibrationOptions options;
  options.earlier = said[number].findings;
  options.least_gain = kLeastGain;
  if (guess) {
    options.focal_prior = 0.1;
    options.centre_prior_px = 20.0;
  }
  const auto found = mapping::calibrate_camera({run}, robot.camera, options, executor);
  RunSummary::Camera& camera = said[number];
  camera.robot = robot.name;
  camera.asked = asked + 1;
  if (guess) camera.doubt = doubt_of(found);
  if (!found) {
    if (asked == 0) camera.note = found.error().message;
    log.debug(fmt::format("{}: the camera is as given: {}", robot.name, found.error().message));
    return;
  }
  const bool better = !found_text(found->findings).empty();
  if (asked > 0 && !better) return;
  camera.findings = found->findings;
  keep_earlier(options.earlier, camera.findings);
  camera.gain = 1.0 - (1.0 - camera.gain) * (1.0 - found->gain);
  if (!better) return;
  news[number] = found_text(camera.findings);
  used[number] = found->camera;
  used[number].guess = false;
}

core::Result<void> CameraDecision::settle(const RunContext& context, std::optional<std::size_t> live) {
  if (std::exchange(made, true)) return {};
  const bool late = live == std::size_t{0};
  asked += said.empty() ? 0 : 1;
  for (std::size_t r = 0; r < news.size(); ++r) {
    RunSummary::Camera& camera = said[r];
    const std::string text = std::exchange(news[r], "");
    if (text.empty()) continue;
    context.log->info(fmt::format(
        "{}: the camera is better with {}: held-out parts of the recording fit {:.1f} % better; {}",
        camera.robot, text, 100.0 * camera.gain,
        late   ? "too late to go on with it"
        : live ? fmt::format("going on with it from frame {}", *live)
               : "beginning again with it"));
    again = again || !live;
    if (live) camera.from_frame = from = *live;
    if (!late) continue;
    camera.note = "found when the recording was over";
    for (mapping::CameraFinding& f : camera.findings) f.used = false;
  }
  made = !again || asked >= kMostAsked;
  if (again) return core::failure(core::ErrorKind::kInternal, "the run begins again with a better camera");
  if (from > 0) context.recordings->correct(from, used);
  return write_cameras(context.output_folder, *context.recordings, *this);
}

/// OUT/camera.yaml, or that of one of several robots.
static std::filesystem::path camera_file(const std::filesystem::path& folder,
                                         const RobotRecordings& recordings, std::int32_t robot) {
  if (recordings.robots().size() == 1) return folder / "camera.yaml";
  return folder / "robots" / recordings.robot(robot).name / "camera.yaml";
}

core::Result<void> write_cameras(const std::filesystem::path& folder, const RobotRecordings& recordings,
                                 const CameraDecision& decision) {
  for (const RobotInfo& robot : recordings.robots()) {
    const std::filesystem::path file = camera_file(folder, recordings, robot.number);
    std::error_code ignored;
    std::filesystem::create_directories(file.parent_path(), ignored);
    const auto number = static_cast<std::size_t>(robot.number);
    std::string text = made_of(decision.given[number]) + "\n";
    if (!decision.said.empty()) text += "# " + camera_json(decision.said[number]) + "\n";
    const sensor::Camera& camera = decision.from > 0 ? decision.used[number] : robot.camera;
    if (auto ok = core::write_file(file, text + sensor::to_yaml(camera)); !ok) return ok;
  }
  return {};
}

void CameraDecision::restore(const std::filesystem::path& folder, const RobotRecordings& recordings) {
  CameraDecision found;
  for (const RobotInfo& robot : recordings.robots()) {
    const std::filesystem::path file = camera_file(folder, recordings, robot.number);
    std::ifstream in(file);
    std::string first;
    std::string told;
    std::getline(in, first);
    std::getline(in, told);
    const auto camera = sensor::read_camera(file);
    if (first != made_of(robot.camera) || !camera) return;
    found.used.push_back(*camera);
    found.used.back().guess = robot.camera.guess && sensor::to_yaml(*camera) == sensor::to_yaml(robot.camera);
    if (auto camera_said = camera_from_json(told.substr(0, 2) == "# " ? told.substr(2) : "")) {
      found.from = std::max(found.from, camera_said->from_frame);
      found.asked = camera_said->asked;
      found.said.push_back(std::move(*camera_said));
    }
  }
  used = std::move(found.used);
  said = std::move(found.said);
  from = found.from;
  asked = found.asked;
  const auto better = [](const RunSummary::Camera& c) { return !found_text(c.findings).empty(); };
  made = asked != 1 || from > 0 || std::none_of(said.begin(), said.end(), better);
}

}  // namespace plumbline::pipeline
