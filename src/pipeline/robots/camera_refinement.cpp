// SPDX-License-Identifier: BSD-3-Clause
#include "robots/camera_refinement.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
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

/// The findings of an estimate, relative to the camera's file; none before the first one.
std::vector<mapping::CameraFinding> findings_of(const sensor::Camera& file,
                                                const maps::CameraEstimate& known) {
  if (known.views == 0 && !known.better) return {};
  optimize::CameraPosterior posterior;
  posterior.covariance = known.covariance;
  posterior.wrong = known.wrong;
  auto findings = mapping::findings_of(file, known.found, posterior);
  for (mapping::CameraFinding& f : findings) f.used = f.used && known.better;
  return findings;
}

bool is_known(const RobotInfo& robot) {
  return robot.estimate && robot.estimate->covariance.diagonal().minCoeff() > 0.0;
}

/// Two cameras are the same one unless the chance of such a difference is below 1 %.
Json pair_of(const RobotInfo& a, const RobotInfo& b) {
  constexpr std::array<const char*, optimize::kCameraUnknowns> kNames{
      "fx", "readout", "depth_slope x", "depth_slope y", "cx", "cy", "k1", "k2", "depth_delay"};
  constexpr double kMostChi2 = 21.67;  // of nine numbers
  const sensor::Pinhole &size_a = a.camera.color, &size_b = b.camera.color;
  Json pair{{"a", a.name}, {"b", b.name}};

  if (size_a.width != size_b.width || size_a.height != size_b.height || a.camera.model != b.camera.model) {
    pair.update({{"agree", false}, {"chi2", nullptr}, {"sigmas", nullptr}, {"number", nullptr}});
    pair["text"] = fmt::format("the cameras of {} and {} differ in size or lens", a.name, b.name);
    return pair;
  }

  // A change states the readout of the second camera itself, all other numbers relative to the first one.
  optimize::CameraChange difference = optimize::change_between(a.estimate->found, b.estimate->found);
  difference[optimize::kReadout] -= a.estimate->found.readout_s.value_or(0.0);
  const optimize::CameraCovariance both = a.estimate->covariance + b.estimate->covariance;
  const optimize::CameraChange sigma = both.diagonal().cwiseSqrt();
  const optimize::CameraChange sigmas = difference.cwiseQuotient(sigma);

  // The numbers are correlated and differ in size by orders of magnitude; in units of their standard
  // deviations the system is well conditioned.
  const optimize::CameraCovariance correlation =
      sigma.cwiseInverse().asDiagonal() * both * sigma.cwiseInverse().asDiagonal();
  const double chi2 = sigmas.dot(correlation.ldlt().solve(sigmas));

  // The test of all numbers says only that the cameras differ; the one that differs most is named.
  Eigen::Index number = 0;
  const double largest = sigmas.cwiseAbs().maxCoeff(&number);
  const char* name = kNames.at(static_cast<std::size_t>(number));
  const bool agree = chi2 <= kMostChi2;
  pair.update({{"agree", agree}, {"chi2", rounded(chi2)}, {"sigmas", rounded(largest)}, {"number", name}});

  pair["text"] =
      agree ? fmt::format("{} and {} may share one camera: no number differs by more than {:.1f} sigma",
                          a.name, b.name, largest)
            : fmt::format("{} and {} have different cameras: {} differs by {:.1f} sigma", a.name, b.name,
                          name, largest);

  return pair;
}

}  // namespace

Json camera_section(const RobotInfo& robot) {
  const maps::CameraEstimate known = robot.estimate.value_or(maps::CameraEstimate());
  Json numbers = Json::array();
  for (const mapping::CameraFinding& f : findings_of(robot.camera, known)) {
    numbers.push_back({{"name", f.name},
                       {"given", f.given},
                       {"found", f.found},
                       {"sigma", f.sigma},
                       {"wrong", rounded(f.wrong)},
                       {"used", f.used}});
  }

  // Numbers that were found but not used are listed as well: their standard deviations show how well the
  // recording determines the camera.
  return {{"robot", robot.name},
          {"gain", rounded(known.gain)},
          {"numbers", numbers},
          {"asked", known.answers},
          {"asked_at", known.asked_at < 0 ? Json(nullptr) : Json(known.asked_at)},
          {"from_frame", known.used_from},
          {"note", known.note},
          {"doubt", known.doubt}};
}

Json camera_pairs(const std::vector<RobotInfo>& robots) {
  Json pairs = Json::array();
  for (std::size_t i = 0; i < robots.size(); ++i) {
    for (std::size_t j = i + 1; j < robots.size(); ++j) {
      if (is_known(robots[i]) && is_known(robots[j])) pairs.push_back(pair_of(robots[i], robots[j]));
    }
  }
  return pairs;
}

CameraRefinement::CameraRefinement(const RobotInfo& robot) : robot_(robot) { known_.found = robot.camera; }

bool CameraRefinement::ask(const maps::Map& map, const std::vector<maps::FramePose>& frames,
                           const core::Executor& executor, core::Log& log) {
  mapping::CalibrationOptions options;
  options.file = robot_.camera;
  if (robot_.camera.guess) {
    options.focal = {0.1, 0.1};
    options.centre_px = {20.0, 20.0};
  }

  const auto found =
      mapping::calibrate_camera({{&map, &frames, robot_.camera.color}}, camera(), options, executor);
  ++known_.answers;

  if (robot_.camera.guess) known_.doubt = doubt_of(found);

  if (!found) {
    if (known_.answers == 1) known_.note = found.error().message;
    log.debug(fmt::format("{}: the camera is as given: {}", robot_.name, found.error().message));
    return false;
  }

  for (const mapping::CameraFinding& f : found->findings)
    log.debug(fmt::format("{}: {} of {} views: given {:.5g}, found {:.5g} +- {:.2g}, wrong with {:.2f}",
                          robot_.name, f.name, found->views, f.given, f.found, f.sigma, f.wrong));
  known_.note.clear();

  // A second pass has fewer frames: what it says may weigh less than the answer before.
  const bool knows_less = 2 * found->views < known_.views;
  known_.views = std::max(known_.views, found->views);
  const bool better = !knows_less && found->news >= (known_.better ? kLaterNews : mapping::kFileIsWrong);

  if (known_.answers > 1 && !better) return false;
  known_.better = better;
  known_.found = found->camera;
  known_.covariance = found->known.covariance;
  known_.wrong = found->known.wrong;

  known_.gain = found->gain;
  if (!better) return false;

  known_.found.guess = false;
  log.info(fmt::format("{}: the camera is better with {}: the recording fits {:.1f} % better", robot_.name,
                       found_text(found->findings), 100.0 * known_.gain));

  return true;
}

void CameraRefinement::restore(const RobotInfo& stored) {
  if (stored.estimate) {
    known_ = *stored.estimate;
  } else if (!stored.versions.empty()) {  // by a program that did not store estimates
    known_.found = stored.versions.back().camera;
    known_.better = true;
    known_.used_from = stored.versions.back().first_frame;
    known_.note = "found before the run was interrupted";
  }
  known_.found.sigma = robot_.camera.sigma;  // is not stored
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
