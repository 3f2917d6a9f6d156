// SPDX-License-Identifier: BSD-3-Clause
// What local mapping and the keyframe rule are worth: every recording is mapped side by side with local
// mapping off and on, each at several densities of keyframes, and with the cone rule. At the end: the density
// that is best for each side in the median over all recordings, both sides at theirs, and the cone rule
// beside the plain one's density that comes nearest to its number of keyframes.
//   compare_mapping [--csv] [--threads N] [--frames N] [--set key=value]... [--off key=value]... INPUT...
// INPUT: a recording's folder with truth, or synth:SCENE?... ; --set holds for all, --off for local mapping
// off alone. Coverage: of the 5 cm voxels that depth images of all frames fill (at the true poses), the share
// that those of the keyframes fill. The numbers are the same on every run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/evaluate/trajectory.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/synth/source.hpp"
#include "slam_overrides.hpp"

namespace {

using namespace plumbline;
using Texts = std::vector<std::string>;

constexpr std::size_t kChunk = 16;  // frames in memory
constexpr double kVoxel = 0.05;     // m
constexpr int kStride = 8;          // px, of the depth images that coverage is counted with
constexpr double kMaxDepth = 6.0;   // m
/// Factors on what the plain rule allows between keyframes.
constexpr std::array<double, 4> kOff{0.75, 1.0, 1.35, 1.8};
constexpr std::array<double, 6> kOn{0.75, 1.0, 1.35, 1.8, 2.4, 3.2};

/// Rarer or denser keyframes by the plain rule.
mapping::SlamOptions at_density(mapping::SlamOptions options, double factor) {
  mapping::KeyframeRuleOptions& rule = options.keyframe;
  rule.rule = mapping::KeyframeRuleOptions::Rule::kPlain;
  rule.max_parallax *= factor;
  rule.max_rotation_rad *= factor;
  rule.min_shared = std::max(0.05, 1.0 - factor * (1.0 - rule.min_shared));
  rule.min_surface_overlap = std::max(0.05, 1.0 - factor * (1.0 - rule.min_surface_overlap));
  rule.max_frames = std::max(2, static_cast<int>(std::lround(rule.max_frames * factor)));
  return options;
}

using Voxels = std::vector<std::uint64_t>;  // sorted, unique

void sort_unique(Voxels& voxels) {
  std::sort(voxels.begin(), voxels.end());
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
}

Voxels voxels_of(const cv::Mat& depth, const sensor::Pinhole& camera,
                 const geometry::Rigid3& world_from_camera) {
  Voxels voxels;
  for (int v = kStride / 2; v < depth.rows; v += kStride) {
    for (int u = kStride / 2; u < depth.cols; u += kStride) {
      const auto z = static_cast<double>(depth.at<float>(v, u));
      if (!(z > 0.0 && z < kMaxDepth)) continue;
      const Eigen::Vector3d p = world_from_camera * camera.unproject(u, v, z);
      std::uint64_t key = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const auto cell = static_cast<std::int64_t>(std::floor(p(axis) / kVoxel)) + (1 << 20);
        key = (key << 21) | (static_cast<std::uint64_t>(cell) & 0x1fffffU);
      }
      voxels.push_back(key);
    }
  }
  sort_unique(voxels);
  return voxels;
}

struct Prepared {
  bool readable = false;
  sensor::RgbdFrame frame;
  std::shared_ptr<const features::FrameFeatures> features;
};

/// One variant on its way through a recording.
struct Run {
  Run(const mapping::SlamOptions& options, const sensor::Camera& camera)
      : log(core::null_log()), slam(options, camera.color, 0, executor, *log) {
    slam.set_camera(camera);
  }
  void process(std::size_t number, const Prepared& prepared) {
    if (!prepared.readable) return;
    const mapping::FrameReport report = slam.process(prepared.frame, prepared.features);
    if (report.state == tracking::TrackState::kTracked) ++tracked;
    if (report.keyframe.valid()) keyframes.push_back(number);
  }
  core::Executor executor{1};
  std::shared_ptr<core::Log> log;
  mapping::Slam slam;
  std::size_t tracked = 0;
  std::vector<std::size_t> keyframes;  ///< numbers of frames
};

double coverage(const Run& run, const std::vector<Voxels>& seen, std::size_t all) {
  Voxels covered;
  for (const std::size_t k : run.keyframes) covered.insert(covered.end(), seen[k].begin(), seen[k].end());
  sort_unique(covered);
  return all > 0 ? static_cast<double>(covered.size()) / static_cast<double>(all) : 0.0;
}

struct Score {
  std::string sequence;
  std::string variant;
  std::size_t frames = 0;
  double tracked_percent = 0.0;
  double ate_m = 0.0;
  std::size_t keyframes = 0;
  double coverage = 0.0;
  std::size_t points = 0;
  std::size_t lines = 0;
};

