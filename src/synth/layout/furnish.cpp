// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "layout/layout.hpp"

namespace plumbline::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::Rigid3;

namespace {

/// A kind of thing, and how it is drawn.
struct Rule {
  std::string type;
  std::string place;  ///< wall: its back to one; hanging: on one; middle: anywhere on the floor
  double per_m2 = 0.0;
  double width[2], depth[2], height[2];  ///< smallest and largest, m; hanging things have no depth
  std::string materials;                 ///< one of them
  std::string with;                      ///< on it m a monitor, c clutter; before it h a chair
  std::string rooms;                     ///< kinds that have it
};

constexpr const char* kRules = R"(
bed        wall    0.08   0.9  1.8  2.0  2.1 0.42 0.55 fabric,curtain,rug         -    bedroom
sofa       wall    0.06   1.3  2.4  0.8 0.95 0.75  0.9 sofa,fabric                -    living,hall
cabinet    wall    0.08   0.9  2.0  0.5 0.62  1.8  2.2 wood,wood_dark             -    bedroom
cabinet    wall    0.2    1.2  2.6  0.6  0.6 0.88 0.92 wood,paint_grey            c    kitchen
cabinet    wall    0.1    0.6  0.6  0.6 0.65  1.7  2.0 paint_grey,metal           -    kitchen
desk       wall    0.12   1.2  1.8 0.65  0.8 0.72 0.76 wood,wood_dark             mch  office,study
desk       wall    0.04   1.0  1.3 0.55 0.65 0.72 0.76 wood                       mch  bedroom
desk       middle  0.04   1.4  1.8  0.7  0.8 0.72 0.76 wood                       mch  office
table      middle  0.05   1.6  2.8  0.9  1.2 0.72 0.75 wood,wood_dark             chh  meeting
table      middle  0.05   1.0  1.8  0.7  0.9 0.72 0.76 wood                       chh  living,kitchen
table      middle  0.04   0.7  1.1  0.5  0.6 0.38 0.45 wood_dark                  c    living,hall
shelf      wall    0.1    0.8  2.0 0.28  0.4  1.2  2.1 wood,paint_grey,wood_dark  -    living,office,study,store,meeting
cabinet    wall    0.07   0.7  1.8 0.35  0.5  0.5  1.1 wood,wood_dark,paint_grey  c    living,office,bath,corridor,hall,meeting
box        wall    0.1    0.3  0.6  0.3  0.5 0.25  0.6 cardboard                  -    store,bedroom,office,kitchen
box        wall    0.15   1.5  1.7  0.7 0.75 0.55  0.6 ceramic                    -    bath
box        wall    0.25  0.38  0.6 0.45  0.6 0.42 0.85 ceramic                    -    bath
plant      wall    0.04   0.6  0.6  0.6  0.6  0.8  1.6 leaf                       -    living,office,meeting,corridor,hall,study
floor_lamp wall    0.02   0.4  0.4  0.4  0.4  1.5  1.8 metal                      -    living,bedroom
column     middle  0.012 0.22  0.5 0.22  0.5  9.0  9.0 plaster,paint_grey         -    office,hall,living,corridor
poster     hanging 0.14   0.4  0.9    0    0  0.5  1.1 poster                     -    bedroom,office,study,corridor,meeting,store
picture    hanging 0.12   0.4  1.3    0    0  0.4  0.9 picture                    -    living,bedroom,corridor,hall,kitchen,office,bath
whiteboard hanging 0.05   1.0  2.0    0    0  0.8  1.1 whiteboard                 -    office,meeting,study
sign       hanging 0.08   0.2 0.35    0    0 0.12  0.2 sign                       -    corridor,hall,office
)";

/// The table of furniture, parsed once.
const std::vector<Rule>& rules() {
  static const std::vector<Rule> kAll = [] {
    std::vector<Rule> all;
    std::istringstream text(kRules);
    for (Rule r; text >> r.type >> r.place >> r.per_m2 >> r.width[0] >> r.width[1] >> r.depth[0] >>
                 r.depth[1] >> r.height[0] >> r.height[1] >> r.materials >> r.with >> r.rooms;) {
      all.push_back(r);
    }
    return all;
  }();
  return kAll;
}

