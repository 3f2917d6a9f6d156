// SPDX-License-Identifier: BSD-3-Clause
// Place recognition measured on its own, against true poses.
//   bench_places [--step S] [--csv] INPUT...    recall at 100 % precision, points alone and with lines
//   bench_places --verify INPUT...              the same after geometric verification of the five best hits
//   bench_places --speed INPUT                  query and add times with 1 000 and 10 000 keyframes
// INPUT: a recording's folder with truth, or synth:SCENE?... Keyframes are frames every S seconds; each asks
// for what was seen more than 5 s before. Two pictures show the same place when they were taken from less
// than 1 m apart, looking less than 30 degrees apart.
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
#include "plumbline/mapping/place_verification.hpp"
#include "plumbline/places/recogniser.hpp"
#include "plumbline/synth/source.hpp"
#include "plumbline/tracking/surface_sampler.hpp"

namespace {

using namespace plumbline;
using Picture = std::shared_ptr<const features::FrameFeatures>;

constexpr double kApart = 5.0;   // s
constexpr double kNear = 1.0;    // m
constexpr double kAlike = 30.0;  // degrees

double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

struct Shot {
  double stamp = 0.0;
  geometry::Rigid3 world_from_camera;
  Picture features;
  std::vector<maps::SurfaceSample> surface;
};

struct Film {
  sensor::Pinhole camera;
  std::vector<Shot> shots;
};

core::Result<std::unique_ptr<dataset::FrameSource>> open(const std::string& input,
                                                         const std::string& pipelines,
                                                         const core::Executor& executor, core::Log& log) {
  if (synth::is_synth_url(input)) return synth::open_synth(input, pipelines + "/scenes", executor, log);
  dataset::OpenOptions options;
  options.cameras_folder = pipelines + "/cameras";
  return dataset::open_recording(input, options, log);
}

core::Result<Film> film(const std::string& input, const std::string& pipelines, double step,
                        const core::Executor& executor) {
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  const auto source = open(input, pipelines, executor, *log);
  if (!source) return tl::unexpected<core::Error>(source.error());
  const auto truth = (*source)->truth();
  if (!truth) return core::input_error(input + ": comes without truth; there is nothing to compare with");
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const double stamp = (*source)->info(i).stamp;
    if (chosen.empty() || stamp - (*source)->info(chosen.back()).stamp > step - 1e-3) chosen.push_back(i);
  }
  const features::FeatureExtractor extractor({}, (*source)->camera().color);
  Film film;
  film.camera = (*source)->camera().color;
  std::vector<Shot>& shots = film.shots;
  shots.resize(chosen.size());
  executor.parallel_for(chosen.size(), [&](std::size_t i) {
    const auto frame = (*source)->read(chosen[i]);
    if (!frame) return;
    const auto pose = geometry::pose_at(*truth, frame->stamp);
    if (!pose) return;
    shots[i] = {frame->stamp, *pose,
                std::make_shared<const features::FrameFeatures>(extractor.extract(*frame)),
                tracking::sample_surface(frame->depth, film.camera, {})};
  });
  shots.erase(std::remove_if(shots.begin(), shots.end(), [](const Shot& s) { return s.features == nullptr; }),
              shots.end());
  return film;
}

bool same_place(const Shot& a, const Shot& b) {
  const geometry::Rigid3 between = a.world_from_camera.inverse() * b.world_from_camera;
  return between.translation.norm() < kNear &&
         geometry::rotation_angle(between.rotation) < kAlike * 3.14159265358979 / 180.0;
}

Picture without(const Picture& picture, bool points, bool lines) {
  auto copy = std::make_shared<features::FrameFeatures>(*picture);
  if (!points) {
    copy->points.clear();
    copy->descriptors.clear();
  }
  if (!lines) copy->lines.clear();
  return copy;
}

struct Recall {
  int revisits = 0;       ///< pictures of places seen more than kApart before
  int first_right = 0;    ///< of these, best hit is right
  double absolute = 0.0;  ///< recall at 100 % precision, threshold on the score
  double relative = 0.0;  ///< threshold on the score over that of the keyframe before
  double words = 0.0;
  double add_ms = 0.0;
  double query_ms = 0.0;
};

