// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viewer/page.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "encode.hpp"
#include "plumbline/core/json.hpp"
#include "sources.hpp"

namespace plumbline::viewer {
namespace {

using Json = nlohmann::ordered_json;

/// Data of a page: pieces of base64, numbered as they come.
struct Pieces {
  std::vector<std::string> base64;

  int add(std::string_view bytes) {
    base64.push_back(viewer::base64(bytes));
    return static_cast<int>(base64.size()) - 1;
  }
};

double rounded(double value) { return std::isfinite(value) ? std::round(value * 1e4) / 1e4 : 0.0; }

Json numbers(const Eigen::Vector3d& p) {
  return Json::array({rounded(p.x()), rounded(p.y()), rounded(p.z())});
}

void append(Json& list, const Eigen::Vector3d& p) {
  for (int k = 0; k < 3; ++k) list.push_back(rounded(p[k]));
}

/// Axes of the camera in the frame that is shown, as a quaternion x y z w.
Json turn_of(const geometry::Rigid3& world_from_camera, bool z_up) {
  Eigen::Matrix3d axes;
  for (int k = 0; k < 3; ++k) axes.col(k) = shown(world_from_camera.rotation.col(k), z_up);
  const Eigen::Quaterniond q(axes);
  return Json::array({rounded(q.x()), rounded(q.y()), rounded(q.z()), rounded(q.w())});
}

const char* name_of(Scale scale) {
  switch (scale) {
    case Scale::kLinear:
      return "linear";
    case Scale::kLogarithmic:
      return "log";
    case Scale::kCategory:
      return "category";
    case Scale::kView:
      return "view";
  }
  return "";
}

Json layer_json(const Layer& layer) {
  return {{"key", layer.key}, {"label", layer.label}, {"unit", layer.unit},   {"scale", name_of(layer.scale)},
          {"low", layer.low}, {"high", layer.high},   {"steps", layer.steps}, {"names", layer.names}};
}

Json cloud_json(const Points& points, bool z_up, Pieces& pieces, Cost& cost) {
  const EncodedCloud encoded = encode(points, z_up);
  Json json;
  json["name"] = points.name;
  json["count"] = points.positions.size();
  json["of"] = points.of;
  json["colored"] = points.colored;
  json["origin"] = encoded.origin;
  json["step"] = encoded.step_m;

  json["levels"] = Json::array();
  for (const double spacing : encoded.spacing_m) json["levels"].push_back(rounded(spacing));
  json["layers"] = Json::array();
  for (const Layer& layer : points.layers) json["layers"].push_back(layer_json(layer));

  // Chunks refer to pieces by number.
  json["chunks"] = Json::array();
  cost.points += points.positions.size();
  for (const Chunk& chunk : encoded.chunks) {
    Json data = Json::array({pieces.add(chunk.points)});
    cost.place_and_color += pieces.base64.back().size();

    // Normals and layers, if there are any.
    data.push_back(chunk.normals.empty() ? -1 : pieces.add(chunk.normals));
    if (!chunk.normals.empty()) cost.normals += pieces.base64.back().size();
    for (const std::string& layer : chunk.layers) {
      data.push_back(pieces.add(layer));
      cost.layers += pieces.base64.back().size();
    }

    // The chunk with its extent.
    json["chunks"].push_back({{"level", chunk.level},
                              {"count", chunk.count},
                              {"low", chunk.low},
                              {"high", chunk.high},
                              {"data", data}});
  }
  return json;
}

Json path_json(const CameraPath& path, bool z_up) {
  Json json = {{"robot", path.robot},
               {"name", path.name},
               {"t", Json::array()},
               {"p", Json::array()},
               {"q", Json::array()}};
  for (std::size_t i = 0; i < path.stamps.size(); ++i) {
    json["t"].push_back(rounded(path.stamps[i]));
    append(json["p"], shown(path.world_from_camera[i].translation, z_up));
    for (const Json& part : turn_of(path.world_from_camera[i], z_up)) json["q"].push_back(part);
  }
  return json;
}

/// Errors of a keyframe's pose, in the axes that are shown: "e" has the steps of shift and turn, "s" numbers
/// of them, 16 bits each, of all samples.
void add_samples(const Keyframe& keyframe, bool z_up, Json& json) {
  std::vector<double> motions;
  std::array<double, 2> most{1e-12, 1e-12};

  // Scales of shift and turn are separate.
  for (const geometry::Vector6d& motion : *keyframe.in_camera) {
    if (!motion.allFinite()) return;
    for (const int part : {0, 1}) {
      const Eigen::Vector3d v =
          shown(keyframe.world_from_camera.rotation * motion.segment<3>(3 * part), z_up);
      motions.insert(motions.end(), v.data(), v.data() + 3);

      // The largest component sets the step.
      auto& of_part = most[static_cast<std::size_t>(part)];
      of_part = std::max(of_part, v.lpNorm<Eigen::Infinity>());
    }
  }

  // Steps of 16 bits keep the page small.
  std::string bytes;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const auto step = static_cast<std::uint16_t>(std::lround(32000.0 * motions[i] / most[i / 3 % 2]));
    bytes += {static_cast<char>(step & 0xFFU), static_cast<char>(step >> 8U)};
  }
  json["e"] = {most[0] / 32000.0, most[1] / 32000.0};
  json["s"] = base64(bytes);
}

Json segments_json(const std::vector<Segment>& segments, bool z_up) {
  Json json = Json::array();
  for (const auto& [from, to] : segments) {
    append(json, shown(from, z_up));
    append(json, shown(to, z_up));
  }
  return json;
}

/// Corners of the box without the outer hundredth of the points on either side, along each axis.
Json inmost_json(const Scene& scene) {
  std::array<std::vector<double>, 3> values;

  for (const Points& points : scene.clouds) {
    // A sample suffices.
    const std::size_t step = 1 + points.positions.size() / 200000;
    for (std::size_t i = 0; i < points.positions.size(); i += step) {
      const auto& [x, y, z] = points.positions[i];
      const Eigen::Vector3d p =
          shown({points.shift[0] + x, points.shift[1] + y, points.shift[2] + z}, scene.z_up);
      for (std::size_t k = 0; k < 3; ++k) values[k].push_back(p[static_cast<int>(k)]);
    }
  }

  // Quantiles of one percent.
  Json low = Json::array();
  Json high = Json::array();
  for (std::vector<double>& all : values) {
    if (all.empty()) all.push_back(0.0);
    std::sort(all.begin(), all.end());
    const std::size_t outer = all.size() / 100;
    low.push_back(rounded(all[outer]));
    high.push_back(rounded(all[all.size() - 1 - outer]));
  }

  return Json::array({low, high});
}

Json scene_json(const Scene& scene, Pieces& pieces, Cost& cost) {
  Json json;
  json["name"] = scene.name;
  json["frame"] = scene.frame;
  json["up"] = scene.z_up;
  json["floor"] = rounded(scene.floor_m);
  if (!scene.placing.empty()) json["placing"] = scene.placing;

  json["clouds"] = Json::array();
  for (const Points& points : scene.clouds)
    json["clouds"].push_back(cloud_json(points, scene.z_up, pieces, cost));
  json["inmost"] = inmost_json(scene);

  json["paths"] = Json::array();
  for (const CameraPath& path : scene.paths) json["paths"].push_back(path_json(path, scene.z_up));

  // Keyframes with their poses.
  json["keyframes"] = Json::array();
  for (const Keyframe& k : scene.keyframes) {
    Json keyframe = {{"robot", k.robot},
                     {"t", rounded(k.stamp)},
                     {"p", numbers(shown(k.world_from_camera.translation, scene.z_up))},
                     {"q", turn_of(k.world_from_camera, scene.z_up)}};

    // Pictures and pose errors may be unknown.
    if (!k.jpeg.empty()) keyframe["i"] = base64(k.jpeg);
    if (k.in_camera) add_samples(k, scene.z_up, keyframe);
    json["keyframes"].push_back(std::move(keyframe));
  }

  // Lines, and arcs between matched keyframes.
  json["lines"] = segments_json(scene.lines, scene.z_up);
  json["arcs"] = Json::array();
  for (const Arc& arc : scene.arcs) {
    json["arcs"].push_back({{"merge", arc.merge},
                            {"a", numbers(shown(arc.from, scene.z_up))},
                            {"b", numbers(shown(arc.to, scene.z_up))}});
  }

  // The floor plan.
  json["walls"] = segments_json(scene.walls, scene.z_up);
  json["doors"] = segments_json(scene.doors, scene.z_up);
  json["rooms"] = Json::array();
  for (const auto& [place, text] : scene.rooms)
    json["rooms"].push_back(Json::array({numbers(shown(place, scene.z_up)), text}));
  if (!scene.live.empty()) json["live"] = scene.live;
  return json;
}

/// JSON that may be put into a script: nothing in it ends the script or begins a comment.
std::string in_script(const Json& json) {
  const std::string text = core::json_text(json, -1);
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
  return out;
}

std::string markup(const std::string& text) {
  static const std::map<char, std::string> kEntities{
      {'<', "&lt;"}, {'>', "&gt;"}, {'&', "&amp;"}, {'"', "&quot;"}};
  std::string out;
  for (const char c : text) {
    const auto entity = kEntities.find(c);
    out += entity == kEntities.end() ? std::string(1, c) : entity->second;
  }
  return out;
}

std::string element(const Scene& scene, const std::string& still, const std::string& kind, Cost* cost) {
  Cost spent;
  Pieces pieces;
  const std::string json = in_script(scene_json(scene, pieces, spent));

  // The still text remains without scripts.
  std::string out = "<style>\n" + std::string(kStyle) + "</style>\n<div class=\"" + kind + "\">\n";
  out += "<div class=\"pv-still\" hidden=\"hidden\">" + still + "</div>\n";
  out += "<noscript>" + still + "</noscript>\n";
  out += "<script type=\"application/json\" class=\"pv-scene\">" + json + "</script>\n";
  for (std::size_t i = 0; i < pieces.base64.size(); ++i)
    out += "<script type=\"text/plain\" class=\"pv-data\" data-n=\"" + std::to_string(i) + "\">" +
           pieces.base64[i] + "</script>\n";
  const std::string script = std::string(kScript) + (scene.live.empty() ? "" : kLiveScript) + "})();\n";
  out += "</div>\n<script>\n" + script + "</script>\n";

  spent.code = std::string_view(kStyle).size() + script.size();
  if (cost != nullptr) *cost = spent;
  return out;
}

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8U | (k < left ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);

    // Padding replaces missing bytes.
    for (std::size_t k = 0; k < 4; ++k) out += k <= left ? kDigits[three >> (18U - 6U * k) & 63U] : '=';
  }
  return out;
}

std::string cloud_json(const Points& points, bool z_up) {
  Pieces pieces;
  Cost cost;
  Json json = cloud_json(points, z_up, pieces, cost);
  json["data"] = pieces.base64;
  return core::json_text(json, -1);
}

Eigen::Vector3d upright(const Eigen::Vector3d& place, bool z_up) { return shown(place, z_up); }

std::string fragment(const Scene& scene, const std::string& still, Cost* cost) {
  return element(scene, still, "pv", cost);
}

std::string page(const Scene& scene, const std::string& generator, Cost* cost) {
  const std::string none =
      "<p>This browser has no WebGL 2 or runs no scripts, so that it cannot draw the map.</p>";
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>\n<meta name=\"generator\" "
         "content=\"" +
         markup(generator) +
         "\"/>\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
         "<meta name=\"color-scheme\" content=\"light dark\"/>\n<title>" +
         markup(scene.name) + "</title></head>\n<body>\n" + element(scene, none, "pv pv-whole", cost) +
         "</body></html>\n";
}

}  // namespace plumbline::viewer