constexpr double kLeastFloor = 0.2;  // of a room's floor stays free to walk on, with clearance

struct Range {
  double from, to;
};

bool overlap(const Range& a, const Range& b) { return a.from < b.to && b.from < a.to; }

/// Extent of corners along a direction.
Range span(const std::vector<Vector2d>& corners, const Vector2d& d) {
  Range r{1e9, -1e9};
  for (const Vector2d& c : corners) r = {std::min(r.from, d.dot(c)), std::max(r.to, d.dot(c))};
  return r;
}

/// Separating axes of two rectangles.
bool overlap(const std::vector<Vector2d>& a, const std::vector<Vector2d>& b) {
  for (const auto* corners : {&a, &b}) {
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
      const Vector2d axis = ((*corners)[i + 1] - (*corners)[i]).normalized();
      if (!overlap(span(a, axis), span(b, axis))) return false;
    }
  }
  return true;
}

/// Something that could be placed.
struct Item {
  const Rule* rule;
  Rigid3 frame;
  Vector3d size;
  std::string material;
};

std::string pick_word(const std::string& words, Rng& rng) {
  std::vector<std::string> list;
  std::istringstream text(words);
  for (std::string word; std::getline(text, word, ',');) list.push_back(word);
  return rng.pick(list);
}

class Furnisher {
 public:
  Furnisher(Plan& plan, Ground& ground, Rng& rng, Builder& builder)
      : plan_(plan), ground_(ground), rng_(rng), b_(builder) {
    for (std::size_t i = 0; i < plan_.rooms.size(); ++i) keep_free(static_cast<int>(i));
  }

  /// `fullness`: 0 is bare, 1 crammed.
  void fill(int room, double fullness) {
    room_ = room;
    const PlanRoom& r = plan_.rooms[static_cast<std::size_t>(room)];
    for (const Rule& rule : rules()) {
      if (rule.rooms.find(r.kind) == std::string::npos) continue;
      const double share = rule.type == "column" ? 1.0 : 2.2 * fullness;
      for (int n = static_cast<int>(r.area() * rule.per_m2 * share + rng_.uniform()); n > 0; --n) add(rule);
    }
  }

  /// Furnishes like rooms: the first one, then copies of all that is in it.
  void fill_alike(double fullness) {
    Scene& scene = b_.scene();
    const std::size_t objects = scene.objects.size(), faces = scene.faces.size(), lamps = scene.lamps.size(),
                      things = plan_.things.size();
    const auto& like = plan_.alike;
    fill(like.front(), fullness);

    // All that was added since belongs to the first room.
    const std::size_t ends[] = {scene.objects.size(), scene.faces.size(), scene.lamps.size(),
                                plan_.things.size()};

    for (std::size_t i = 1; i < like.size(); ++i) {
      const Vector2d way = plan_.rooms[static_cast<std::size_t>(like[i])].faces[0].from -
                           plan_.rooms[static_cast<std::size_t>(like[0])].faces[0].from;
      const Vector3d shift(way.x(), way.y(), 0.0);

      const std::size_t base = scene.objects.size();
      const auto name = [&](std::size_t object) {
        return fmt::format("{} {}", scene.objects[object].type, base + object - objects + 1);
      };

      // Objects first, for faces refer to them.
      for (std::size_t k = objects; k < ends[0]; ++k) {
        scene.objects.push_back(scene.objects[k]);
        scene.objects.back().name = name(k);
      }

      for (std::size_t k = faces; k < ends[1]; ++k) {
        Face face = scene.faces[k];
        const auto object = static_cast<std::size_t>(face.object);
        const std::string& type = scene.objects[object].type;
        face.origin += shift;
        face.object = static_cast<int>(base + object - objects);

        // Prints differ, unless the rooms are copies.
        if (!plan_.copies &&
            (type == "poster" || type == "picture" || type == "sign" || type == "whiteboard"))
          face.seed = face.object + 1;
        scene.faces.push_back(std::move(face));
      }

      for (std::size_t k = lamps; k < ends[2]; ++k) {
        scene.lamps.push_back(scene.lamps[k]);
        scene.lamps.back().center += shift;
      }

      // The plan lists the copies too.
      for (std::size_t k = things; k < ends[3]; ++k) {
        PlanThing thing = plan_.things[k];
        for (Vector2d& p : thing.outline) p += way;
        thing.room = like[i];
        for (std::size_t j = objects; j < ends[0]; ++j) {
          if (scene.objects[j].name == thing.name) thing.name = name(j);
        }

        ground_.block(thing.outline, thing.top > 1.4);
        plan_.things.push_back(std::move(thing));
      }
    }
  }

