// SPDX-License-Identifier: BSD-3-Clause
#include "robots/camera_refinement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "plumbline/core/output_file.hpp"

namespace plumbline::pipeline {
namespace {

// Change of a number, in standard deviations, for which a map is made anew: a file that seems right is left
// alone; once it is known to be wrong, smaller changes follow.
constexpr double kLaterNews = 1.0;
constexpr double kGuessedFocalSigma = 0.01;  // a guess is confirmed when its focal length is known so well

const char* unit_of(const std::string& name) {
  if (name == "readout" || name == "depth_delay") return " s";
  return name == "fx" || name == "fy" || name == "cx" || name == "cy" ? " px" : "";
}

std::string found_text(const std::vector<mapping::CameraFinding>& findings) {
  std::string text;
  for (const mapping::CameraFinding& f : findings) {
    if (f.used)
      text += fmt::format("{}{} {:.5g} +- {:.2g}{} in place of {:.5g}", text.empty() ? "" : ", ", f.name,
                          f.found, f.sigma, unit_of(f.name), f.given);
  }
  return text;
}

/// Reason why the guessed camera must not be trusted; empty: the recording agrees with it.
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

Json section_of(const CameraReport& camera) {
  Json numbers = Json::array();
  for (const mapping::CameraFinding& f : camera.findings) {
    numbers.push_back({{"name", f.name},
                       {"given", f.given},
                       {"found", f.found},
                       {"sigma", f.sigma},
                       {"wrong", rounded(f.wrong)},
                       {"used", f.used}});
  }
  return {{"robot", camera.robot}, {"gain", rounded(camera.gain)},    {"numbers", numbers},
          {"asked", camera.asked}, {"from_frame", camera.from_frame}, {"note", camera.note},
          {"doubt", camera.doubt}};
}

CameraRefinement::CameraRefinement(const RobotInfo& robot) : robot_(robot), camera_(robot.camera) {
  report_.robot = robot.name;
}

bool CameraRefinement::ask(const maps::Map& map, const std::vector<maps::FramePose>& frames,
                           const core::Executor& executor, core::Log& log) {
  mapping::CalibrationOptions options;
  options.file = robot_.camera;
  if (robot_.camera.guess) {
    options.focal = {0.1, 0.1};
    options.centre_px = {20.0, 20.0};
  }

  const auto found =
      mapping::calibrate_camera({{&map, &frames, robot_.camera.color}}, camera_, options, executor);
  ++report_.asked;
  if (robot_.camera.guess) report_.doubt = doubt_of(found);

  if (!found) {
    if (report_.asked == 1) report_.note = found.error().message;
    log.debug(fmt::format("{}: the camera is as given: {}", robot_.name, found.error().message));
    return false;
  }

  for (const mapping::CameraFinding& f : found->findings)
    log.debug(fmt::format("{}: {} of {} views: given {:.5g}, found {:.5g} +- {:.2g}, wrong with {:.2f}",
                          robot_.name, f.name, found->views, f.given, f.found, f.sigma, f.wrong));
  report_.note.clear();

  const bool knows_less =
      2 * found->views < views_;  // than the question before: a second pass has fewer frames
  views_ = std::max(views_, found->views);
  const bool better = !knows_less && found->news >= (changed_ ? kLaterNews : mapping::kFileIsWrong);
  if (report_.asked > 1 && !better) return false;
  report_.findings = found->findings;
  report_.gain = found->gain;
  if (!better) {
    for (mapping::CameraFinding& f : report_.findings) f.used = false;
    return false;
  }

  changed_ = true;
  camera_ = found->camera;
  camera_.guess = false;
  log.info(fmt::format("{}: the camera is better with {}: the recording fits {:.1f} % better", robot_.name,
                       found_text(report_.findings), 100.0 * report_.gain));
  return true;
}

void CameraRefinement::restore(const sensor::Camera& camera, std::size_t from_frame) {
  camera_ = camera;
  changed_ = true;
  report_.findings = mapping::findings_between(robot_.camera, camera);
  report_.from_frame = from_frame;
  report_.note = "found before the run was interrupted";
}

core::Result<void> write_cameras(const std::filesystem::path& folder, const std::vector<RobotInfo>& robots,
                                 const std::vector<sensor::Camera>& cameras) {
  for (std::size_t r = 0; r < robots.size(); ++r) {
    const std::filesystem::path own = robots.size() == 1 ? folder : folder / "robots" / robots[r].name;
    std::error_code ignored;
    std::filesystem::create_directories(own, ignored);
    const std::string text = "# what the run used\n" + sensor::to_yaml(cameras[r]);
    if (auto ok = core::write_file(own / "camera.yaml", text); !ok) return ok;
  }
  return {};
}

}  // namespace plumbline::pipeline
