// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Stage: one node of a pipeline graph. A stage type declares typed ports and options; the graph connects
// them.
//
//   read ──frame──▶ features ──features──▶ track ──track──▶ cloud ──keyframe_cloud──▶ fuse ──cloud──▶ output
//
// Adding a stage: derive from Stage in src/pipeline/stages/stage_<name>.cpp, describe it in a StageType, add
// one line to register_stages() (src/pipeline/stages/registry.cpp). A new port type needs a tap as well
// (src/pipeline/taps/tap_<name>.cpp).
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>
#include <typeindex>
#include <utility>
#include <vector>

#include "plumbline/cloud/filters/filter.hpp"
#include "plumbline/core/config.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/core/stop.hpp"

namespace plumbline::dataset {
class FrameSource;
}

namespace plumbline::exports {
struct ExportRequest;
}

namespace plumbline::features {
struct FrameFeatures;
}

namespace plumbline::sensor {
struct RgbdFrame;
}

namespace plumbline::localize {
struct LocalizationMap;
}

namespace plumbline::mapping {
class OtherMapsInbox;
}

namespace plumbline::maps {
class Map;
struct RobotInfo;
class StoredMaps;
}  // namespace plumbline::maps

namespace plumbline::pipeline {

class RunObserver;
struct ResumedRun;
struct Rig;
class RobotRecordings;

/// Rate at which a port carries values.
enum class Rate {
  kFrame,  ///< once per frame; some frames have no value (unreadable, no keyframe ...)
  kEnd,    ///< once, after the last frame
};

/// Type of the values of a port: a name for users and the C++ type behind it.
struct PortType {
  std::string name;
  std::type_index type;
  Rate rate = Rate::kFrame;

  friend bool operator==(const PortType& a, const PortType& b) {
    return a.name == b.name && a.type == b.type && a.rate == b.rate;
  }
};

template <typename T>
PortType port_type(std::string name, Rate rate = Rate::kFrame) {
  return {std::move(name), std::type_index(typeid(T)), rate};
}

struct Port {
  std::string name;
  PortType type;
  bool required = true;  ///< input that must be connected, and hold a value for the stage to be called
};

using Value = std::shared_ptr<const void>;

/// The values one call of a stage reads and writes. Values are shared and never change once written.
class StageIo {
 public:
  StageIo(std::size_t frame, const std::vector<Port>& inputs, const std::vector<Port>& outputs)
      : frame_(frame), inputs_(inputs), outputs_(outputs), in_(inputs.size()), out_(outputs.size()) {}

  [[nodiscard]] std::size_t frame() const { return frame_; }  ///< number of the frame within this run

  /// Null if the input is optional and has no value.
  template <typename T>
  [[nodiscard]] std::shared_ptr<const T> input(const std::string& name) const {
    return std::static_pointer_cast<const T>(in_[find<T>(inputs_, name)]);
  }
  /// Sets an output; an output that is not set has no value for this frame.
  template <typename T>
  void output(const std::string& name, std::shared_ptr<const T> value) {
    out_[find<T>(outputs_, name)] = std::move(value);
  }

  std::vector<Value>& input_values() { return in_; }    ///< for the engine
  std::vector<Value>& output_values() { return out_; }  ///< for the engine

 private:
  template <typename T>
  static std::size_t find(const std::vector<Port>& ports, const std::string& name) {
    for (std::size_t i = 0; i < ports.size(); ++i) {
      if (ports[i].name == name && ports[i].type.type == std::type_index(typeid(T))) return i;
    }
    throw std::logic_error("stage has no port " + name + " of this type");
  }