 private:
  [[nodiscard]] const PlanRoom& room() const { return plan_.rooms[static_cast<std::size_t>(room_)]; }

  /// The floor before doors and passages, and the faces' parts that openings take.
  void keep_free(int room) {
    hung_.emplace_back();
    for (const PlanFace& face : plan_.rooms[static_cast<std::size_t>(room)].faces) {
      hung_.back().emplace_back();
      for (const PlanOpening& o : plan_.openings) {
        const auto part = part_of_face(plan_, room, face, o);
        if (!part) continue;
        hung_.back().back().push_back({part->first - 0.1, part->second + 0.1});

        if (o.kind != OpeningKind::kDoor && o.kind != OpeningKind::kPassage) continue;
        const Rigid3 f = face_frame(face);
        const double yaw = std::atan2(f.rotation(1, 0), f.rotation(0, 0));
        const double reach = o.leaf == Leaf::kSliding ? 0.9 * o.width() : 0.1;
        taken_.push_back(rectangle(f.translation.head<2>(), yaw,
                                   {part->first - 0.1, -std::max(0.95, o.front == room ? o.width() : 0.0)},
                                   {part->second + reach, 0.1}));
      }
    }
  }

  void add(const Rule& rule) {
    // Several attempts, for rooms fill up.
    for (int tries = 0; tries < 8; ++tries) {
      const auto face = static_cast<std::size_t>(rng_.integer(0, static_cast<int>(room().faces.size()) - 1));
      Item item{&rule,
                face_frame(room().faces[face]),
                {rng_.uniform(rule.width[0], rule.width[1]), rng_.uniform(rule.depth[0], rule.depth[1]),
                 std::min(rng_.uniform(rule.height[0], rule.height[1]), room().height - 0.02)},
                pick_word(rule.materials, rng_)};
      if (rule.type == "column") item.size.z() = room().height;
      if (rule.place == "hanging" ? hang(item, face) : stand(item, face)) return;
    }
  }

  bool hang(Item& item, std::size_t face) {
    const double length = (room().faces[face].from - room().faces[face].to).norm();
    const double free = length - item.size.x() - 0.2;
    if (free < 0.0) return false;
    const double x = 0.1 + rng_.uniform(0.0, free), z = rng_.uniform(1.45, 1.7);

    // Things on one wall must not overlap.
    const Range part{x - 0.06, x + item.size.x() + 0.06};
    auto& hung = hung_[static_cast<std::size_t>(room_)][face];
    if (std::any_of(hung.begin(), hung.end(), [&](const Range& r) { return overlap(r, part); })) return false;

    hung.push_back(part);
    item.frame = placed(item.frame, {x + 0.5 * item.size.x(), 0.0, z}, {0.0, Vector3d::UnitZ()});
    const bool framed = item.rule->type == "picture" || item.rule->type == "whiteboard";
    begin(item.rule->type);
    add_panel(b_, item.frame,
              {item.size.x(), item.size.z(), 0.008, item.material, framed ? "metal" : "paint_white", framed});
    return true;
  }

