// SPDX-License-Identifier: BSD-3-Clause
// Which robots that the end merges have met while they mapped, how late, and how good the previews were.
//   meetings [--lag N] RECORDING RECORDING...
// "Evident" is the moment at which the pairs that agree at the end had five keyframes on both sides (or all
// of fewer). ATE: of the keyframes of a preview and of the same keyframes at the end, in one frame, after
// alignment, where the recordings' truths have one world. The log of keyframes is replayed with one thread
// and with two.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "../slam_overrides.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/geometry/alignment.hpp"
#include "plumbline/mapping/evident.hpp"
#include "plumbline/mapping/merge_server.hpp"
#include "plumbline/mapping/slam.hpp"

namespace {

using namespace plumbline;
using core::KeyframeId;
using mapping::MeetingEvent;
using mapping::MeetingStep;

struct Robot {
  std::unique_ptr<dataset::FrameSource> source;
  std::unique_ptr<mapping::Slam> slam;
  std::unique_ptr<features::FeatureExtractor> extractor;
  std::map<KeyframeId, Eigen::Vector3d> truth;
};

/// A keyframe as it came.
struct Entry {
  std::shared_ptr<const maps::Map> map;
  KeyframeId keyframe;
  std::int64_t frame = 0;
};

struct Log {
  std::vector<Entry> entries;
  std::vector<double> times;  ///< by frame
  std::map<KeyframeId, double> made;
};

struct Place {
  double time = 0.0;
  std::size_t robot = 0;
  std::size_t index = 0;
};

/// As recordings are mapped together.
std::vector<Place> in_order(const std::vector<Robot>& robots) {
  double latest_start = -1e300;
  double earliest_start = 1e300;
  double earliest_end = 1e300;
  for (const Robot& robot : robots) {
    latest_start = std::max(latest_start, robot.source->info(0).stamp);
    earliest_start = std::min(earliest_start, robot.source->info(0).stamp);
    earliest_end = std::min(earliest_end, robot.source->info(robot.source->size() - 1).stamp);
  }
  std::vector<Place> order;
  for (std::size_t r = 0; r < robots.size(); ++r) {
    const dataset::FrameSource& source = *robots[r].source;
    const double begin = latest_start <= earliest_end ? earliest_start : source.info(0).stamp;
    for (std::size_t i = 0; i < source.size(); ++i) order.push_back({source.info(i).stamp - begin, r, i});
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const Place& x, const Place& y) { return x.time < y.time; });
  return order;
}

Log drive(std::vector<Robot>& robots) {
  Log log;
  for (const Place& place : in_order(robots)) {
    Robot& robot = robots[place.robot];
    log.times.push_back(place.time);
    const auto frame = robot.source->read(place.index);
    if (!frame) continue;
    const auto features = std::make_shared<const features::FrameFeatures>(robot.extractor->extract(*frame));
    const mapping::FrameReport report = robot.slam->process(*frame, features);
    if (!report.keyframe.valid()) continue;
    const auto number = static_cast<std::int64_t>(log.times.size()) - 1;
    log.entries.push_back({std::make_shared<maps::Map>(robot.slam->map()), report.keyframe, number});
    log.made[report.keyframe] = place.time;
    if (const auto truth = robot.source->truth()) {
      const auto at = std::min_element(truth->begin(), truth->end(), [&](const auto& x, const auto& y) {
        return std::abs(x.stamp - frame->stamp) < std::abs(y.stamp - frame->stamp);
      });
      robot.truth[report.keyframe] = at->world_from_camera.translation;
    }
  }
  for (Robot& robot : robots) robot.slam->finish();
  return log;
}

struct Reported {
  MeetingEvent event;
  double time = 0.0;
  std::uint64_t preview = 0;  ///< of its map
  friend bool operator==(const Reported& x, const Reported& y) {
    return x.event.step == y.event.step && x.event.a == y.event.a && x.event.b == y.event.b &&
           x.event.frame == y.event.frame && x.time == y.time && x.preview == y.preview;
  }
};

std::vector<Reported> replay(const Log& log, const std::vector<Robot>& robots, int lag, int threads) {
  const core::Executor executor(threads);
  mapping::MergeServer server({}, lag, executor);
  for (std::size_t r = 0; r < robots.size(); ++r)
    server.join({{static_cast<std::int32_t>(r), robots[r].source->camera().color}});
  std::vector<Reported> told;
  const auto take = [&](const std::vector<MeetingEvent>& events, double time) {
    for (const MeetingEvent& event : events)
      told.push_back({event, time, event.preview ? maps::content_hash(event.preview->map) : 0});
  };
  std::size_t next = 0;
  for (std::size_t f = 0; f < log.times.size(); ++f) {
    for (; next < log.entries.size() && log.entries[next].frame == static_cast<std::int64_t>(f); ++next) {
      server.add(log.entries[next].map, log.entries[next].keyframe, log.entries[next].frame);
    }
    take(server.commit(static_cast<std::int64_t>(f)), log.times[f]);
  }
  take(server.finish(), log.times.back());
  return told;
}

