// SPDX-License-Identifier: BSD-3-Clause
// What summary.json says of cameras: what the maps told of them, and the errors of their depth.
#include "run/summary_json.hpp"

namespace plumbline::pipeline {
namespace {

Json camera_of(const RunSummary::Camera& camera) {
  Json numbers = Json::array();
  for (const mapping::CameraFinding& f : camera.findings) {
    numbers.push_back({{"name", f.name},
                       {"given", f.given},
                       {"found", f.found},
                       {"sigma", f.sigma},
                       {"gain", rounded(f.gain)},
                       {"used", f.used}});
  }
  return {{"robot", camera.robot}, {"gain", rounded(camera.gain)},    {"numbers", numbers},
          {"asked", camera.asked}, {"from_frame", camera.from_frame}, {"note", camera.note},
          {"doubt", camera.doubt}};
}

}  // namespace

Json cameras_of(const RunSummary& summary) {
  Json list = Json::array();
  for (const RunSummary::Camera& camera : summary.cameras) list.push_back(camera_of(camera));
  return list;
}

std::string camera_json(const RunSummary::Camera& camera) {
  return camera_of(camera).dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<RunSummary::Camera> camera_from_json(const std::string& text) try {
  const auto json = nlohmann::json::parse(text);
  RunSummary::Camera camera;
  camera.robot = json.at("robot");
  camera.gain = json.at("gain");
  for (const auto& n : json.at("numbers")) {
    camera.findings.push_back(
        {n.at("name"), n.at("given"), n.at("found"), n.at("sigma"), n.at("gain"), n.at("used")});
  }
  camera.asked = json.at("asked");
  camera.from_frame = json.at("from_frame");
  camera.note = json.at("note");
  camera.doubt = json.at("doubt");
  return camera;
} catch (const nlohmann::json::exception&) {
  return std::nullopt;
}

}  // namespace plumbline::pipeline
