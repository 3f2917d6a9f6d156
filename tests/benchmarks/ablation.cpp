// SPDX-License-Identifier: BSD-3-Clause
// What each residual family is worth: every recording is tracked with all of them, without each, and with
// each alone.
//   ablation [--csv] [--only "no depth"]... [--threads N] [--set key=value]... INPUT...
// INPUT: a recording's folder with truth, or synth:SCENE?... A set also goes without the features it does not
// track, as `plumbline map --set features.points=off` does. Milliseconds are processor
// time of one thread, median over the frames; everything else is the same on every run.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
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
#include "slam_overrides.hpp"

namespace {

using namespace plumbline;

struct FamilySet {
  const char* name;
  bool points, lines, depth;
};
constexpr std::array<FamilySet, 7> kSets{{{"all", true, true, true},
                                          {"no points", false, true, true},
                                          {"no lines", true, false, true},
                                          {"no depth", true, true, false},
                                          {"points only", true, false, false},
                                          {"lines only", false, true, false},
                                          {"depth only", false, false, true}}};
constexpr std::size_t kChunk = 16;  // frames in memory

/// Processor time of the calling thread, ms: other work on the machine does not count.
double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Which features a set needs: the four kinds of extractor.
std::size_t kind_of(const FamilySet& set) { return (set.points ? 1U : 0U) + (set.lines ? 2U : 0U); }

/// One frame with what the extractors made of it.
struct PreparedFrame {
  bool readable = false;
  sensor::RgbdFrame frame;
  std::array<std::shared_ptr<const features::FrameFeatures>, 4> features;
  std::array<double, 4> features_ms{};
};

/// One family set on its way through a recording.
class Run {
 public:
  Run(const FamilySet& set, mapping::SlamOptions options, const sensor::Camera& camera)
      : set_(set), log_(core::null_log()) {
    options.tracker.points = set.points;
    options.tracker.lines = set.lines;
    options.tracker.depth = set.depth;
    slam_ = std::make_unique<mapping::Slam>(options, camera.color, 0, executor_, *log_);
    slam_->set_camera(camera);
  }
  void process(const PreparedFrame& prepared) {
    if (!prepared.readable) return;
    const std::size_t kind = kind_of(set_);
    const double start = thread_ms();
    const mapping::FrameReport report = slam_->process(prepared.frame, prepared.features[kind]);
    tracking_ms.push_back(thread_ms() - start);
    features_ms.push_back(prepared.features_ms[kind]);
    if (report.state == tracking::TrackState::kTracked) ++tracked;
  }
  geometry::Trajectory finish() {
    slam_->finish();
    return slam_->trajectory();
  }

  std::size_t tracked = 0;
  std::vector<double> features_ms;
  std::vector<double> tracking_ms;

