// SPDX-License-Identifier: BSD-3-Clause
#include "scene/object_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

#include "plumbline/core/options.hpp"
#include "scene/builder.hpp"

namespace plumbline::synth {

using core::ConfigNode;
using core::ConfigProblems;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Reads one object: binds locals to keys, reports problems, and decides whether the object may be built.
class ObjectReader {
 public:
  ObjectReader(const ConfigNode& node, std::string path, ConfigProblems& problems)
      : node_(node), path_(std::move(path)), problems_(problems), before_(problems.size()) {
    table_.text("name", name, "Name of the object in messages");
  }

  ObjectReader& point(const std::string& key, std::vector<double>& value, std::size_t length,
                      bool required = true) {
    table_.numbers(key, value, length, {-1000.0, 1000.0}, "m", "Place");
    if (required) required_.push_back(key);
    return *this;
  }
  ObjectReader& size(const std::string& key, std::vector<double>& value, std::size_t length) {
    table_.numbers(key, value, length, {0.001, 500.0}, "m", "Extent");
    return *this;
  }
  ObjectReader& length(const std::string& key, double& value, double min, double max) {
    table_.number(key, value, {min, max}, "m", "Length");
    return *this;
  }
  ObjectReader& angle(const std::string& key, double& value) {
    table_.number(key, value, {-7.0, 7.0}, "rad", "Angle");
    return *this;
  }
  ObjectReader& power(double& value) {
    table_.number("power", value, {0.0, 100.0}, "", "Light");
    return *this;
  }
  ObjectReader& count(const std::string& key, int& value, int min, int max) {
    table_.integer(key, value, {min, max}, "", "Count");
    return *this;
  }
  ObjectReader& flag(const std::string& key, bool& value) {
    table_.boolean(key, value, "Switch");
    return *this;
  }
  ObjectReader& material(const std::string& key, std::string& value) {
    table_.choice(key, value, material_names(), "Material");
    return *this;
  }

  /// Reads the values. False: there was a problem, which is reported.
  bool read(const std::vector<std::string>& reserved = {}) {
    if (node_.kind != ConfigNode::Kind::kMap) {
      problem(node_.mark, "needs keys and values in braces or below it");
      return false;
    }
    table_.set_all(node_, path_, problems_, reserved);
    for (const std::string& key : required_) {
      if (node_.find(key) == nullptr) problem(node_.mark, fmt::format("has no '{}', which it needs", key));
    }
    return problems_.size() == before_;
  }
  void problem(const core::ConfigMark& mark, const std::string& what) {
    problems_.push_back({mark, path_, what});
  }

  std::string name;