/// Share of the revisits found before the first mistake.
double at_full_precision(std::vector<std::pair<double, bool>> answers, int revisits) {
  std::sort(answers.begin(), answers.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  int right = 0;
  double last = 0.0;
  int before = 0;  // right ones with a score above that of the first mistake
  for (const auto& [score, good] : answers) {
    if (score != last) before = right;
    last = score;
    if (!good) {
      right = before;
      break;
    }
    ++right;
  }
  return revisits > 0 ? static_cast<double>(right) / revisits : 0.0;
}

Recall measure(const std::vector<Shot>& shots, bool points, bool lines) {
  places::Database database{places::Vocabulary()};
  Recall recall;
  std::vector<std::pair<double, bool>> absolute;
  std::vector<std::pair<double, bool>> relative;
  std::vector<double> add_ms;
  std::vector<double> query_ms;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const Picture picture = without(shots[i].features, points, lines);
    const auto index = [](core::KeyframeId id) { return static_cast<std::size_t>(id.index); };
    const auto before = [&](core::KeyframeId id) { return shots[i].stamp - shots[index(id)].stamp > kApart; };
    double start = thread_ms();
    const places::Database::Scores scores = database.query(*picture);
    const std::vector<places::Hit> best = scores.best(1, before);
    query_ms.push_back(thread_ms() - start);
    bool revisit = false;
    for (std::size_t j = 0; j < i && !revisit; ++j) {
      revisit = shots[i].stamp - shots[j].stamp > kApart && same_place(shots[i], shots[j]);
    }
    recall.revisits += revisit ? 1 : 0;
    if (!best.empty()) {
      const bool right = same_place(shots[i], shots[index(best[0].keyframe)]);
      recall.first_right += right ? 1 : 0;
      absolute.emplace_back(best[0].score, right);
      const double usual = i > 0 ? scores.of({0, static_cast<std::int32_t>(i) - 1}) : 0.0;
      relative.emplace_back(usual > 0.0 ? best[0].score / usual : 0.0, right);
    }
    start = thread_ms();
    database.add({0, static_cast<std::int32_t>(i)}, picture);
    add_ms.push_back(thread_ms() - start);
  }
  recall.absolute = at_full_precision(absolute, recall.revisits);
  recall.relative = at_full_precision(relative, recall.revisits);
  recall.words = static_cast<double>(database.vocabulary().word_count(places::Kind::kPoint) +
                                     database.vocabulary().word_count(places::Kind::kLine));
  for (const double ms : add_ms) recall.add_ms += ms / static_cast<double>(add_ms.size());
  for (const double ms : query_ms) recall.query_ms += ms / static_cast<double>(query_ms.size());
  return recall;
}

/// All pictures as keyframes at their true poses; landmarks from depth, each seen by one keyframe only.
maps::Map map_of(const Film& film) {
  maps::Map map;
  for (std::size_t i = 0; i < film.shots.size(); ++i) {
    const Shot& shot = film.shots[i];
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {0, static_cast<std::int32_t>(i)};
    keyframe->stamp = shot.stamp;
    keyframe->features = shot.features;
    keyframe->surface = shot.surface;
    map.add_keyframe(keyframe, shot.world_from_camera.inverse());
    for (std::size_t f = 0; f < shot.features->points.size(); ++f) {
      const features::PointFeature& feature = shot.features->points[f];
      if (!(feature.depth > 0.0F)) continue;
      const Eigen::Vector3d in_camera =
          film.camera.unproject(static_cast<double>(feature.pixel.x()),
                                static_cast<double>(feature.pixel.y()), static_cast<double>(feature.depth));
      maps::MapPoint point;
      point.position = shot.world_from_camera * in_camera;
      point.descriptor = shot.features->descriptors[f];
      point.angle = feature.angle;
      point.angle_keyframe = keyframe->id;
      point.view_direction = (shot.world_from_camera.rotation * in_camera).normalized();
      point.reference_distance = in_camera.norm();
      point.reference_octave = feature.octave;
      map.observe(map.add_point(0, point), keyframe->id, static_cast<int>(f));
    }
    for (std::size_t f = 0; f < shot.features->lines.size(); ++f) {
      const features::LineFeature& feature = shot.features->lines[f];
      if (!feature.line3) continue;
      maps::MapLine line;
      line.start = shot.world_from_camera * feature.line3->start;
      line.end = shot.world_from_camera * feature.line3->end;
      line.descriptor = feature.descriptor;
      map.observe(map.add_line(0, line), keyframe->id, static_cast<int>(f));
    }
  }
  return map;
}

struct Verified {
  int revisits = 0;
  int found = 0;              ///< of these, a verified hit within kNear and kAlike by its own estimate
  int accepted = 0;           ///< pairs
  int wrong = 0;              ///< accepted pairs whose pose is off by more than 0.2 m or 6 degrees
  int doubt = 0;              ///< most inliers (lines counted twice) of a wrong pair
  std::vector<int> evidence;  ///< of each revisit that was found, the most inliers of such a hit
  std::vector<double> error_m;
  double ms = 0.0;
  int tried = 0;
};