 private:
  FamilySet set_;
  core::Executor executor_{1};  // its own: borrowed threads would bring the work of other sets into its time
  std::shared_ptr<core::Log> log_;
  std::unique_ptr<mapping::Slam> slam_;
};

/// Extractors by kind; none where no set wants it.
using Extractors = std::array<std::unique_ptr<const features::FeatureExtractor>, 4>;

PreparedFrame prepare(const dataset::FrameSource& source, std::size_t index, const Extractors& extractors) {
  PreparedFrame prepared;
  auto frame = source.read(index);
  if (!frame) return prepared;
  prepared.readable = true;
  prepared.frame = std::move(*frame);
  for (std::size_t kind = 0; kind < extractors.size(); ++kind) {
    if (!extractors[kind]) continue;
    const double start = thread_ms();
    prepared.features[kind] =
        std::make_shared<const features::FrameFeatures>(extractors[kind]->extract(prepared.frame));
    prepared.features_ms[kind] = thread_ms() - start;
  }
  return prepared;
}

void print_header(bool csv) {
  if (csv) {
    std::printf("sequence,set,frames,tracked_percent,ate_rmse_m,rpe_second_rmse_m,features_ms,tracking_ms\n");
  } else {
    std::printf("| sequence | families | tracked %% | ATE m | RPE m/s | features ms | tracking ms |\n");
    std::printf("|---|---|---|---|---|---|---|\n");
  }
}

void print_row(bool csv, const std::string& sequence, const FamilySet& set, Run& run, std::size_t frames,
               const geometry::Trajectory& truth) {
  const auto report = evaluate::evaluate_trajectory(run.finish(), truth);
  const auto metres = [&](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4f", value);
    return report ? std::string(text) : std::string(csv ? "" : "-");
  };
  const std::string ate = metres(report ? report->ate_m.rmse : 0.0);
  const bool pairs = report && report->rpe_second.pairs > 0;
  const std::string rpe = pairs ? metres(report->rpe_second.translation_m.rmse) : std::string(csv ? "" : "-");
  const double percent = 100.0 * static_cast<double>(run.tracked) / static_cast<double>(frames);
  const double features_ms = median(run.features_ms);
  const double tracking_ms = median(run.tracking_ms);
  if (csv) {
    std::printf("%s,%s,%zu,%.1f,%s,%s,%.1f,%.1f\n", sequence.c_str(), set.name, frames, percent, ate.c_str(),
                rpe.c_str(), features_ms, tracking_ms);
  } else {
    std::printf("| %s (%zu) | %s | %.1f | %s | %s | %.1f | %.1f |\n", sequence.c_str(), frames, set.name,
                percent, ate.c_str(), rpe.c_str(), features_ms, tracking_ms);
  }
  std::fflush(stdout);
}

core::Result<std::unique_ptr<dataset::FrameSource>> open(const std::string& input,
                                                         const std::string& pipelines,
                                                         const core::Executor& executor, core::Log& log) {
  if (synth::is_synth_url(input)) return synth::open_synth(input, pipelines + "/scenes", executor, log);
  dataset::OpenOptions options;
  options.cameras_folder = pipelines + "/cameras";
  return dataset::open_recording(input, options, log);
}

core::Result<void> ablate(const std::string& input, const std::string& pipelines,
                          const mapping::SlamOptions& options, const std::vector<FamilySet>& sets,
                          const core::Executor& executor, bool csv) {
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  const auto source = open(input, pipelines, executor, *log);
  if (!source) return tl::unexpected<core::Error>(source.error());
  const auto truth = (*source)->truth();
  if (!truth) return core::input_error(input + ": comes without truth; there is nothing to compare with");
  const sensor::Pinhole& camera = (*source)->camera().color;
  Extractors extractors;
  for (const FamilySet& set : sets) {
    features::FeatureOptions o;
    o.points = set.points;
    o.lines = set.lines;
    extractors[kind_of(set)] = std::make_unique<features::FeatureExtractor>(o, camera);
  }
  std::vector<std::unique_ptr<Run>> runs;
  for (const FamilySet& set : sets) runs.push_back(std::make_unique<Run>(set, options, (*source)->camera()));
  const std::size_t frames = (*source)->size();
  for (std::size_t begin = 0; begin < frames; begin += kChunk) {
    std::vector<PreparedFrame> chunk(std::min(kChunk, frames - begin));
    executor.parallel_for(chunk.size(),
                          [&](std::size_t i) { chunk[i] = prepare(**source, begin + i, extractors); });
    executor.parallel_for(runs.size(), [&](std::size_t r) {
      for (const PreparedFrame& prepared : chunk) runs[r]->process(prepared);
    });
  }
  // A scene's name alone would not tell its variants apart.
  const std::string sequence =
      synth::is_synth_url(input) ? input.substr(input.find(':') + 1) : (*source)->name();
  for (std::size_t r = 0; r < runs.size(); ++r) {
    print_row(csv, sequence, sets[r], *runs[r], frames, *truth);
  }
  return {};
}

std::vector<std::string> names_of(const std::array<FamilySet, 7>& sets) {
  std::vector<std::string> names;
  for (const FamilySet& set : sets) names.emplace_back(set.name);
  return names;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tracks recordings with every set of residual families and prints how well each does");
  std::vector<std::string> inputs;
  std::vector<std::string> overrides;
  std::vector<std::string> only;
  std::string pipelines = PLUMBLINE_SOURCE_DIR "/pipelines";
  bool csv = false;
  int threads = 1;
  app.add_option("INPUT", inputs, "Recordings with truth, or synth:SCENE?...")->required();
  app.add_flag("--csv", csv, "Comma-separated values instead of a Markdown table");
  app.add_option("--only", only, "Only this family set; may be repeated")
      ->check(CLI::IsMember(names_of(kSets)))
      ->allow_extra_args(false);
  app.add_option("--threads", threads, "Frames and sets side by side; times are of one thread all the same")
      ->check(CLI::Range(1, 256));
  app.add_option("--set", overrides, "Set an option of the track stage; may be repeated")
      ->type_name("key=value")
      ->allow_extra_args(false);
  app.add_option("--pipelines-dir", pipelines, "Folder with cameras/ and scenes/");
  CLI11_PARSE(app, argc, argv);

  cv::setNumThreads(1);
  const auto fail = [](const core::Error& error) {
    std::fprintf(stderr, "ablation: %s\n", error.message.c_str());
    return static_cast<int>(error.kind);
  };
  const auto options = benchmarks::slam_options(overrides);
  if (!options) return fail(options.error());
  std::vector<FamilySet> sets;
  for (const FamilySet& set : kSets) {
    if (only.empty() || std::find(only.begin(), only.end(), set.name) != only.end()) sets.push_back(set);
  }
  const core::Executor executor(threads);
  print_header(csv);
  for (const std::string& input : inputs) {
    if (auto done = ablate(input, pipelines, *options, sets, executor, csv); !done) return fail(done.error());
  }
  return 0;
}