/// Of these keyframes where a map has them, after alignment, metres.
double ate(const maps::Map& map, const std::vector<KeyframeId>& ids, const std::vector<Robot>& robots) {
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> truth;
  for (const KeyframeId id : ids) {
    const auto& known = robots[static_cast<std::size_t>(id.robot)].truth;
    if (known.count(id) == 0 || !map.has_keyframe(id)) continue;
    estimate.push_back(map.camera_from_world(id).inverse().translation);
    truth.push_back(known.at(id));
  }
  const auto aligned = geometry::align_points(estimate, truth);
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum += (aligned * estimate[i] - truth[i]).squaredNorm();
  return std::sqrt(sum / std::max(1.0, static_cast<double>(truth.size())));
}

void report(const std::vector<Robot>& robots, const Log& log, const std::vector<Reported>& told) {
  const core::Executor executor(2);
  std::vector<mapping::MapPart> parts;
  for (std::size_t r = 0; r < robots.size(); ++r) {
    parts.push_back(
        {&robots[r].slam->map(), {{static_cast<std::int32_t>(r), robots[r].source->camera().color}}});
  }
  std::vector<mapping::MergeEvidence> merges = mapping::find_overlaps(parts, {}, executor);
  const std::vector<std::size_t> group = mapping::connected_parts(parts.size(), merges);
  int merged = 0;
  int in_time = 0;
  for (const mapping::MergeEvidence& merge : merges) {
    double met = std::nan("");
    for (const Reported& t : told) {
      if (t.event.a != merge.a || t.event.b != merge.b) continue;
      if (t.event.step == MeetingStep::kMet) met = t.time;
      if (t.event.step == MeetingStep::kTakenBack) met = std::nan("");
    }
    const double since = merge.pairs.empty() ? std::nan("") : mapping::evident_s(merge, log.made);
    merged += merge.accepted ? 1 : 0;
    in_time += merge.accepted && met <= since + 3.0 ? 1 : 0;
    fmt::print("{} {} {} agree {} evident {:.1f} met {:.1f} late {:.1f}{}\n", robots[merge.a].source->name(),
               robots[merge.b].source->name(), merge.accepted ? "merged" : "apart",
               merge.consistency.agreeing, since, met, met - since,
               merge.accepted || std::isnan(met) ? "" : " MET BUT APART: " + merge.refused);
  }
  fmt::print("{} of {} merged had met within 3 s\n", in_time, merged);
  for (const Reported& t : told) {
    if (t.event.step == MeetingStep::kTakenBack) {
      fmt::print("{:.1f} s: {} and {} taken back: {}\n", t.time, robots[t.event.a].source->name(),
                 robots[t.event.b].source->name(), t.event.evidence.refused);
    }
    if (t.event.step != MeetingStep::kMet) continue;
    const auto ids = t.event.preview->map.keyframe_ids();
    const auto end = mapping::fuse_maps(parts, merges, group[t.event.a], {});
    fmt::print("{:.1f} s: {} and {} met, {} maps, ATE {:.4f} m, at the end {:.4f} m\n", t.time,
               robots[t.event.a].source->name(), robots[t.event.b].source->name(),
               t.event.preview->parts.size(), ate(t.event.preview->map, ids, robots),
               ate(end.map, ids, robots));
  }
}

core::Result<void> run(const std::vector<std::string>& inputs, const std::string& pipelines, int lag) {
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  const core::Executor executor(2);
  dataset::OpenOptions open;
  open.cameras_folder = pipelines + "/cameras";
  std::vector<Robot> robots;
  for (const std::string& input : inputs) {
    auto source = dataset::open_recording(input, open, *log);
    if (!source) return tl::unexpected<core::Error>(source.error());
    Robot robot;
    robot.source = std::move(*source);
    const sensor::Pinhole camera = robot.source->camera().color;
    robot.slam = std::make_unique<mapping::Slam>(mapping::SlamOptions{}, camera,
                                                 static_cast<std::int32_t>(robots.size()), executor, *log);
    robot.slam->set_camera(robot.source->camera());
    robot.extractor = std::make_unique<features::FeatureExtractor>(features::FeatureOptions{}, camera);
    robots.push_back(std::move(robot));
  }
  const Log frames = drive(robots);
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Reported> told = replay(frames, robots, lag, 1);
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report(robots, frames, told);
  fmt::print("{} keyframes in {:.1f} s of one thread; two threads: {}\n", frames.entries.size(), took,
             replay(frames, robots, lag, 2) == told ? "the same" : "DIFFERENT");
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Robots that meet while they map");
  std::vector<std::string> inputs;
  std::string pipelines = PLUMBLINE_SOURCE_DIR "/pipelines";
  int lag = 10;
  app.add_option("RECORDINGS", inputs, "Of the robots")->required();
  app.add_option("--lag", lag, "Frames of all robots until what a keyframe shows is told");
  app.add_option("--pipelines-dir", pipelines, "Folder with cameras/ and scenes/");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  if (auto done = run(inputs, pipelines, lag); !done) {
    fmt::print(stderr, "meetings: {}\n", done.error().message);
    return static_cast<int>(done.error().kind);
  }
  return 0;
}
