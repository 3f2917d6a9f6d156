// SPDX-License-Identifier: BSD-3-Clause
// What closing loops is worth: recordings are tracked without and with loops; ATE of both, and every place
// that was verified with its evidence and, since the truth is known, its error.
//   bench_loops [--tell] [--save FILE] [--set key=value]... INPUT
//   bench_loops --replay [--wrong SHARE] FILE       loops of a finished map that --save wrote, without
//   tracking
// INPUT: a recording's folder with truth, or synth:SCENE?... A loop is false when its relative pose is off by
// more than 0.2 m or 6 degrees. --bend: the map is first bent by RATE rad of yaw a metre, as a tracker that
// drifts would have left it. --wrong: such a share of wrong loops is forced upon the pose graph, with and
// without its robustness. Milliseconds are processor time of one thread.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <random>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/synth/source.hpp"
#include "slam_overrides.hpp"

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

struct PoseError {
  double metres = -1.0;
  double degrees = -1.0;
  double apart_m = 0.0;  ///< the two cameras, in truth
  double apart_degrees = 0.0;
  [[nodiscard]] bool right() const { return metres < 0.2 && degrees < 6.0; }
};

PoseError error_of(const mapping::Loop& loop, const maps::Map& map, const geometry::Trajectory& truth) {
  const auto query = geometry::pose_at(truth, map.keyframe(loop.query).stamp);
  const auto match = geometry::pose_at(truth, map.keyframe(loop.match).stamp);
  if (!query || !match) return {};
  const geometry::Rigid3 truly = query->inverse() * *match;
  const geometry::Rigid3 error = loop.evidence.query_from_match * truly.inverse();
  return {error.translation.norm(), kDegrees * geometry::rotation_angle(error.rotation),
          truly.translation.norm(), kDegrees * geometry::rotation_angle(truly.rotation)};
}

void describe(const mapping::LoopTrial& t, const PoseError& error) {
  const mapping::PlaceVerification& v = t.loop.evidence;
  std::fprintf(
      stderr,
      "%d-%d score %.3f: apart %.2f m %.0f deg, error %.3f m %.2f deg; matched %d+%d, agree %d, in the end "
      "%d+%d of %d+%d, cells %d, rms %.2f, overlap %.2f, contradiction %.3f, aligned %d %.3f m; moves %.3f "
      "m %.3f rad on %.1f m; %s\n",
      t.loop.query.index, t.loop.match.index, t.score, error.apart_m, error.apart_degrees, error.metres,
      error.degrees, v.matched_points, v.matched_lines, v.ransac_inliers, v.points, v.lines, v.visible_points,
      v.visible_lines, v.cells, v.rms_px, v.overlap, v.contradiction, v.surface_aligned ? 1 : 0,
      v.surface_shift_m, t.correction_m, t.correction_rad, t.path_m,
      t.refused.empty() ? "VERIFIED" : t.refused.c_str());
}

/// Where the camera was lost, and how far off the frames between are, as the map's first second sees them.
void describe_way(const std::vector<maps::FramePose>& frames, const geometry::Trajectory& estimate,
                  const geometry::Trajectory& truth) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].tracked || (i > 0 && !frames[i - 1].tracked)) continue;
    std::size_t end = i;
    while (end < frames.size() && !frames[end].tracked) ++end;
    std::fprintf(stderr, "lost: frames %zu-%zu\n", i, end - 1);
  }
  if (estimate.empty()) return;
  const auto origin = geometry::pose_at(truth, estimate.front().stamp);
  if (!origin) return;
  const geometry::Rigid3 truth_from_map = *origin * estimate.front().world_from_camera.inverse();
  for (std::size_t i = 0; i < estimate.size(); i += 60) {
    const auto here = geometry::pose_at(truth, estimate[i].stamp);
    if (!here) continue;
    const geometry::Rigid3 off = (truth_from_map * estimate[i].world_from_camera).inverse() * *here;
    std::fprintf(stderr, "%.2f s: off by %.3f m %.2f deg at %.2f %.2f\n", estimate[i].stamp,
                 off.translation.norm(), kDegrees * geometry::rotation_angle(off.rotation),
                 here->translation.x(), here->translation.y());
  }
}

