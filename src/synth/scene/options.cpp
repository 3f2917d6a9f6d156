// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/synth/options.hpp"

#include <fmt/format.h>

#include <cmath>

#include "plumbline/core/config.hpp"
#include "plumbline/core/numbers.hpp"
#include "scene/camera_error.hpp"
#include "scene/faults.hpp"
#include "scene/rig.hpp"

namespace plumbline::synth {

void SynthOptions::declare(core::OptionTable& table) {
  table.integer("frames", frames, {-1, 1000000}, "", "Frames of each robot; -1 = the path once");
  table.integer("repeat", repeat, {1, 1000}, "",
                "Rounds of the path: one is rendered, the others are its frames again with later stamps");
  table.integer("robots", robots, {1, 64}, "", "Number of recordings");
  table.integer(
      "layout", layout, {-1, 2147483647}, "",
      "Number from which a home, office, corridor or building is made; -1 = the scene as its file says");

  table.integer("floors", floors, {1, 8}, "", "Storeys of a building that is made from a number");
  table.integer("rooms", rooms, {4, 60}, "", "Rooms of each of its storeys");
  table.integer(
      "like", like, {0, 12}, "",
      "Rooms alike in an office or on each storey of a building: the same walls and furniture, their "
      "own posters");
  table.integer("copies", copies, {0, 12}, "", "The same with the same posters");
  table.boolean("hall", hall, "One room of an office, or of a building's lowest storey, is 20 m long");
  table.boolean("lift", lift, "A building has a lift in place of stairs; one robot rides in it");

  table.choice(
      "path", path,
      {{"scene", Route::kScene},
       {"tour", Route::kTour},
       {"laps", Route::kLaps},
       {"wander", Route::kWander},
       {"there-and-back", Route::kThereAndBack}},
      "Path through a world made from a number: all rooms, a loop through some, random places, or to "
      "the other end and back; scene: as the scene file says, else a tour");

  table.text(
      "changes", changes,
      "The same world another day: a seed, or a YAML file of edits; what has changed is in changes.json");

  table.integer(
      "moving_doors", moving_doors, {0, 40}, "",
      "At most so many doors of a world made from a number swing while it is filmed; events.csv tells "
      "when");
  table.integer("moving_drawers", moving_drawers, {0, 40}, "",
                "At most so many drawers of desks slide out and back while it is filmed");
  table.integer("walkers", walkers, {0, 20}, "",
                "Number of people who walk about: filmed, but no part of reference.ply");

  table.integer("tags", tags, {0, 60}, "",
                "AprilTags 36h11 of 16 cm on walls where the cameras pass; scene.json has their places");
  table.integer("tag_copies", tag_copies, {0, 60}, "",
                "First numbers of these tags that hang a second time elsewhere");

  table.choice("texture", texture,
               {{"full", Texture::kFull}, {"weak", Texture::kWeak}, {"none", Texture::kNone}},
               "Strength of textures; none: white cloth and grey floors");

  table.choice("sensor", sensor,
               {{"ideal", Sensor::kIdeal},
                {"kinect", Sensor::kKinect},
                {"realsense", Sensor::kRealsense},
                {"tof", Sensor::kTof},
                {"structured", Sensor::kStructured},
                {"stereo", Sensor::kStereo},
                {"phone", Sensor::kPhone}},
               "Camera model; ideal: no noise, no offset between stamps, no blur");

  table.choice("motion", motion,
               {{"scene", Motion::kScene}, {"handheld", Motion::kHandheld}, {"wheeled", Motion::kWheeled}},
               "Motion of the camera; scene: as the scene file says");
  table.integer("seed", seed, {0, 2147483647}, "", "Seed of textures, sway and noise");

  table.integer("width", width, {64, 4096}, "px", "Picture width");
  table.integer("height", height, {48, 4096}, "px", "Picture height");
  table.number("fps", fps, {1.0, 240.0}, "Hz", "Frames per second");
  table.number("speed", speed, {0.05, 20.0}, "", "Speed factor");
  table.number("readout", readout_s, {0.0, 0.1}, "s",
               "Rolling shutter of the colour camera: time from the first row to the last; stamps are those "
               "of the middle row");

  table.number("depth_delay", depth_delay_s, {-0.1, 0.1}, "s", "Delay of depth images after their stamps");
  table.number("reference_spacing", reference_spacing, {0.0, 1.0}, "m",
               "Distance between samples of reference.ply; 0 = 5 mm, more for large scenes");
  table.number("visible_range", visible_range, {0.5, 20.0}, "m",
               "Largest distance from a camera at which a sample of reference.ply counts as visible");
  table.text("events", events,
             "Difficult moments, kind@start+duration[*value] in seconds, separated by commas; kinds: "
             "whiteout, lampoff, blur (value px), drop, cover, spin (value turns), nodepth");

  table.text("camera_error", camera_error,
             "Errors of the recording's camera file: a seed that draws some, or differences from the truth, "
             "such as fx=1.5%,cx=3,k1=0.03,slope=0.02,readout=10ms,delay=15ms (also fy, cy, k2, p1, p2, k3, "
             "slope_y)");
  table.text(
      "depth_faults", depth_faults,
      "Faults of depth, key or key=value, separated by commas: offset (1/m), scale, radial, drift, ray, "
      "holes, multipath (m), flying, stripes, mirrors; a key alone has its usual strength");

  table.text(
      "color_faults", color_faults,
      "Faults of colour, key or key=value, separated by commas: hunting, jumps, flicker (Hz), motion_blur "
      "(s), dots, specks; a key alone has its usual strength");
  table.integer("depth_width", depth_width, {0, 4096}, "px",
                "Width of depth images, registered to colour; 0: as colour, of a phone 256");

  table.integer("depth_height", depth_height, {0, 4096}, "px", "Height of depth images");
  table.text(
      "imu", imu,
      "Write imu.csv: ideal or usual, then settings, such as usual,gyro_bias=0.01,delay=5ms (rate, "
      "gyro_noise, gyro_bias, gyro_walk, accel_noise, accel_bias, accel_walk, scale, misalign, delay, gaps)");

  table.text("odometry", odometry,
             "Write odometry.csv of wheels: ideal or usual, then settings (rate, scale, turn, noise, slip)");
  table.text("rig", rig, "YAML file with the cameras of one body: each makes a recording of the same path");
  table.choice("out_format", mcap, {{"folder", false}, {"mcap", true}},
               "Write a folder of pictures or an MCAP file for each recording");
  table.boolean("moving_masks", moving_masks,
                "Write moving/: a mask for each colour picture, white where something moves");
}

namespace {

struct KindName {
  const char* name;
  EventKind kind;
  double default_value;
};
constexpr KindName kKinds[] = {
    {"whiteout", EventKind::kWhiteout, 1.0}, {"lampoff", EventKind::kLampOff, 1.0},
    {"blur", EventKind::kBlur, 8.0},         {"drop", EventKind::kDrop, 1.0},
    {"cover", EventKind::kCover, 1.0},       {"spin", EventKind::kSpin, 1.0},
    {"nodepth", EventKind::kNoDepth, 1.0},
};

bool read_number(const std::string& text, double& value) {
  const auto number = core::to_number(text);
  value = number.value_or(0.0);
  return number && std::isfinite(value);
}

std::string trim(const std::string& s) {
  const auto first = s.find_first_not_of(" \t\n");
  return first == std::string::npos ? "" : s.substr(first, s.find_last_not_of(" \t\n") - first + 1);
}

core::Result<Event> parse_event(const std::string& text) {
  const auto at = text.find('@'), plus = text.find('+', at == std::string::npos ? 0 : at),
             star = text.find('*');
  const std::string name = trim(text.substr(0, at));

  // Names are collected for a hint.
  std::vector<std::string> names;
  const KindName* kind = nullptr;
  for (const KindName& k : kKinds) {
    names.emplace_back(k.name);
    if (name == k.name) kind = &k;
  }

  if (kind == nullptr) {
    return core::usage_error(
        fmt::format("events: '{}' is not a kind of event{}", name, core::hint(name, names)));
  }

  // Numbers between the separators.
  Event event{kind->kind, 0.0, 0.0, kind->default_value};
  const bool formed =
      at != std::string::npos && plus != std::string::npos && (star == std::string::npos || star > plus) &&
      read_number(trim(text.substr(at + 1, plus - at - 1)), event.start_s) &&
      read_number(trim(text.substr(plus + 1, star == std::string::npos ? star : star - plus - 1)),
                  event.duration_s) &&
      (star == std::string::npos || read_number(trim(text.substr(star + 1)), event.value));

  if (!formed || event.start_s < 0.0 || event.duration_s <= 0.0 || std::abs(event.value) > 100.0) {
    return core::usage_error(fmt::format(
        "events: '{}' is not kind@start+duration[*value] in seconds, such as blur@6+0.5*12", text));
  }

  return event;
}

}  // namespace

core::Result<std::vector<Event>> parse_events(const std::string& text) {
  std::vector<Event> events;
  std::size_t from = 0;
  while (from <= text.size()) {
    std::size_t to = text.find(',', from);
    if (to == std::string::npos) to = text.size();
    const std::string piece = trim(text.substr(from, to - from));
    if (!piece.empty()) {
      auto event = parse_event(piece);
      if (!event) return tl::unexpected<core::Error>(event.error());
      events.push_back(*event);
    }
    from = to + 1;
  }
  return events;
}

core::Result<void> check(const SynthOptions& options) {
  // Ranges of numbers.
  if (options.frames == 0)
    return core::usage_error("frames: zero frames are not a recording (-1: the path once)");
  if (options.robots < 1) return core::usage_error("robots: at least 1 is needed");
  if (options.width < 64 || options.height < 48)
    return core::usage_error("width, height: at least 64 x 48 pixels");
  if (!(options.fps > 0.0) || !(options.speed > 0.0))
    return core::usage_error("fps, speed: must be positive");

  if (options.tag_copies > options.tags) {
    return core::usage_error(fmt::format("tag_copies: {} of {} tags cannot hang twice; raise tags",
                                         options.tag_copies, options.tags));
  }

  // Texts with settings must be readable.
  if (auto events = parse_events(options.events); !events) return tl::unexpected<core::Error>(events.error());
  if (auto faults = depth_faults(options.depth_faults); !faults)
    return tl::unexpected<core::Error>(faults.error());
  if (auto faults = color_faults(options.color_faults); !faults)
    return tl::unexpected<core::Error>(faults.error());
  if (auto imu = imu_model(options.imu); !imu) return tl::unexpected<core::Error>(imu.error());
  if (auto wheels = odometry_model(options.odometry); !wheels)
    return tl::unexpected<core::Error>(wheels.error());
  if (auto rig = read_rig(options); !rig) return tl::unexpected<core::Error>(rig.error());

  // Settings that belong together.
  if ((options.depth_width > 0) != (options.depth_height > 0))
    return core::usage_error("depth_width, depth_height: give both or none");
  if (auto error = camera_error(options.camera_error, 0, options.width); !error)
    return tl::unexpected<core::Error>(error.error());
  return {};
}

const char* to_string(EventKind kind) {
  for (const KindName& k : kKinds) {
    if (k.kind == kind) return k.name;
  }
  return "";
}
const char* to_string(Texture texture) {
  return texture == Texture::kFull ? "full" : texture == Texture::kWeak ? "weak" : "none";
}
const char* to_string(Sensor sensor) {
  constexpr const char* kNames[] = {"ideal", "kinect", "realsense", "tof", "structured", "stereo", "phone"};
  return kNames[static_cast<int>(sensor)];
}
const char* to_string(Route route) {
  switch (route) {
    case Route::kScene:
      return "scene";
    case Route::kTour:
      return "tour";
    case Route::kLaps:
      return "laps";
    case Route::kWander:
      return "wander";
    case Route::kThereAndBack:
      return "there-and-back";
  }
  return "";
}
const char* to_string(Motion motion) {
  return motion == Motion::kScene ? "scene" : motion == Motion::kHandheld ? "handheld" : "wheeled";
}

}  // namespace plumbline::synth
