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

}  // namespace plumbline::pipeline