void print(bool csv, const Score& s) {
  std::printf(csv ? "%s,%s,%zu,%.1f,%.4f,%zu,%.3f,%zu,%zu\n"
                  : "| %s | %s | %zu | %.1f | %.4f | %zu | %.3f | %zu | %zu |\n",
              s.sequence.c_str(), s.variant.c_str(), s.frames, s.tracked_percent, s.ate_m, s.keyframes,
              s.coverage, s.points, s.lines);
  std::fflush(stdout);
}

/// The variants of one recording.
struct Scores {
  std::array<Score, kOff.size()> off;
  std::array<Score, kOn.size()> on;
  Score cone;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n == 0 ? std::nan("") : 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

/// The density of one side that is best in the median over all recordings.
template <typename Side>
std::size_t best_density(const std::vector<Scores>& all, Side side) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t d = 0; d < (all.front().*side).size(); ++d) {
    std::vector<double> ates;
    for (const Scores& scores : all) ates.push_back((scores.*side)[d].ate_m);
    if (const double m = median(std::move(ates)); m < least) {
      least = m;
      best = d;
    }
  }
  return best;
}

void summarise(const std::vector<Scores>& all) {
  if (all.empty()) return;
  const std::size_t off = best_density(all, &Scores::off);
  const std::size_t on = best_density(all, &Scores::on);
  std::printf("\n# best: off at density %g, on at %g\n", kOff[off], kOn[on]);
  std::printf("# sequence, off, on, change; cone rule: ATE, keyframes, coverage; plain rule, as many\n");
  std::vector<double> changes;
  for (const Scores& s : all) {
    changes.push_back(s.on[on].ate_m / s.off[off].ate_m - 1.0);
    const auto distance = [&](const Score& score) {
      return std::abs(static_cast<double>(score.keyframes) - static_cast<double>(s.cone.keyframes));
    };
    const Score& as_many = *std::min_element(
        s.on.begin(), s.on.end(), [&](const Score& a, const Score& b) { return distance(a) < distance(b); });
    std::printf("# %s, %.4f, %.4f, %+.0f %%; %.4f, %zu, %.3f; %.4f, %zu, %.3f\n", s.cone.sequence.c_str(),
                s.off[off].ate_m, s.on[on].ate_m, 100.0 * changes.back(), s.cone.ate_m, s.cone.keyframes,
                s.cone.coverage, as_many.ate_m, as_many.keyframes, as_many.coverage);
  }
  std::printf("# median change %+.0f %%\n", 100.0 * median(std::move(changes)));
}

class Comparison {
 public:
  Comparison(const dataset::FrameSource& source, geometry::Trajectory truth, std::size_t frames)
      : source_(source),
        truth_(std::move(truth)),
        frames_(std::min(frames, source.size())),
        camera_(source.camera().color),
        extractor_({}, camera_) {}

  void add(const mapping::SlamOptions& options) {
    runs_.push_back(std::make_unique<Run>(options, source_.camera()));
  }

  void run(const core::Executor& executor) {
    seen_.resize(frames_);
    for (std::size_t begin = 0; begin < frames_; begin += kChunk) {
      std::vector<Prepared> chunk(std::min(kChunk, frames_ - begin));
      executor.parallel_for(chunk.size(), [&](std::size_t i) { chunk[i] = prepare(begin + i); });
      executor.parallel_for(runs_.size(), [&](std::size_t r) {
        for (std::size_t i = 0; i < chunk.size(); ++i) runs_[r]->process(begin + i, chunk[i]);
      });
    }
    Voxels all;
    for (const Voxels& voxels : seen_) {
      all.insert(all.end(), voxels.begin(), voxels.end());
      if (all.size() > 4000000) sort_unique(all);
    }
    sort_unique(all);
    voxels_ = all.size();
    for (const auto& run : runs_) run->slam.finish();
  }

  [[nodiscard]] const Run& of(std::size_t run) const { return *runs_[run]; }

  [[nodiscard]] Score score(const std::string& sequence, const std::string& name, std::size_t r) const {
    const Run& run = *runs_[r];
    const auto report = evaluate::evaluate_trajectory(run.slam.trajectory(), truth_);
    Score score;
    score.sequence = sequence;
    score.variant = name;
    score.frames = frames_;
    score.tracked_percent = 100.0 * static_cast<double>(run.tracked) / static_cast<double>(frames_);
    score.ate_m = report ? report->ate_m.rmse : std::nan("");
    score.keyframes = run.keyframes.size();
    score.coverage = coverage(run, seen_, voxels_);
    score.points = run.slam.map().point_count();
    score.lines = run.slam.map().line_count();
    return score;
  }

