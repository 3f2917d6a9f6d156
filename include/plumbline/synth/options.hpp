// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Options for filming a world.
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::synth {

enum class Texture { kFull, kWeak, kNone };
enum class Sensor { kIdeal, kKinect, kRealsense, kTof, kStructured, kStereo, kPhone };
enum class Motion { kScene, kHandheld, kWheeled };                  ///< kScene: as the scene file says
enum class Route { kScene, kTour, kLaps, kWander, kThereAndBack };  ///< kScene: as the file says, else a tour

struct SynthOptions {
  int frames = -1;             ///< per robot; -1: the path once; more than the path has: it starts again
  int repeat = 1;              ///< rounds of the path; one is rendered, the others are its frames again
  int robots = 1;              ///< number of recordings
  int layout = -1;             ///< number of a world that is made from it; -1: the scene as its file says
  int floors = 3;              ///< storeys of a building
  int rooms = 10;              ///< of each storey of a building, besides corridor and stairs
  int like = 0;                ///< rooms with the same walls and furniture, of an office or of each storey
  int copies = 0;              ///< the same with the same posters
  Route path = Route::kScene;  ///< through a world made from a number
  std::string changes;         ///< a seed or a file of edits: the same world another day; "": as it is
  bool hall = false;           ///< one room of an office or building is 20 m long
  bool lift = false;           ///< of a building, in place of its stairs
  int moving_doors = 0;        ///< at most so many doors of a world made from a number swing meanwhile
  int moving_drawers = 0;      ///< at most so many drawers of desks slide out and back meanwhile
  int walkers = 0;             ///< number of the scene's walkers to film; they are not in reference.ply
  int tags = 0;                ///< AprilTags on walls that the cameras pass, numbers from 0
  int tag_copies = 0;          ///< so many of their first numbers hang a second time elsewhere
  Texture texture = Texture::kFull;  ///< kNone: white cloth and grey floors, geometry unchanged
  Sensor sensor = Sensor::kKinect;   ///< kIdeal: no noise, no offset between stamps, no blur
  Motion motion = Motion::kScene;
  int seed = 1;  ///< of textures, sway and all noise
  int width = 640;
  int height = 480;
  double fps = 30.0;
  double speed = 1.0;          ///< factor on the scene's speed
  double readout_s = 0.0;      ///< rolling shutter of the colour camera: first to last row; 0: all at once
  double depth_delay_s = 0.0;  ///< delay of depth images after their stamps
  double reference_spacing = 0.0;  ///< m between samples of reference.ply; 0 = 5 mm, more for large scenes
  double visible_range = 4.0;      ///< m; as far as the shipped pipelines use depth, and the sensor's range
  /// Hard moments, "kind@start+duration[*value]" in seconds from the first frame, separated by commas; added
  /// to those of the scene. Kinds: whiteout, lampoff, blur (value px, default 8), drop, cover, spin (value
  /// turns, default 1: pure rotation on the spot), nodepth. Example: "whiteout@3+1,blur@6+0.5*12".
  std::string events;
  /// The recording's camera file is wrong: a seed, from which errors are drawn, or differences from the
  /// truth, "fx=1.5%,cx=3,k1=0.03,slope=0.02,readout=10ms,delay=15ms"; "": it is right. Pictures do not
  /// change.
  std::string camera_error;
  /// Faults of depth, "offset=0.01,scale=1%,holes,mirrors"; a name alone has its usual strength.
  std::string depth_faults;
  std::string color_faults;  ///< of colour, "hunting,flicker=100" likewise
  int depth_width = 0;       ///< of depth images, registered to colour; 0: as colour, or 256 x 192 of a phone
  int depth_height = 0;
  std::string imu;       ///< write imu.csv: "ideal" or "usual", and settings, "usual,delay=5ms"; "": none
  std::string odometry;  ///< write odometry.csv, likewise
  std::string rig;       ///< YAML file of several cameras on one body, each a recording; "": one
  bool mcap = false;     ///< write each recording as an MCAP file instead of a folder of pictures
  bool moving_masks = false;  ///< write moving/: pictures of what moves

  void declare(core::OptionTable& table);
};

enum class EventKind { kWhiteout, kLampOff, kBlur, kDrop, kCover, kSpin, kNoDepth };

/// One hard moment: [start, start + duration) seconds from the first frame.
struct Event {
  EventKind kind = EventKind::kWhiteout;
  double start_s = 0.0;
  double duration_s = 0.0;
  double value = 0.0;  ///< kBlur: pixels; kSpin: turns; others unused

  [[nodiscard]] bool active(double t) const { return t >= start_s && t < start_s + duration_s; }
};

/// Errors (kUsage) name the piece that could not be read, with a suggestion.
core::Result<std::vector<Event>> parse_events(const std::string& text);

/// Ranges are the option table's; this checks what a table cannot: events, images of no sensible shape.
core::Result<void> check(const SynthOptions& options);

const char* to_string(Texture texture);
const char* to_string(Sensor sensor);
const char* to_string(Motion motion);
const char* to_string(Route route);
const char* to_string(EventKind kind);

}  // namespace plumbline::synth