/// One row of the table.
void print_row(const std::string& input, const std::string& name, double tracked_percent,
               const geometry::Trajectory& trajectory, const geometry::Trajectory& truth,
               const maps::Map& map, const std::vector<mapping::LoopTrial>& trials,
               const mapping::LoopCounts& counts, double ms, bool tell) {
  const auto report = evaluate::evaluate_trajectory(trajectory, truth);
  int wrong = 0;
  for (const mapping::LoopTrial& trial : trials) {
    const PoseError error = error_of(trial.loop, map, truth);
    if (trial.refused.empty() && !error.right()) ++wrong;
    if (tell) describe(trial, error);
  }
  std::printf("| %s | %s | %.1f | %.4f | %.4f | %zu | %d | %d | %d | %d | %d | %.1f |\n", input.c_str(),
              name.c_str(), tracked_percent, report ? report->ate_m.rmse : 0.0,
              report ? report->ate_m.max : 0.0, map.keyframe_count(), counts.candidates, counts.verified,
              counts.accepted, counts.rejected, wrong, ms);
  std::fflush(stdout);
}

/// One set of options on its way through a recording.
class Run {
 public:
  Run(std::string name, const mapping::SlamOptions& options, const sensor::Camera& camera)
      : name_(std::move(name)),
        log_(core::null_log()),
        slam_(std::make_unique<mapping::Slam>(options, camera.color, 0, executor_, *log_)) {
    slam_->set_camera(camera);
  }
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
    print_row(input, name_, 100.0 * tracked_ / std::max(1, frames_), slam_->trajectory(), truth, slam_->map(),
              slam_->loop_trials(), slam_->loop_counts(), ms_ / std::max(1, frames_), tell);
    if (tell) describe_way(slam_->frame_poses(), slam_->trajectory(), truth);
  }
  [[nodiscard]] const mapping::Slam& slam() const { return *slam_; }

 private:
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
  std::string save;
  double wrong = 0.0;      ///< share of the edges
  double bend = 0.0;       ///< rad a metre
  std::size_t frames = 0;  ///< at most; 0: all
  bool replay = false;
  bool tell = false;
  bool on_only = false;
};

core::Result<mapping::SlamOptions> options_of(const std::vector<std::string>& overrides, bool loops) {
  auto options = benchmarks::slam_options(overrides);
  if (options) options->loops.enabled = loops;
  return options;
}

std::string short_name(const std::string& input) { return input.substr(input.find_last_of("/:") + 1); }

core::Result<void> save(const mapping::Slam& slam, const std::string& input, const sensor::Camera& camera,
                        const std::string& file) {
  maps::StoreHeader header;
  header.robots = {{0, "robot", camera}};
  header.input = input;
  auto writer = maps::StoreWriter::create(file, header);
  if (!writer) return tl::unexpected<core::Error>(writer.error());
  return writer->save_final(slam.map(), slam.frame_poses());
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
    runs.push_back(std::make_unique<Run>(loops ? "on" : "off", *options, (*source)->camera()));
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
  for (const auto& run : runs) run->print(short_name(input), *truth, settings.tell);
  if (settings.save.empty()) return {};
  return save(runs.front()->slam(), input, (*source)->camera(), settings.save);
}

/// Loops between places that are not the same, as look-alikes would give them.
std::vector<mapping::PoseEdge> wrong_edges(const maps::Map& map, std::size_t count,
                                           const geometry::Matrix6d& information) {
  const std::vector<core::KeyframeId> ids = map.keyframe_ids();
  std::mt19937 engine(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(engine()) / 4294967295.0);
  };
  std::vector<mapping::PoseEdge> edges;
  for (int tried = 0; edges.size() < count && tried < 100000; ++tried) {
    const core::KeyframeId a = ids[engine() % ids.size()];
    const core::KeyframeId b = ids[engine() % ids.size()];
    const Eigen::Vector3d apart =
        map.camera_from_world(a).inverse().translation - map.camera_from_world(b).inverse().translation;
    if (!(a < b) || apart.norm() < 2.0) continue;
    const Eigen::Vector3d turn(uniform(-0.1, 0.1), uniform(-0.5, 0.5), uniform(-0.1, 0.1));
    const Eigen::Vector3d shift(uniform(-0.6, 0.6), uniform(-0.1, 0.1), uniform(-0.6, 0.6));
    edges.push_back({a, b, {geometry::exp_so3(turn), shift}, information, false});
  }
  return edges;
}

void force_wrong(const maps::StoredMap& stored, const geometry::Trajectory& truth, const std::string& name,
                 const mapping::LoopOptions& options, std::vector<mapping::PoseEdge> right, double share) {
  const auto count =
      static_cast<std::size_t>(std::lround(share / (1.0 - share) * static_cast<double>(right.size())));
  std::vector<mapping::PoseEdge> torn = right;
  for (const auto& edge : wrong_edges(stored.map, count, right.front().information)) torn.push_back(edge);
  for (const auto& [label, robust, edges] :
       {std::tuple{"right edges at once", true, &right}, std::tuple{"with wrong ones, robust", true, &torn},
        std::tuple{"with wrong ones, believing", false, &torn}}) {
    maps::Map map = stored.map;
    mapping::LoopOptions chosen = options;
    chosen.robust = robust;
    mapping::LoopCloser closer(chosen, maps::camera_of(stored.header.robots, 0).color);
    closer.close(map, *edges);
    print_row(name, std::string(label) + " (" + std::to_string(edges->size()) + ")", 0.0,
              maps::trajectory(stored.frames, map), truth, map, {}, closer.counts(), 0.0, false);
  }
}