 private:
  const ConfigNode& node_;
  std::string path_;
  ConfigProblems& problems_;
  std::size_t before_;
  core::OptionTable table_;
  std::vector<std::string> required_;
};

Vector3d to3(const std::vector<double>& v) { return {v[0], v[1], v.size() > 2 ? v[2] : 0.0}; }

/// Arguments of the functions that read an object.
struct Context {
  const ConfigNode& node;
  std::string path;
  std::string type;
  Builder& builder;
  ConfigProblems& problems;
};

bool begin(const Context& c, ObjectReader& reader, const std::vector<std::string>& reserved = {}) {
  if (!reader.read(reserved)) return false;
  c.builder.begin_object(c.type, reader.name, c.node.mark);
  return true;
}

bool read_opening(const ConfigNode& node, const std::string& path, bool window, Opening& o,
                  ConfigProblems& problems) {
  ObjectReader r(node, path, problems);
  o.window = window;
  o.mark = node.mark;

  // Usual size of a window.
  if (window) {
    o.width = 1.2;
    o.bottom = 0.9;
    o.height = 1.2;
  }

  // Settings by the kind of opening.
  bool leaf = true;
  r.length("at", o.at, 0.0, 500.0).length("width", o.width, 0.1, 50.0).length("bottom", o.bottom, 0.0, 20.0);
  r.length("height", o.height, 0.1, 20.0);
  if (!window) r.angle("open", o.open_rad).flag("leaf", leaf).material("material", o.material);
  if (!r.read()) return false;
  if (!leaf) o.open_rad = -1.0;
  return true;
}

void read_openings(const Context& c, const char* key, bool window, Wall& wall) {
  const ConfigNode* list = c.node.find(key);
  if (list == nullptr) return;
  if (list->kind != ConfigNode::Kind::kSequence) {
    c.problems.push_back(
        {list->mark, c.path + "." + key, "is a list of openings, each with at, width, height"});
    return;
  }
  for (std::size_t i = 0; i < list->items.size(); ++i) {
    Opening o;
    if (read_opening(list->items[i], fmt::format("{}.{}[{}]", c.path, key, i), window, o, c.problems)) {
      wall.openings.push_back(o);
    }
  }
}

void check_openings(const Context& c, Wall& wall) {
  const double length = (wall.to - wall.from).norm();

  // In order along the wall, without overlap.
  std::sort(wall.openings.begin(), wall.openings.end(),
            [](const Opening& a, const Opening& b) { return a.at < b.at; });
  double end = 0.0;
  for (const Opening& o : wall.openings) {
    if (o.at < end) {
      c.problems.push_back({o.mark, c.path, fmt::format("openings overlap at {:.2f} m", o.at)});
    } else if (o.at + o.width > length + 1e-9 || o.bottom + o.height > wall.height + 1e-9) {
      c.problems.push_back(
          {o.mark, c.path,
           fmt::format("the opening at {:.2f} m does not fit in a wall {:.2f} m long and {:.2f} m high", o.at,
                       length, wall.height)});
    }
    end = o.at + o.width;
  }
}

void read_wall(const Context& c) {
  Wall wall;
  std::vector<double> from, to;
  ObjectReader r(c.node, c.path, c.problems);
  r.point("from", from, 2).point("to", to, 2).length("height", wall.height, 0.01, 50.0);
  r.length("bottom", wall.bottom, -50.0, 50.0).length("thickness", wall.thickness, 0.005, 5.0);
  r.material("material", wall.material).material("skirting", wall.skirting);
  if (!r.read({"doors", "windows"})) return;

  // A wall needs a length.
  wall.from = {from[0], from[1]};
  wall.to = {to[0], to[1]};
  if ((wall.to - wall.from).norm() < 0.01) {
    r.problem(c.node.mark,
              fmt::format("degenerate wall: from and to are the same place ({}, {})", from[0], from[1]));
    return;
  }

  // Openings are checked before anything is built.
  const std::size_t before = c.problems.size();
  read_openings(c, "doors", false, wall);
  read_openings(c, "windows", true, wall);
  check_openings(c, wall);
  if (c.problems.size() != before) return;
  c.builder.begin_object(c.type, r.name, c.node.mark);
  add_wall(c.builder, wall);
}

void read_panels(const Context& c) {
  Wall wall;
  wall.thickness = 0.02;
  wall.height = 2.0;
  wall.material = "cloth";

  // Settings of all panels.
  ObjectReader r(c.node, c.path, c.problems);
  r.length("height", wall.height, 0.01, 50.0).length("bottom", wall.bottom, -50.0, 50.0);
  r.length("thickness", wall.thickness, 0.001, 5.0).material("material", wall.material);
  if (!r.read({"points"})) return;

  // At least two corners.
  const ConfigNode* list = c.node.find("points");
  if (list == nullptr || list->kind != ConfigNode::Kind::kSequence || list->items.size() < 2) {
    r.problem(c.node.mark, "needs 'points', a list of at least two [x, y]");
    return;
  }

  // Corners, each away from the one before.
  std::vector<Vector2d> points;
  for (std::size_t i = 0; i < list->items.size(); ++i) {
    core::OptionTable table;
    std::vector<double> p;
    table.numbers("point", p, 2, {-1000.0, 1000.0}, "m", "Corner");
    const std::size_t before = c.problems.size();
    table.set("point", list->items[i], fmt::format("{}.points[{}]", c.path, i), c.problems);
    if (c.problems.size() != before) return;

    points.emplace_back(p[0], p[1]);
    if (i > 0 && (points[i] - points[i - 1]).norm() < 0.01) {
      r.problem(list->items[i].mark, "degenerate wall: this point is the same as the one before");
      return;
    }
  }

  // Adjoining panels share mitred corners.
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    c.builder.begin_object(c.type, r.name.empty() ? "" : fmt::format("{} {}", r.name, i + 1), c.node.mark);
    add_zigzag_panel(c.builder, wall, points, i);
  }
}

void read_slab(const Context& c) {
  std::vector<double> from, to;
  const bool floor = c.type == "floor";
  double z = floor ? 0.0 : 2.6;
  std::string material = floor ? "carpet" : "ceiling";
  ObjectReader r(c.node, c.path, c.problems);
  r.point("from", from, 2).point("to", to, 2).length(floor ? "z" : "height", z, -50.0, 50.0);
  r.material("material", material);
  if (!r.read()) return;

  // Opposite corners, in any order.
  const Vector2d lo(std::min(from[0], to[0]), std::min(from[1], to[1]));
  const Vector2d hi(std::max(from[0], to[0]), std::max(from[1], to[1]));
  if ((hi - lo).minCoeff() < 0.01) {
    r.problem(c.node.mark, fmt::format("degenerate {}: it has no area", c.type));
    return;
  }
  c.builder.begin_object(c.type, r.name, c.node.mark);

  // The thickness is outside the room.
  const double z0 = floor ? z - 0.1 : z, z1 = floor ? z : z + 0.1;
  c.builder.box({}, {lo.x(), lo.y(), z0}, {hi.x(), hi.y(), z1}, {material});
}