 private:
  Prepared prepare(std::size_t index) {
    Prepared prepared;
    auto frame = source_.read(index);
    if (!frame) return prepared;
    prepared.readable = true;
    prepared.frame = std::move(*frame);
    prepared.features = std::make_shared<const features::FrameFeatures>(extractor_.extract(prepared.frame));
    if (const auto pose = geometry::pose_at(truth_, prepared.frame.stamp)) {
      seen_[index] = voxels_of(prepared.frame.depth, camera_, *pose);
    }
    return prepared;
  }

  const dataset::FrameSource& source_;
  geometry::Trajectory truth_;
  std::size_t frames_;  ///< from the first on
  sensor::Pinhole camera_;
  features::FeatureExtractor extractor_;
  std::vector<std::unique_ptr<Run>> runs_;
  std::vector<Voxels> seen_;  ///< by frame
  std::size_t voxels_ = 0;
};

core::Result<Scores> compare(const std::string& input, const std::string& pipelines,
                             const mapping::SlamOptions& on, const mapping::SlamOptions& off,
                             std::size_t frames, const core::Executor& executor, bool csv) {
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  dataset::OpenOptions open;
  open.cameras_folder = pipelines + "/cameras";
  const bool synthetic = synth::is_synth_url(input);
  const auto source = synthetic ? synth::open_synth(input, pipelines + "/scenes", executor, *log)
                                : dataset::open_recording(input, open, *log);
  if (!source) return tl::unexpected<core::Error>(source.error());
  const auto truth = (*source)->truth();
  if (!truth) return core::input_error(input + ": comes without truth; there is nothing to compare with");
  Comparison comparison(**source, *truth, frames);
  mapping::SlamOptions cone = on;
  cone.keyframe.rule = mapping::KeyframeRuleOptions::Rule::kCone;
  for (const double density : kOff) comparison.add(at_density(off, density));
  for (const double density : kOn) comparison.add(at_density(on, density));
  comparison.add(cone);
  comparison.run(executor);
  const std::string sequence = synthetic ? input.substr(input.find(':') + 1) : input;
  Scores scores;
  std::size_t run = 0;
  const auto next = [&](const std::string& name) {
    const Score score = comparison.score(sequence, name, run++);
    print(csv, score);
    return score;
  };
  for (std::size_t d = 0; d < kOff.size(); ++d) scores.off[d] = next(fmt::format("off at {}", kOff[d]));
  for (std::size_t d = 0; d < kOn.size(); ++d) scores.on[d] = next(fmt::format("on at {}", kOn[d]));
  scores.cone = next("cone rule");
  return scores;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Maps recordings with local mapping off and on and by both keyframe rules");
  Texts inputs;
  Texts overrides;
  Texts off{"bundle=off", "edges=off", "triangulate=off", "fuse=off"};
  std::string pipelines = PLUMBLINE_SOURCE_DIR "/pipelines";
  bool csv = false;
  int threads = 1;
  std::size_t frames = 1000000;
  app.add_option("INPUT", inputs, "Recordings with truth, or synth:SCENE?...")->required();
  app.add_flag("--csv", csv, "Comma-separated values instead of a Markdown table");
  app.add_option("--threads", threads, "Frames and variants side by side")->check(CLI::Range(1, 256));
  app.add_option("--frames", frames, "Only so many, from the first on")->check(CLI::PositiveNumber);
  app.add_option("--set", overrides, "Set an option of the track stage; may be repeated")
      ->type_name("key=value")
      ->allow_extra_args(false);
  app.add_option("--off", off,
                 "What local mapping off means, instead of bundle, edges, triangulate and fuse off")
      ->type_name("key=value")
      ->allow_extra_args(false);
  app.add_option("--pipelines-dir", pipelines, "Folder with cameras/ and scenes/");
  CLI11_PARSE(app, argc, argv);

  cv::setNumThreads(1);
  const auto fail = [](const core::Error& error) {
    std::fprintf(stderr, "compare_mapping: %s\n", error.message.c_str());
    return static_cast<int>(error.kind);
  };
  const auto on = benchmarks::slam_options(overrides);
  if (!on) return fail(on.error());
  Texts without = overrides;
  without.insert(without.end(), off.begin(), off.end());
  const auto plain = benchmarks::slam_options(without);
  if (!plain) return fail(plain.error());
  const core::Executor executor(threads);
  std::printf(
      csv ? "sequence,variant,frames,tracked_percent,ate_rmse_m,keyframes,coverage,points,lines\n"
          : "| sequence | variant | frames | tracked %% | ATE m | keyframes | coverage | points | lines |\n"
            "|---|---|---|---|---|---|---|---|---|\n");
  std::vector<Scores> all;
  for (const std::string& input : inputs) {
    const auto scores = compare(input, pipelines, *on, *plain, frames, executor, csv);
    if (!scores) return fail(scores.error());
    all.push_back(*scores);
  }
  summarise(all);
  return 0;
}