/// What a drift of `rate` rad a metre, always the same way, would have made of the map.
void bend(maps::Map& map, double rate) {
  mapping::KeyframePoses poses;
  geometry::Rigid3 before;
  geometry::Rigid3 bent;
  for (const core::KeyframeId id : map.keyframe_ids()) {
    const geometry::Rigid3& pose = map.camera_from_world(id);
    if (poses.empty()) {
      bent = pose;
    } else {
      const geometry::Rigid3 step = pose * before.inverse();
      const Eigen::Vector3d yaw(0.0, rate * step.translation.norm(), 0.0);
      bent = geometry::Rigid3(geometry::exp_so3(yaw), Eigen::Vector3d::Zero()) * step * bent;
    }
    before = pose;
    poses.emplace_back(id, bent);
  }
  mapping::move_keyframes(map, poses);
}

/// Closes the loops of a finished map, keyframe by keyframe.
core::Result<void> replay(const std::string& file, const Settings& settings, const core::Executor& executor) {
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  auto reader = maps::StoreReader::open(file);
  if (!reader) return tl::unexpected<core::Error>(reader.error());
  auto stored = reader->load();
  if (!stored) return tl::unexpected<core::Error>(stored.error());
  const auto source = open(stored->header.input, settings.pipelines, executor, *log);
  if (!source) return tl::unexpected<core::Error>(source.error());
  const auto truth = (*source)->truth();
  if (!truth) return core::input_error(stored->header.input + ": comes without truth");
  const auto options = options_of(settings.overrides, true);
  if (!options) return tl::unexpected<core::Error>(options.error());
  if (settings.bend != 0.0) bend(stored->map, settings.bend);
  maps::Map map = stored->map;
  const std::string name = short_name(file);
  if (settings.tell) describe_way(stored->frames, maps::trajectory(stored->frames, map), *truth);
  print_row(name, "off", 100.0, maps::trajectory(stored->frames, map), *truth, map, {}, {}, 0.0, false);
  mapping::LoopCloser closer(options->loops, maps::camera_of(stored->header.robots, 0).color);
  const double start = thread_ms();
  for (const core::KeyframeId id : map.keyframe_ids()) {
    std::vector<mapping::PoseEdge> edges;
    for (const mapping::Loop& loop : closer.detect(map, id))
      edges.push_back(mapping::LoopCloser::to_edge(loop));
    if (!edges.empty()) closer.close(map, edges);
  }
  const double ms =
      (thread_ms() - start) / static_cast<double>(std::max<std::size_t>(1, map.keyframe_count()));
  print_row(name, "replayed, ms a keyframe", 100.0, maps::trajectory(stored->frames, map), *truth, map,
            closer.trials(), closer.counts(), ms, settings.tell);
  if (!(settings.wrong > 0.0)) return {};
  mapping::LoopCloser watcher(options->loops,
                              maps::camera_of(stored->header.robots, 0).color);  // all that could be closed
  std::vector<mapping::PoseEdge> edges;
  for (const core::KeyframeId id : stored->map.keyframe_ids()) {
    for (const mapping::Loop& loop : watcher.detect(stored->map, id)) {
      edges.push_back(mapping::LoopCloser::to_edge(loop));
    }
  }
  if (!edges.empty()) force_wrong(*stored, *truth, name, options->loops, edges, settings.wrong);
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
  app.add_option("--save", settings.save, "Write the map of the first run: loops off, unless --on-only");
  app.add_flag("--replay", settings.replay, "INPUT is a map that --save wrote");
  app.add_option("--bend", settings.bend, "With --replay: drift that the map is given, rad a metre");
  app.add_option("--wrong", settings.wrong, "With --replay: share of wrong loops")
      ->check(CLI::Range(0.0, 0.9));
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
    const auto done =
        settings.replay ? replay(input, settings, executor) : measure(input, settings, executor);
    if (!done) {
      std::fprintf(stderr, "bench_loops: %s\n", done.error().message.c_str());
      return static_cast<int>(done.error().kind);
    }
  }
  return 0;
}
