// SPDX-License-Identifier: BSD-3-Clause
// plumbline calibrate RECORDING... [-o camera.yaml]
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/mapping/camera_calibration.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/maps/output_check.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/sensor/camera_file.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

struct CalibrateRequest {
  std::vector<std::string> inputs;
  std::filesystem::path output;
  dataset::OpenOptions open;
  mapping::CalibrationOptions options;
};

/// Options for keyframes close together, with features where the camera showed them, because the effect of
/// the shutter is to be estimated.
mapping::SlamOptions slam_options() {
  mapping::SlamOptions options;
  options.keyframe.max_frames = 3;
  options.keyframe.reuse = false;
  options.loops.enabled = false;
  return options;
}

/// The recordings mapped one after another.
class Mapped {
 public:
  core::Result<void> add(const std::string& input, const CalibrateRequest& request, Session& session) {
    // The recording with its calibration
    const auto pipelines = session.pipelines_folder();
    if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());
    dataset::OpenOptions open = request.open;
    open.cameras_folder = *pipelines / "cameras";
    Console& console = session.console();
    auto source = pipeline::open_input(input, open, *pipelines / "scenes", session.executor(), console);
    if (!source) return tl::unexpected<core::Error>(source.error());

    // One camera is adjusted over all recordings
    const sensor::Camera& camera = (*source)->camera();
    if (runs_.empty()) {
      camera_ = camera;
    } else if (!same(camera, camera_)) {
      return core::usage_error(fmt::format(
          "{}: its camera is not that of the recordings before it; calibrate one camera at a time, or name "
          "the camera of all with --camera",
          input));
    }

    // Each recording is tracked by itself
    runs_.push_back(
        std::make_unique<mapping::Slam>(slam_options(), camera.color, 0, session.executor(), console));
    runs_.back()->set_camera(camera);
    track(**source, session);
    return {};
  }

  [[nodiscard]] const sensor::Camera& camera() const { return camera_; }
  [[nodiscard]] std::vector<mapping::CalibrationRun> runs() const {
    std::vector<mapping::CalibrationRun> runs;
    for (const auto& slam : runs_) runs.push_back({&slam->map(), &slam->frame_poses(), camera_.color});
    return runs;
  }

 private:
  /// True if both files describe the same camera, whatever they call it.
  static bool same(sensor::Camera a, sensor::Camera b) {
    a.name.clear();
    b.name.clear();
    return sensor::to_yaml(a) == sensor::to_yaml(b);
  }

  void track(const dataset::FrameSource& source, Session& session) {
    // Features are extracted in parallel, tracking is sequential
    struct Read {
      std::shared_ptr<const sensor::RgbdFrame> frame;
      std::shared_ptr<const features::FrameFeatures> features;
    };

    // A bounded number of frames in memory
    const features::FeatureExtractor extractor({}, source.camera().color);
    constexpr std::size_t kChunk = 16;  // frames in memory

    // A frame that cannot be read is left out
    for (std::size_t begin = 0; begin < source.size(); begin += kChunk) {
      std::vector<Read> chunk(std::min(kChunk, source.size() - begin));
      session.executor().parallel_for(chunk.size(), [&](std::size_t i) {
        auto frame = source.read(begin + i);
        if (!frame) return;  // the next one will do
        chunk[i].features = std::make_shared<features::FrameFeatures>(extractor.extract(*frame));
        chunk[i].frame = std::make_shared<sensor::RgbdFrame>(std::move(*frame));
      });

      // Tracking in the order of the frames
      for (const Read& read : chunk) {
        if (read.frame != nullptr) runs_.back()->process(*read.frame, read.features);
      }
      session.console().progress(begin + chunk.size(), source.size(), "frames");
    }
    session.console().end_progress();
    runs_.back()->finish();
  }

  sensor::Camera camera_;
  std::vector<std::unique_ptr<mapping::Slam>> runs_;
};