Verified verify(const Film& film, bool points, bool lines, bool tell) {
  Film plain{film.camera, film.shots};
  for (Shot& shot : plain.shots) shot.features = without(shot.features, points, lines);
  const maps::Map map = map_of(plain);
  const std::vector<Shot>& shots = plain.shots;
  places::Database database{places::Vocabulary()};
  Verified result;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const core::KeyframeId query{0, static_cast<std::int32_t>(i)};
    const auto at = [&](core::KeyframeId id) -> const Shot& {
      return shots[static_cast<std::size_t>(id.index)];
    };
    const auto before = [&](core::KeyframeId id) { return shots[i].stamp - at(id).stamp > kApart; };
    bool revisit = false;
    for (std::size_t j = 0; j < i && !revisit; ++j) {
      revisit = shots[i].stamp - shots[j].stamp > kApart && same_place(shots[i], shots[j]);
    }
    result.revisits += revisit ? 1 : 0;
    int found = 0;  // inliers
    for (const places::Hit& hit : database.query(*shots[i].features).best(5, before)) {
      const double start = thread_ms();
      const mapping::PlaceVerification v =
          mapping::verify_place({&map, query, film.camera}, {&map, hit.keyframe, film.camera}, {}, 1);
      result.ms += thread_ms() - start;
      ++result.tried;
      const geometry::Rigid3 truth =
          shots[i].world_from_camera.inverse() * at(hit.keyframe).world_from_camera;
      const geometry::Rigid3 error = v.query_from_match * truth.inverse();
      const double degrees = geometry::rotation_angle(error.rotation) * 57.2957795;
      const bool right = error.translation.norm() < 0.2 && degrees < 6.0;
      if (tell && (v.accepted || right)) {
        std::fprintf(
            stderr,
            "%d-%d %s: apart %.2f m %.0f deg, error %.3f m %.2f deg; matched %d+%d, agree %d, in the end "
            "%d+%d of %d+%d, cells %d, rms %.2f, overlap %.2f, contradiction %.3f, aligned %d %.3f m; %s\n",
            query.index, hit.keyframe.index, v.accepted ? "accepted" : "refused", truth.translation.norm(),
            geometry::rotation_angle(truth.rotation) * 57.2957795, error.translation.norm(), degrees,
            v.matched_points, v.matched_lines, v.ransac_inliers, v.points, v.lines, v.visible_points,
            v.visible_lines, v.cells, v.rms_px, v.overlap, v.contradiction, v.surface_aligned ? 1 : 0,
            v.surface_shift_m, v.refused.c_str());
      }
      if (!v.accepted) continue;
      ++result.accepted;
      const int inliers = v.points + 2 * v.lines;
      result.wrong += right ? 0 : 1;
      if (!right) result.doubt = std::max(result.doubt, inliers);
      result.error_m.push_back(error.translation.norm());
      const bool same = right && v.query_from_match.translation.norm() < kNear &&
                        geometry::rotation_angle(v.query_from_match.rotation) < kAlike / 57.2957795;
      if (same) found = std::max(found, inliers);
    }
    result.found += revisit && found > 0 ? 1 : 0;
    if (revisit) result.evidence.push_back(found);
    database.add(query, shots[i].features);
  }
  std::sort(result.error_m.begin(), result.error_m.end());
  return result;
}

/// Share of the revisits that are found when as many inliers are asked for as rule out every wrong pair.
double recall_without_wrong(const Verified& v) {
  const auto enough = std::count_if(v.evidence.begin(), v.evidence.end(), [&](int e) { return e > v.doubt; });
  return v.revisits > 0 ? static_cast<double>(enough) / v.revisits : 0.0;
}

/// Views of made-up places: each place has the features of a real picture with `strange` bits of each
/// descriptor turned over, each view of it a few more.
class MadeUp {
 public:
  explicit MadeUp(const std::vector<Shot>& shots) : shots_(shots) {}
  Picture view(int number) {
    constexpr int kViews = 5;
    constexpr int kStrange = 70;
    constexpr int kViewNoise = 14;
    const auto place = static_cast<std::uint64_t>(number / kViews);
    const Shot& shot = shots_[place % shots_.size()];
    auto picture = std::make_shared<features::FrameFeatures>();
    picture->descriptors = shot.features->descriptors;
    picture->lines = shot.features->lines;
    std::uint64_t of_place = 1000 + place;
    std::uint64_t of_view = 77 + static_cast<std::uint64_t>(number);
    const auto disturb = [&](features::Descriptor256& d) {
      flip(d, kStrange, of_place);
      flip(d, kViewNoise, of_view);
    };
    for (auto& d : picture->descriptors) disturb(d);
    for (auto& l : picture->lines) disturb(l.descriptor);
    return picture;
  }