void read_box(const Context& c) {
  std::vector<double> at, size;
  double yaw = 0.0;
  bool stretched = false;
  std::string material = "plaster";
  ObjectReader r(c.node, c.path, c.problems);
  r.point("at", at, 3).size("size", size, 3).angle("yaw", yaw).material("material", material);
  r.flag("stretched", stretched);
  if (c.node.kind == ConfigNode::Kind::kMap && c.node.find("size") == nullptr) {
    r.problem(c.node.mark, "has no 'size', which it needs");
  }
  if (!begin(c, r)) return;
  const Skin skin{material, stretched};
  c.builder.box(upright(to3(at), yaw), {-0.5 * size[0], -0.5 * size[1], 0.0},
                {0.5 * size[0], 0.5 * size[1], size[2]}, skin, &skin);
}

void read_cylinder(const Context& c) {
  std::vector<double> at;
  double radius = 0.1, top_radius = -1.0, height = 1.0;
  int segments = 24;
  std::string material = "plaster";
  ObjectReader r(c.node, c.path, c.problems);
  r.point("at", at, 3).length("radius", radius, 0.001, 50.0).length("top_radius", top_radius, 0.001, 50.0);
  r.length("height", height, 0.001, 50.0).count("segments", segments, 3, 256).material("material", material);
  if (!begin(c, r)) return;
  c.builder.cylinder(upright(to3(at), 0.0),
                     {Vector3d::Zero(), radius, top_radius > 0.0 ? top_radius : radius, height, segments},
                     {material});
}

/// Posters, whiteboards, signs and pictures: flat things that hang; yaw 0 looks to -y.
void read_panel(const Context& c) {
  std::vector<double> at, size = c.type == "whiteboard" ? std::vector<double>{1.8, 1.1}
                                 : c.type == "sign"     ? std::vector<double>{0.3, 0.15}
                                                        : std::vector<double>{0.6, 0.85};
  double yaw = 0.0, thickness = 0.008;
  int seed = -1;
  std::string material = c.type == "whiteboard" ? "whiteboard" : c.type == "sign" ? "sign" : "poster";
  if (c.type == "picture") material = "picture";

  // Settings, with usual values by type.
  ObjectReader r(c.node, c.path, c.problems);
  r.point("at", at, 3).size("size", size, 2).angle("yaw", yaw).length("thickness", thickness, 0.001, 0.5);
  r.material("material", material).count("seed", seed, 0, 1 << 20);
  if (!begin(c, r)) return;

  // The print is the first face added.
  const std::size_t first = c.builder.scene().faces.size();
  const bool framed = c.type == "whiteboard" || c.type == "picture";
  const char* rim = c.type == "picture" ? "wood_dark" : framed ? "metal" : "paint_white";
  add_panel(c.builder, upright(to3(at), yaw), {size[0], size[1], thickness, material, rim, framed});
  if (seed >= 0) c.builder.scene().faces[first].seed = seed;
}

/// Furniture that stands at [x, y] or [x, y, z].
void read_furniture(const Context& c) {
  // Usual sizes and materials.
  static const std::map<std::string, std::vector<double>> kSizes = {
      {"desk", {1.5, 0.75, 0.74}}, {"table", {1.2, 0.7, 0.72}},   {"shelf", {0.9, 0.32, 1.9}},
      {"sofa", {1.9, 0.9, 0.85}},  {"cabinet", {0.9, 0.45, 0.8}},
  };

  static const std::map<std::string, std::string> kMaterialOfWord = {
      {"desk", "wood"}, {"table", "wood_dark"},   {"shelf", "wood"},
      {"sofa", "sofa"}, {"cabinet", "wood_dark"}, {"chair", "fabric"},
  };

  // Settings of all furniture.
  std::vector<double> at, size = kSizes.count(c.type) != 0 ? kSizes.at(c.type) : std::vector<double>{};
  double yaw = 0.0;
  bool books = true;
  int doors = 2;
  std::string material = kMaterialOfWord.at(c.type);
  ObjectReader r(c.node, c.path, c.problems);
  r.point("at", at, 0).angle("yaw", yaw).material("material", material);

  // Settings of some types.
  if (!size.empty()) r.size("size", size, 3);
  if (c.type == "shelf") r.flag("books", books);
  if (c.type == "cabinet") r.count("doors", doors, 1, 8);
  if (!r.read()) return;

  // Height 0 unless given.
  if (at.size() != 2 && at.size() != 3) {
    r.problem(c.node.mark, "'at' is [x, y] or [x, y, z]");
    return;
  }

  c.builder.begin_object(c.type, r.name, c.node.mark);
  const geometry::Rigid3 frame = upright(to3(at), yaw);
  const Vector3d extent = size.empty() ? Vector3d::Zero() : to3(size);
  if (c.type == "desk") add_desk(c.builder, frame, extent, material);
  if (c.type == "table") add_table(c.builder, frame, extent, material);
  if (c.type == "shelf") add_shelf(c.builder, frame, extent, material, books);
  if (c.type == "sofa") add_sofa(c.builder, frame, extent, material);
  if (c.type == "cabinet") add_cabinet(c.builder, frame, extent, material, doors);
  if (c.type == "chair") add_chair(c.builder, frame, material);
}

