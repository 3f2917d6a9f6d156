// SPDX-License-Identifier: BSD-3-Clause
// What closing loops is worth: recordings are tracked without and with loops; ATE of both, and every place
// that was verified with its evidence and, since the truth is known, its error.
//   bench_loops [--tell] [--set key=value]... INPUT...
// INPUT: a recording's folder with truth, or synth:SCENE?... A loop is false when its relative pose is off by
// more than 0.2 m or 6 degrees. Milliseconds are processor time of one thread.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/synth/source.hpp"

namespace {

using namespace plumbline;

constexpr std::size_t kChunk = 16;  // frames in memory
constexpr double kDegrees = 57.2957795;

double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

struct Prepared {
  bool readable = false;
  sensor::RgbdFrame frame;
  std::shared_ptr<const features::FrameFeatures> features;
};

/// One set of options on its way through a recording.
class Run {
 public:
  Run(std::string name, const mapping::SlamOptions& options, const sensor::Pinhole& camera)
      : name_(std::move(name)),
        log_(core::null_log()),
        slam_(std::make_unique<mapping::Slam>(options, camera, 0, executor_, *log_)) {}
  void process(const Prepared& prepared) {
    if (!prepared.readable) return;
    const double start = thread_ms();
    const mapping::FrameReport report = slam_->process(prepared.frame, prepared.features);
    ms_ += thread_ms() - start;
    ++frames_;
    if (report.state == tracking::TrackState::kTracked) ++tracked_;
  }
  void print(const std::string& input, const geometry::Trajectory& truth, bool tell) {
    slam_->finish();
    const auto report = evaluate::evaluate_trajectory(slam_->trajectory(), truth);
    int wrong = 0;
    for (const mapping::LoopTrial& trial : slam_->loop_trials()) {
      const auto error = error_of(trial, truth);
      if (trial.refused.empty() && !right(error)) ++wrong;
      if (tell) describe(trial, error);
    }
    const mapping::LoopCounts& counts = slam_->loop_counts();
    std::printf("| %s | %s | %.1f | %.4f | %.4f | %zu | %d | %d | %d | %d | %d | %.1f |\n", input.c_str(),
                name_.c_str(), 100.0 * tracked_ / std::max(1, frames_), report ? report->ate_m.rmse : 0.0,
                report ? report->ate_m.max : 0.0, slam_->map().keyframe_count(), counts.candidates,
                counts.verified, counts.accepted, counts.rejected, wrong, ms_ / std::max(1, frames_));
    std::fflush(stdout);
  }

 private:
  struct PoseError {
    double metres = -1.0;
    double degrees = -1.0;
    double apart_m = 0.0;
    double apart_degrees = 0.0;
  };
  static bool right(const PoseError& e) { return e.metres < 0.2 && e.degrees < 6.0; }
  [[nodiscard]] PoseError error_of(const mapping::LoopTrial& trial, const geometry::Trajectory& truth) const {
    const auto query = geometry::pose_at(truth, slam_->map().stamp_of(trial.loop.query));
    const auto match = geometry::pose_at(truth, slam_->map().stamp_of(trial.loop.match));
    if (!query || !match) return {};
    const geometry::Rigid3 truly = query->inverse() * *match;
    const geometry::Rigid3 error = trial.loop.evidence.query_from_match * truly.inverse();
    return {error.translation.norm(), kDegrees * geometry::rotation_angle(error.rotation),
            truly.translation.norm(), kDegrees * geometry::rotation_angle(truly.rotation)};
  }
  static void describe(const mapping::LoopTrial& t, const PoseError& error) {
    const mapping::PlaceVerification& v = t.loop.evidence;
    std::fprintf(
        stderr,
        "%d-%d score %.3f: apart %.2f m %.0f deg, error %.3f m %.2f deg; matched %d+%d, agree %d, in the end "
        "%d+%d of %d+%d, cells %d, rms %.2f, overlap %.2f, contradiction %.3f, aligned %d %.3f m; moves %.3f "
        "m %.3f rad on %.1f m; %s\n",
        t.loop.query.index, t.loop.match.index, t.score, error.apart_m, error.apart_degrees, error.metres,
        error.degrees, v.matched_points, v.matched_lines, v.ransac_inliers, v.points, v.lines,
        v.visible_points, v.visible_lines, v.cells, v.rms_px, v.overlap, v.contradiction,
        v.surface_aligned ? 1 : 0, v.surface_shift_m, t.correction_m, t.correction_rad, t.way_m,
        t.refused.empty() ? "VERIFIED" : t.refused.c_str());
  }