/// Given and found values, with their standard deviations.
void print_calibration(const mapping::CameraCalibration& calibration) {
  print("{} views, {} observations of points\n", calibration.views, calibration.observations);
  print("{:<14} {:>10} {:>10} {:>9} {:>7}\n", "", "given", "found", "+-", "wrong");
  for (const mapping::CameraFinding& f : calibration.findings) {
    print("{:<14} {:>10.5g} {:>10.5g} {:>9.2g} {:>6.1f}% {}\n", f.name, f.given, f.found, f.sigma,
          100.0 * f.wrong, f.used ? "used" : "not used");
  }
  print("the recordings fit {:.1f} % better with this camera\n", 100.0 * calibration.gain);
}

/// Reports a problem with the output before anything is read.
core::Result<void> check_camera_output(const CalibrateRequest& request) {
  const std::filesystem::path& output = request.output;
  if (output.extension() != ".yaml" && output.extension() != ".yml") {
    return core::usage_error(
        fmt::format("{}: cameras are written as YAML; let the name end in .yaml", output.string()));
  }

  std::vector<std::filesystem::path> inputs(request.inputs.begin(), request.inputs.end());
  inputs.emplace_back(request.open.camera);
  if (auto free = maps::check_output(output, inputs); !free) return free;

  std::error_code ec;
  if (std::filesystem::is_regular_file(output, ec) && !sensor::read_camera_file(output)) {
    return core::usage_error(
        fmt::format("{}: is there and is not a camera file; choose another name", output.string()));
  }
  return core::check_writable(output);
}

core::Result<void> calibrate(const CalibrateRequest& request, Session& session) {
  // The output is checked before the long work
  if (!request.output.empty()) {
    if (auto fit = check_camera_output(request); !fit) return fit;
  }

  // Keyframes of all recordings
  Mapped mapped;
  for (const std::string& input : request.inputs) {
    if (auto added = mapped.add(input, request, session); !added) return added;
  }

  // Bundle adjustment with the camera's parameters
  const auto calibration =
      mapping::calibrate_camera(mapped.runs(), mapped.camera(), request.options, session.executor());
  if (!calibration) return tl::unexpected<core::Error>(calibration.error());
  if (!session.quiet) print_calibration(*calibration);

  // A file that fits is not replaced
  const bool fits = calibration->news < mapping::kFileIsWrong;
  if (fits && !session.quiet) print("the given camera fits; nothing better was found\n");

  // The file keeps the standard deviations
  if (request.output.empty()) return {};
  sensor::Camera camera = fits ? mapped.camera() : calibration->camera;
  camera.sigma = calibration->sigma;
  const std::string yaml = "# found by plumbline calibrate\n" + sensor::to_yaml(camera);
  if (auto written = core::write_file(request.output, yaml); !written) return written;
  if (!session.quiet) print("written        {}\n", request.output.string());
  return {};
}

}  // namespace

/// Options of calibrate.
void add_calibrate(CLI::App& app, Session& session) {
  const auto request = std::make_shared<CalibrateRequest>();
  CLI::App* command =
      add_command(app, session, "calibrate",
                  "Find focal length, lens, shutter and depth errors of a camera from its recordings",
                  [&session, request] { return calibrate(*request, session); });
  command->add_option("RECORDING", request->inputs, "Recordings of one camera, or synth:SCENE?...")
      ->required();
  command->add_option("-o,--output", request->output, "camera.yaml to write")->type_name("FILE");
  command->add_option("--camera", request->open.camera, "Shipped calibration or file to start from")
      ->type_name("NAME|FILE");
  add_topic_option(*command, request->open);
  add_time_range(*command, request->open);
  add_progress_option(*command, session);
  command->add_option("--views", request->options.views, "Largest number of keyframes and frames to adjust")
      ->check(CLI::Range(16, 2000));
}

}  // namespace plumbline::cli