  std::size_t frame_;
  const std::vector<Port>& inputs_;
  const std::vector<Port>& outputs_;
  std::vector<Value> in_;
  std::vector<Value> out_;
};

/// Largest number of frames processed at the same time, for any number of threads.
constexpr std::size_t kMostUnderWay = 64;

/// Input of a run.
struct RunInput {
  const dataset::FrameSource* source = nullptr;          ///< input of a read stage; null: there is none
  RobotRecordings* recordings = nullptr;                 ///< `source`, when recordings are mapped; else null
  const maps::StoredMaps* stored_maps = nullptr;         ///< input of a maps stage; null: there is none
  const std::vector<maps::RobotInfo>* robots = nullptr;  ///< robots of the recordings or maps, by number
  std::shared_ptr<const localize::LocalizationMap>
      known_map;             ///< map of a localize stage; null: there is none
  bool into = false;         ///< the other stored maps are visits of the first one
  std::string anchor;        ///< robot that defines the common frame of finished maps; empty: any
  const Rig* rig = nullptr;  ///< cameras that are fixed to each other; null: none
  std::string text;          ///< text that identifies what is mapped
};

/// Data kept in map.db.
struct RunStore {
  std::string configuration;  ///< effective configuration, YAML; the same for any number of threads
  bool keeps_map = false;     ///< true if a stage has keeps_map()
  bool keeps_clouds = false;  ///< true if that stage also gets the clouds to be fused
};

/// Hooks of callers that change a run or observe it.
struct RunHooks {
  std::filesystem::path debug_folder;                       ///< folder for debug pictures; empty: none
  std::shared_ptr<const mapping::OtherMapsInbox> feedback;  ///< MapRequest::feedback
  /// For tests: changes the map when tracking has ended; may be empty.
  std::function<void(maps::Map&)> alter_map;
  RunObserver* observer = nullptr;                    ///< observer of the run; null: none
  std::function<void(const std::string&)> finishing;  ///< RunRequest::finishing
};

/// Work that a stage does for others besides its outputs.
struct RunServices {
  /// The features of a robot's frame, as the pipeline finds them; empty: it has no such stage. May be called
  /// from several threads at a time.
  std::function<std::shared_ptr<const features::FrameFeatures>(const sensor::RgbdFrame&, std::int32_t robot)>
      features;
};

/// Resources that a run lends to its stages; outlives them.
struct RunContext {
  const core::Executor* executor = nullptr;
  core::Log* log = nullptr;
  core::StopToken stop;
  std::filesystem::path output_folder;  ///< where sinks write
  RunInput input;
  const ResumedRun* resumed = nullptr;  ///< results of the resumed run; null: none
  RunStore store;
  RunHooks hooks;
  std::shared_ptr<RunServices> services = std::make_shared<RunServices>();  ///< filled by starting stages
  core::StopToken asked;  ///< by the user; `stop` is another one for sources that end by themselves
};

/// Why a result must not be trusted.
struct Doubt {
  /// The gravest first, but kRecording before all others, as their cause. Only the first one is the reason,
  /// lost frames together with separate components (summary/verdict.cpp).
  enum class About {
    kLostFrames,
    kComponents,
    kTornMap,
    kDisputedLoops,
    kEmptyCloud,
    kUnconnectedMaps,
    kRecording,
    kCamera
  };
  About about = About::kLostFrames;
  std::string text;
};

/// Times of one stage, milliseconds.
struct StageTiming {
  std::string name;
  std::vector<float> frame_ms;  ///< one per frame; NaN: the stage had nothing to do
  double finish_ms = 0.0;

  [[nodiscard]] double quantile_ms(double q) const;  ///< over the frames that the stage processed; 0: none
};

/// Information that a stage may use while the graph is checked.
struct CheckContext {
  std::filesystem::path pipeline_folder;           ///< folder of the pipeline file
  std::filesystem::path pipelines_folder;          ///< shipped pipelines, filters and cameras
  const cloud::FilterRegistry* filters = nullptr;  ///< filters that chains may contain

  /// A file named in a pipeline: absolute, beside the pipeline file, or shipped. Empty when there is none.
  [[nodiscard]] std::filesystem::path find(const std::string& file) const;
  /// The same for a value that was set at `mark`: a value of an included pipeline is searched beside that
  /// pipeline first, a value of --set in the working directory first.
  [[nodiscard]] std::filesystem::path find(const std::string& file, const core::ConfigMark& mark) const;
};

/// Life of a stage: constructed, declare, check, start, process once a frame, finish, settle, report,
/// doubt.
class Stage {
 public:
  virtual ~Stage() = default;