  bool stand(Item& item, std::size_t face) {
    const double length = (room().faces[face].from - room().faces[face].to).norm();
    const Vector2d half = 0.5 * item.size.head<2>();

    // With its back to the wall.
    if (item.rule->place == "wall") {
      const double x = rng_.uniform(half.x() + 0.02, std::max(half.x() + 0.02, length - half.x() - 0.02));
      item.frame = placed(item.frame, {x, -half.y() - 0.03, 0.0}, {0.0, Vector3d::UnitZ()});
    } else {
      // Anywhere in the room, mostly parallel to it.
      Eigen::AlignedBox2d box;
      for (const PlanFace& f : room().faces) box.extend(f.from);
      const double turn =
          rng_.integer(0, 3) * 0.5 * M_PI + (rng_.chance(0.3) ? rng_.uniform(-0.4, 0.4) : 0.0);
      item.frame.translation = {rng_.uniform(box.min().x(), box.max().x()),
                                rng_.uniform(box.min().y(), box.max().y()), 0.0};
      item.frame = placed(item.frame, Vector3d::Zero(), {turn, Vector3d::UnitZ()});
    }

    const std::string type = item.rule->type;
    if (!put(type, item.frame, half, item.size.z())) return false;

    begin(type);
    add_thing(b_, type, item.frame, item.size, item.material);
    add_company(item);

    // Nothing hangs behind a high thing, where it would not be seen.
    if (item.rule->place == "wall" && item.size.z() > 1.0) {
      const double x = (item.frame.translation - face_frame(room().faces[face]).translation)
                           .dot(item.frame.rotation.col(0));
      hung_[static_cast<std::size_t>(room_)][face].push_back({x - half.x(), x + half.x()});
    }

    return true;
  }

  /// Takes the floor for a thing; false if it is not free or if people could not get everywhere any more.
  bool put(const std::string& type, const Rigid3& frame, const Vector2d& half, double height) {
    const double yaw = std::atan2(frame.rotation(1, 0), frame.rotation(0, 0));
    const Vector2d at = frame.translation.head<2>();
    const std::vector<Vector2d> outline = rectangle(at, yaw, -half, half);
    if (!free(outline, height)) return false;

    if (!ground_.try_block(outline, height > 1.4, room().outline(), ways_of(plan_, room_), kLeastFloor))
      return false;
    taken_.push_back(outline);
    plan_.things.push_back(
        {fmt::format("{} {}", type, b_.scene().objects.size() + 1), type, outline, 0.0, height, room_});
    return true;
  }

  [[nodiscard]] bool free(const std::vector<Vector2d>& outline, double height) const {
    const auto inside = [&](const Vector2d& p) { return room().contains(p); };
    if (!std::all_of(outline.begin(), outline.end(), inside)) return false;
    for (const PlanFace& f : room().faces) {  // an inward corner within it
      const Vector2d d = f.from - outline[0], u = outline[1] - outline[0], v = outline[3] - outline[0];
      if (d.dot(u) > 0.0 && d.dot(u) < u.squaredNorm() && d.dot(v) > 0.0 && d.dot(v) < v.squaredNorm())
        return false;
    }

    // Neither on furniture nor in front of openings.
    if (std::any_of(taken_.begin(), taken_.end(), [&](const auto& other) { return overlap(outline, other); }))
      return false;
    return std::none_of(plan_.openings.begin(), plan_.openings.end(),
                        [&](const PlanOpening& o) { return height > o.sill && before(o, outline); });
  }

  /// True if a thing stands directly before an opening of the room.
  [[nodiscard]] bool before(const PlanOpening& o, const std::vector<Vector2d>& outline) const {
    const PlanWall& wall = plan_.walls[static_cast<std::size_t>(o.wall)];
    const double yaw = std::atan2(wall.direction.y(), wall.direction.x()), y = 0.5 * wall.thickness + 0.25;
    return (o.front == room_ || o.back == room_) &&
           overlap(outline, rectangle(wall.origin, yaw, {o.from, -y}, {o.to, y}));
  }

  /// Things on it and chairs before it.
  void add_company(const Item& item) {
    const Vector3d& s = item.size;
    for (const char* with = item.rule->with.c_str(); *with != 0; ++with) {
      if (*with == 'm' && rng_.chance(0.8)) {
        begin("monitor");
        add_monitor(b_,
                    placed(item.frame, {rng_.uniform(-0.2, 0.2), 0.18, s.z()},
                           {rng_.uniform(-0.2, 0.2), Vector3d::UnitZ()}),
                    rng_.uniform(0.45, 0.65), true);
      }
      if (*with == 'c' && rng_.chance(0.8)) {
        begin("clutter");
        add_clutter(b_, placed(item.frame, {0.0, -0.12 * s.y(), s.z()}, {0.0, Vector3d::UnitZ()}),
                    0.85 * s.x(), 0.4 * s.y(), rng_.integer(2, 5));
      }
      if (*with == 'h') add_chairs(item, with[1] == 'h');
    }
  }