/// Smaller things at [x, y, z].
void read_thing(const Context& c) {
  std::vector<double> at;
  double yaw = 0.0, width = 0.6, depth = 0.6, height = 1.0, power = 1.0, fold = 0.16;
  int count = 5;
  bool stand = true;
  std::string material = "curtain";
  ObjectReader r(c.node, c.path, c.problems);
  r.point("at", at, 3).angle("yaw", yaw);

  // Settings depend on the type.
  if (c.type == "monitor") r.length("width", width, 0.1, 5.0).flag("stand", stand);
  if (c.type == "plant") r.length("height", height, 0.2, 5.0);
  if (c.type == "lamp") r.length("width", width, 0.05, 5.0).length("depth", depth, 0.05, 5.0).power(power);

  if (c.type == "floor_lamp") {
    height = 1.6;
    r.length("height", height, 0.5, 3.0).power(power);
  }

  if (c.type == "clutter") {
    width = 1.2;
    depth = 0.5;
    r.length("width", width, 0.1, 10.0).length("depth", depth, 0.1, 10.0).count("count", count, 1, 50);
  }

  if (c.type == "curtain") {
    height = 2.2;
    r.length("width", width, 0.1, 20.0).length("height", height, 0.1, 10.0).length("fold", fold, 0.02, 1.0);
    r.material("material", material);
  }
  if (!begin(c, r)) return;

  // The thing itself, by its type.
  const geometry::Rigid3 frame = upright(to3(at), yaw);
  if (c.type == "monitor") add_monitor(c.builder, frame, width, stand);
  if (c.type == "plant") add_plant(c.builder, frame, height);
  if (c.type == "lamp") add_ceiling_lamp(c.builder, frame, width, depth, power);
  if (c.type == "floor_lamp") add_floor_lamp(c.builder, frame, height, power);
  if (c.type == "clutter") add_clutter(c.builder, frame, width, depth, count);
  if (c.type == "curtain") add_curtain(c.builder, frame, width, height, fold, material);
}

using ReadObject = std::function<void(const Context&)>;
const std::map<std::string, ReadObject>& object_readers() {
  static const std::map<std::string, ReadObject> kReaders = {
      {"wall", read_wall},       {"panels", read_panels},    {"floor", read_slab},
      {"ceiling", read_slab},    {"box", read_box},          {"cylinder", read_cylinder},
      {"poster", read_panel},    {"whiteboard", read_panel}, {"sign", read_panel},
      {"picture", read_panel},   {"desk", read_furniture},   {"table", read_furniture},
      {"shelf", read_furniture}, {"sofa", read_furniture},   {"cabinet", read_furniture},
      {"chair", read_furniture}, {"monitor", read_thing},    {"plant", read_thing},
      {"lamp", read_thing},      {"floor_lamp", read_thing}, {"clutter", read_thing},
      {"curtain", read_thing},
  };
  return kReaders;
}

}  // namespace

void read_objects(const ConfigNode& list, Builder& builder, ConfigProblems& problems) {
  if (list.kind != ConfigNode::Kind::kSequence) {
    problems.push_back(
        {list.mark, "objects", "is a list of things such as '- box: {at: [0, 0, 0], size: [1, 1, 1]}'"});
    return;
  }

  // All names, to suggest the most similar one.
  std::vector<std::string> types;
  for (const auto& [type, unused] : object_readers()) types.push_back(type);

  // Each item is a type with its settings.
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const ConfigNode& item = list.items[i];
    const std::string path = fmt::format("objects[{}]", i);
    if (item.kind != ConfigNode::Kind::kMap || item.entries.size() != 1) {
      problems.push_back({item.mark, path, "is one thing, written '- type: {key: value, ...}'"});
      continue;
    }

    // Unknown types, with the most similar one.
    const auto& [type, body] = item.entries.front();
    const auto reader = object_readers().find(type);
    if (reader == object_readers().end()) {
      problems.push_back(
          {item.mark, path + "." + type, "is not a known kind of object" + core::hint(type, types)});
      continue;
    }

    reader->second({body, path + "." + type, type, builder, problems});
  }
}

}  // namespace plumbline::synth