  /// Binds the options; called once.
  virtual void declare(core::OptionTable& /*table*/) {}
  /// Checks that involve more than one option, such as files named by options. `mark` and `path` are the
  /// stage's; a problem of path `path`.key is reported at the position of the key's value.
  virtual void check(const CheckContext& /*context*/, const core::ConfigMark& /*mark*/,
                     const std::string& /*path*/, core::ConfigProblems& /*problems*/) {}
  /// Files that will be written, relative to the result folder ('*' = a number); no two stages may write the
  /// same one. Called after check.
  [[nodiscard]] virtual std::vector<std::string> files() const { return {}; }
  /// True if the stage writes the map with its clouds to map.db as they come, for which it needs
  /// TrackedFrame::changes. Called after check.
  [[nodiscard]] virtual bool keeps_map() const { return false; }
  virtual core::Result<void> start(const RunContext& /*context*/) { return {}; }
  /// Number of frames of a source; called after start.
  [[nodiscard]] virtual std::size_t frames() const { return 0; }
  /// One frame, when all required per-frame inputs hold a value. Stateless stages are called from several
  /// threads at a time and in any order, serial ones in frame order. An error ends the run; a problem
  /// of this frame only is logged, and the outputs are not set.
  virtual core::Result<void> process(StageIo& /*io*/) { return {}; }
  /// Called after the last frame, in graph order; reads and writes the ports of Rate::kEnd. Stages that
  /// export and do not need one another finish at the same time.
  virtual core::Result<void> finish(StageIo& /*io*/) { return {}; }
  /// Called after the ends of all stages, in graph order: waits for work that finish() left in the
  /// background, on which no other stage's end depends.
  virtual void settle() {}
  /// Exports to make from the result folder once everything else in it is written, in the formats of
  /// plumbline export; outputs are named below it. Called after check. Null: none.
  [[nodiscard]] virtual const std::vector<exports::ExportRequest>* wanted_exports() const { return nullptr; }
  /// Fills in what this stage knows in the sections of summary.json; in graph order.
  virtual void report(nlohmann::ordered_json& /*summary*/) const {}
  /// Adds this stage's reasons why the result must not be trusted. `summary`: the reports of all stages.
  virtual void doubt(const nlohmann::ordered_json& /*summary*/, std::vector<Doubt>& /*reasons*/) const {}
  /// Times of parts of this stage's work, named "stage.part".
  [[nodiscard]] virtual std::vector<StageTiming> parts() const { return {}; }
  /// True if it draws the tracker's view of each frame (RunHooks::debug_folder). Called before the run.
  [[nodiscard]] virtual bool draws_frames() const { return false; }
  /// True if it can continue an earlier run (RunContext::resumed). Called before the run.
  [[nodiscard]] virtual bool resumes() const { return false; }
  /// True if poses that come with the recording are used unchanged. Called before the run.
  [[nodiscard]] virtual bool takes_given_poses() const { return false; }
  /// True if it begins with finished maps (RunInput::stored_maps). Called before the run.
  [[nodiscard]] virtual bool reads_maps() const { return false; }
  /// True if it joins the maps of cameras that are fixed to each other (RunInput::rig). Called before the
  /// run.
  [[nodiscard]] virtual bool takes_rig() const { return false; }
  /// True if it locates the camera in a finished map (RunInput::known_map). Called before the run.
  [[nodiscard]] virtual bool knows_map() const { return false; }
  /// True if its clouds are kept in a store until their poses are final. Called before the run.
  [[nodiscard]] virtual bool lays_clouds_down() const { return false; }
};

enum class Mode {
  kStateless,  ///< several frames at the same time
  kSerial,     ///< one frame after another, in order
};

struct StageType {
  std::string name;
  std::string help;  ///< one line
  Mode mode = Mode::kStateless;
  std::vector<Port> inputs;
  std::vector<Port> outputs;
  std::function<std::unique_ptr<Stage>()> make;
  bool exports = false;  ///< writes results after the map is complete; its time counts as export

  /// True if it has per-frame outputs but no per-frame inputs.
  [[nodiscard]] bool is_source() const;
  /// Options of a newly made stage.
  [[nodiscard]] std::vector<core::OptionSpec> options() const;
};
using StageTypePtr = std::shared_ptr<const StageType>;

/// The stage types a pipeline file may name, how its taps write the values of ports, and the filters of its
/// chains.
class StageRegistry {
 public:
  void add(StageType type);  ///< throws std::logic_error for a name that is taken
  [[nodiscard]] StageTypePtr find(const std::string& name) const;                  ///< null: there is none
  [[nodiscard]] std::vector<std::string> names() const;                            ///< sorted
  [[nodiscard]] const std::vector<StageTypePtr>& types() const { return types_; }  ///< as added

  /// A tap is a stage with one input and no output; throws std::logic_error when its port type has one.
  void add_tap(StageType type);
  [[nodiscard]] StageTypePtr find_tap(const PortType& type) const;               ///< null: cannot be tapped
  [[nodiscard]] const std::vector<StageTypePtr>& taps() const { return taps_; }  ///< as added

  /// The built-in filters and what plugins add.
  [[nodiscard]] const cloud::FilterRegistry& filters() const { return filters_; }
  cloud::FilterRegistry& filters() { return filters_; }

 private:
  std::vector<StageTypePtr> types_;
  std::vector<StageTypePtr> taps_;
  cloud::FilterRegistry filters_ = cloud::builtin_filters();
};

/// All stages of this library.
void register_stages(StageRegistry& registry);

}  // namespace plumbline::pipeline