  void add_chairs(const Item& item, bool behind) {
    const double side = behind ? 1.0 : -1.0;
    const int count = item.rule->place == "middle" ? std::max(1, static_cast<int>(item.size.x() / 0.8)) : 1;
    for (int i = 0; i < count; ++i) {
      const double x = ((i + 0.5) / count - 0.5) * item.size.x(), y = side * (0.5 * item.size.y() + 0.36);
      const Rigid3 frame = placed(item.frame, {x, y, 0.0}, {side < 0.0 ? M_PI : 0.0, Vector3d::UnitZ()});
      const Rigid3 turned = placed(frame, Vector3d::Zero(), {rng_.uniform(-0.3, 0.3), Vector3d::UnitZ()});

      // Some places stay empty.
      if (!rng_.chance(0.8) || !put("chair", turned, {0.31, 0.31}, 1.05)) continue;
      begin("chair");
      add_chair(b_, turned, rng_.chance(0.6) ? "fabric" : "sofa");
    }
  }

  void begin(const std::string& type) { b_.begin_object(type, "", b_.scene().objects.front().mark); }

  Plan& plan_;
  Ground& ground_;
  Rng& rng_;
  Builder& b_;
  int room_ = 0;
  std::vector<std::vector<Vector2d>> taken_;           ///< outlines on the floor, of all rooms
  std::vector<std::vector<std::vector<Range>>> hung_;  ///< by room and face: parts that are taken
};

}  // namespace

void add_thing(Builder& b, const std::string& type, const Rigid3& frame, const Vector3d& s,
               const std::string& material) {
  const Vector2d half = 0.5 * s.head<2>();

  // Pieces with parts.
  if (type == "desk") add_desk(b, frame, s, material);
  if (type == "chair") add_chair(b, frame, material);
  if (type == "table") add_table(b, frame, s, material);
  if (type == "shelf") add_shelf(b, frame, s, material, true);
  if (type == "sofa") add_sofa(b, frame, s, material);
  if (type == "cabinet") add_cabinet(b, frame, s, material, std::max(1, static_cast<int>(s.x() / 0.55)));
  if (type == "plant") add_plant(b, frame, s.z());
  if (type == "floor_lamp") add_floor_lamp(b, frame, s.z(), 1.5);

  // A plain block.
  if (type == "box" || type == "column")
    b.box(frame, {-half.x(), -half.y(), 0.0}, {half.x(), half.y(), s.z()}, {material});

  // Frame, mattress, headboard and pillow.
  if (type == "bed") {
    b.box(frame, {-half.x(), -half.y(), 0.08}, {half.x(), half.y(), 0.55 * s.z()}, {"wood"});
    b.box(frame, {-half.x() + 0.02, -half.y() + 0.02, 0.55 * s.z()},
          {half.x() - 0.02, half.y() - 0.06, s.z()}, {material});
    b.box(frame, {-half.x(), half.y() - 0.05, 0.0}, {half.x(), half.y(), s.z() + 0.45}, {"wood"});
    b.box(frame, {-0.3, half.y() - 0.5, s.z()}, {0.3, half.y() - 0.1, s.z() + 0.1}, {"cloth"});
  }
}

void furnish(Plan& plan, Ground& ground, Rng& rng, Builder& builder) {
  Furnisher furnisher(plan, ground, rng, builder);
  const double usual = rng.uniform(0.1, 1.0);
  for (std::size_t i = 0; i < plan.rooms.size(); ++i) {
    // Some rooms stay empty.
    const double fullness = rng.chance(0.08) ? 0.0 : std::min(1.0, usual * rng.uniform(0.6, 1.4));
    const bool like =
        std::find(plan.alike.begin(), plan.alike.end(), static_cast<int>(i)) != plan.alike.end();
    if (!like) furnisher.fill(static_cast<int>(i), fullness);
    if (like && static_cast<int>(i) == plan.alike.front()) furnisher.fill_alike(std::max(0.4, fullness));
  }
  ground.recompute();
}

}  // namespace plumbline::synth