  std::string name_;
  core::Executor executor_{1};
  std::shared_ptr<core::Log> log_;
  std::unique_ptr<mapping::Slam> slam_;
  int frames_ = 0;
  int tracked_ = 0;
  double ms_ = 0.0;
};

core::Result<std::unique_ptr<dataset::FrameSource>> open(const std::string& input,
                                                         const std::string& pipelines,
                                                         const core::Executor& executor, core::Log& log) {
  if (synth::is_synth_url(input)) return synth::open_synth(input, pipelines + "/scenes", executor, log);
  dataset::OpenOptions options;
  options.cameras_folder = pipelines + "/cameras";
  return dataset::open_recording(input, options, log);
}

struct Settings {
  std::string pipelines = PLUMBLINE_SOURCE_DIR "/pipelines";
  std::vector<std::string> overrides;
  std::size_t frames = 0;  ///< at most; 0: all
  bool tell = false;
  bool on_only = false;
};

core::Result<mapping::SlamOptions> options_of(const std::vector<std::string>& overrides, bool loops) {
  mapping::SlamOptions options;
  core::OptionTable table;
  options.declare(table);
  core::ConfigProblems problems;
  for (const std::string& text : overrides) {
    const std::size_t equals = std::min(text.find('='), text.size());
    const auto value = core::parse_yaml(equals < text.size() ? text.substr(equals + 1) : "", text);
    if (!value) return tl::unexpected<core::Error>(value.error());
    table.set(text.substr(0, equals), *value, "--set " + text, problems);
  }
  if (!problems.empty()) return tl::unexpected<core::Error>(core::to_error(problems));
  options.loops.enabled = loops;
  return options;
}

core::Result<void> measure(const std::string& input, const Settings& settings,
                           const core::Executor& executor) {
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  const auto source = open(input, settings.pipelines, executor, *log);
  if (!source) return tl::unexpected<core::Error>(source.error());
  const auto truth = (*source)->truth();
  if (!truth) return core::input_error(input + ": comes without truth; there is nothing to compare with");
  const sensor::Pinhole& camera = (*source)->camera().color;
  const features::FeatureExtractor extractor({}, camera);
  std::vector<std::unique_ptr<Run>> runs;
  for (const bool loops : {false, true}) {
    if (!loops && settings.on_only) continue;
    const auto options = options_of(settings.overrides, loops);
    if (!options) return tl::unexpected<core::Error>(options.error());
    runs.push_back(std::make_unique<Run>(loops ? "on" : "off", *options, camera));
  }
  const std::size_t frames =
      settings.frames > 0 ? std::min(settings.frames, (*source)->size()) : (*source)->size();
  for (std::size_t begin = 0; begin < frames; begin += kChunk) {
    std::vector<Prepared> chunk(std::min(kChunk, frames - begin));
    executor.parallel_for(chunk.size(), [&](std::size_t i) {
      auto frame = (*source)->read(begin + i);
      if (!frame) return;
      chunk[i].readable = true;
      chunk[i].frame = std::move(*frame);
      chunk[i].features = std::make_shared<const features::FrameFeatures>(extractor.extract(chunk[i].frame));
    });
    executor.parallel_for(runs.size(), [&](std::size_t r) {
      for (const Prepared& prepared : chunk) runs[r]->process(prepared);
    });
  }
  for (const auto& run : runs) run->print(input.substr(input.find_last_of("/:") + 1), *truth, settings.tell);
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tracks recordings without and with loops");
  std::vector<std::string> inputs;
  Settings settings;
  int threads = 1;
  app.add_option("INPUT", inputs, "Recordings with truth, or synth:SCENE?...")->required();
  app.add_flag("--tell", settings.tell, "Every verified place, on stderr");
  app.add_flag("--on-only", settings.on_only, "Not the run without loops");
  app.add_option("--frames", settings.frames, "At most");
  app.add_option("--threads", threads, "Frames and runs side by side")->check(CLI::Range(1, 256));
  app.add_option("--set", settings.overrides, "Set an option of the track stage; may be repeated")
      ->type_name("key=value")
      ->allow_extra_args(false);
  app.add_option("--pipelines-dir", settings.pipelines, "Folder with cameras/ and scenes/");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  const core::Executor executor(threads);
  std::printf(
      "| recording | loops | tracked %% | ATE m | worst m | keyframes | candidates | verified | closed | "
      "rejected | false | ms a frame |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const std::string& input : inputs) {
    if (auto done = measure(input, settings, executor); !done) {
      std::fprintf(stderr, "bench_loops: %s\n", done.error().message.c_str());
      return static_cast<int>(done.error().kind);
    }
  }
  return 0;
}