 private:
  static void flip(features::Descriptor256& d, int bits, std::uint64_t& state) {
    for (int i = 0; i < bits; ++i) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      d[(state >> 62U) & 3U] ^= 1ULL << ((state >> 40U) & 63U);
    }
  }
  const std::vector<Shot>& shots_;
};

void print_speed(const std::vector<Shot>& shots) {
  places::Database database{places::Vocabulary()};
  MadeUp made_up(shots);
  constexpr int kQueries = 50;
  double add_ms = 0.0;
  double worst_add = 0.0;
  std::printf(
      "| keyframes | words | query ms | add ms (mean since) | add ms (worst) |\n|---|---|---|---|---|\n");
  int since = 0;
  for (int n = 0; n <= 10000; ++n) {
    if (n == 1000 || n == 2000 || n == 5000 || n == 10000) {
      double query_ms = 0.0;
      for (int q = 0; q < kQueries; ++q) {
        const Picture asked = made_up.view(n + 5 * q);  // a new place among old ones
        const double start = thread_ms();
        if (database.query(*asked).best(30, {}).empty()) std::printf("nothing found\n");
        query_ms += (thread_ms() - start) / kQueries;
      }
      std::printf("| %d | %zu | %.2f | %.2f | %.2f |\n", n,
                  database.vocabulary().word_count(places::Kind::kPoint), query_ms, add_ms / since,
                  worst_add);
      std::fflush(stdout);
      add_ms = worst_add = 0.0;
      since = 0;
    }
    const Picture picture = made_up.view(n);
    const double start = thread_ms();
    database.add({0, n}, picture);
    const double ms = thread_ms() - start;
    add_ms += ms;
    worst_add = std::max(worst_add, ms);
    ++since;
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures place recognition on its own");
  std::vector<std::string> inputs;
  std::string pipelines = PLUMBLINE_SOURCE_DIR "/pipelines";
  double step = 0.2;
  bool speed = false;
  bool verified = false;
  bool tell = false;
  int threads = 1;
  app.add_option("INPUT", inputs, "Recordings with truth, or synth:SCENE?...")->required();
  app.add_option("--step", step, "Seconds between keyframes");
  app.add_flag("--speed", speed, "Query times in a database of 1 000 and 10 000 keyframes");
  app.add_flag("--verify", verified, "Verify the best hits by geometry");
  app.add_flag("--tell", tell, "With --verify: every pair, on stderr");
  app.add_option("--threads", threads, "Pictures made side by side")->check(CLI::Range(1, 256));
  app.add_option("--pipelines-dir", pipelines, "Folder with cameras/ and scenes/");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  const core::Executor executor(threads);
  if (verified) {
    std::printf(
        "| recording | features | pictures | revisits | recall | pairs accepted | wrong | recall at 100 %% "
        "precision | median error m | ms a pair |\n|---|---|---|---|---|---|---|---|---|---|\n");
  } else if (!speed) {
    std::printf(
        "| recording | features | pictures | revisits | best hit right | recall, score | recall, relative "
        "score | words | add ms | query ms |\n|---|---|---|---|---|---|---|---|---|---|\n");
  }
  for (const std::string& input : inputs) {
    const auto filmed = film(input, pipelines, step, executor);
    if (!filmed) {
      std::fprintf(stderr, "bench_places: %s\n", filmed.error().message.c_str());
      return static_cast<int>(filmed.error().kind);
    }
    const std::vector<Shot>& shots = filmed->shots;
    if (speed) {
      print_speed(shots);
      continue;
    }
    const std::string name = input.substr(input.find_last_of("/:") + 1);
    for (const auto& [label, points, lines] :
         {std::tuple{"points + lines", true, true}, std::tuple{"points", true, false},
          std::tuple{"lines", false, true}}) {
      if (verified) {
        const Verified v = verify(*filmed, points, lines, tell && points && lines);
        std::printf("| %s | %s | %zu | %d | %.2f | %d | %d | %.2f | %.3f | %.1f |\n", name.c_str(), label,
                    shots.size(), v.revisits,
                    v.revisits > 0 ? static_cast<double>(v.found) / v.revisits : 0.0, v.accepted, v.wrong,
                    recall_without_wrong(v), v.error_m.empty() ? 0.0 : v.error_m[v.error_m.size() / 2],
                    v.tried > 0 ? v.ms / v.tried : 0.0);
        continue;
      }
      const Recall r = measure(shots, points, lines);
      std::printf("| %s | %s | %zu | %d | %.2f | %.2f | %.2f | %.0f | %.2f | %.2f |\n", name.c_str(), label,
                  shots.size(), r.revisits,
                  r.revisits > 0 ? static_cast<double>(r.first_right) / r.revisits : 0.0, r.absolute,
                  r.relative, r.words, r.add_ms, r.query_ms);
    }
    std::fflush(stdout);
  }
  return 0;
}
