// SPDX-License-Identifier: BSD-3-Clause
#include "source/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "plumbline/core/config.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/dataset/body_readings.hpp"
#include "plumbline/dataset/jpeg.hpp"
#include "plumbline/exports/recordings.hpp"

namespace plumbline::exports {

std::vector<RecordingName> recordings_of_run(const std::string& configuration,
                                             const std::filesystem::path& folder) {
  const auto root = core::parse_yaml(configuration, "configuration");
  const core::ConfigNode* run = root ? root->find("run") : nullptr;
  if (run == nullptr || run->find("fed") != nullptr) return {};
  const auto text = [&](const std::string& key) {
    const core::ConfigNode* node = run->find(key);
    return node != nullptr ? node->scalar : std::string();
  };

  // Relative paths are seen from where the map was made, if something is there.
  const std::filesystem::path base = folder / text("folder");
  const auto found = [&](const std::string& path) {
    std::error_code ec;
    return !path.empty() && std::filesystem::exists(base / path, ec) ? (base / path).string() : path;
  };

  std::vector<RecordingName> names;
  for (std::size_t i = 1;; ++i) {
    const std::string input = text(i == 1 ? "input" : fmt::format("input{}", i));
    if (input.empty()) return names;
    names.push_back({found(input), found(text("camera")), text("format")});
  }
}

namespace {

/// Recordings of the run, by robot; those that the user names replace what the run has recorded.
core::Result<std::vector<RecordingName>> recordings_of(const MapSource& source,
                                                       const maps::StoredRun& store) {
  const maps::StoreHeader& header = store.stored().header;
  const std::size_t robots = header.robots.size();
  std::vector<RecordingName> names = recordings_of_run(header.configuration, store.file().parent_path());
  const std::vector<std::string>& given = source.request().recordings;
  if (given.empty() && names.size() == robots) return names;

  // Live runs, for example, name no recording
  if (given.empty()) {
    return core::input_error(fmt::format(
        "{}: does not say from which recordings it was made; name them with --recording, one for each robot",
        source.request().input.string()));
  }

  // Robots and recordings must match
  if (given.size() != robots) {
    return core::usage_error(
        fmt::format("--recording: {} given, the map is of {} robot{}; name one for each, in "
                    "the order of their names",
                    given.size(), robots, robots == 1 ? "" : "s"));
  }

  // The user's names, with the cameras of the run
  names.resize(robots);
  for (std::size_t i = 0; i < robots; ++i) {
    names[i].input = given[i];
    if (names[i].format.empty()) names[i].format = "auto";
  }

  return names;
}

/// Mean squared Laplacian: large where edges are steep.
double sharpness(const cv::Mat& gray) {
  double sum = 0.0;
  for (int y = 1; y + 1 < gray.rows; ++y) {
    const auto* above = gray.ptr<std::uint8_t>(y - 1);
    const auto* row = gray.ptr<std::uint8_t>(y);
    const auto* below = gray.ptr<std::uint8_t>(y + 1);
    for (int x = 1; x + 1 < gray.cols; ++x) {
      const int laplacian = above[x] + below[x] + row[x - 1] + row[x + 1] - 4 * row[x];
      sum += static_cast<double>(laplacian) * laplacian;
    }
  }
  return sum;
}

/// The sharpest of the frames that are nearer to a keyframe than to the next one.
core::Result<std::vector<ExportPose>> sharpest_near(const MapSource& source,
                                                    const std::vector<ExportPose>& keyframes,
                                                    const std::vector<ExportPose>& frames,
                                                    const Pictures& pictures) {
  constexpr double kReach_s = 0.35;  // of a keyframe's neighbourhood, to each side
  std::vector<ExportPose> chosen(keyframes.size());
  std::vector<double> best(keyframes.size(), -1.0);
  std::size_t at = 0;

  // Frames and keyframes are sorted, so that one pass suffices
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const ExportPose& frame = frames[f];
    const auto before = [&](std::size_t k) {
      return keyframes[k].robot != frame.robot
                 ? keyframes[k].robot < frame.robot
                 : std::abs(keyframes[k].stamp - frame.stamp) >=
                       (k + 1 < keyframes.size() && keyframes[k + 1].robot == frame.robot
                            ? std::abs(keyframes[k + 1].stamp - frame.stamp)
                            : 1e300);
    };

    // Frames near this keyframe only
    while (at + 1 < keyframes.size() && before(at)) ++at;
    source.progress(f, frames.size());
    const auto number = pictures.find(frame.robot, frame.stamp);
    if (!number || keyframes[at].robot != frame.robot ||
        std::abs(keyframes[at].stamp - frame.stamp) > kReach_s)
      continue;

    const auto picture = pictures.read(frame.robot, *number);
    if (!picture) continue;  // damaged: another one is chosen

    // The sharpest so far
    const double sharp = sharpness(picture->gray);
    if (sharp <= best[at]) continue;
    best[at] = sharp;
    chosen[at] = frame;
  }

  // Without a readable frame the keyframe stays
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    if (best[k] < 0.0) chosen[k] = keyframes[k];
  }

  return chosen;
}

}  // namespace

/// Pictures of the recordings, else those that the store holds.
core::Result<Pictures> Pictures::open(const MapSource& source) {
  auto recordings = open_recordings(source);
  if (recordings || !source.has_store() || !source.request().recordings.empty()) return recordings;
  const auto store = source.store("pictures");
  Pictures stored = open_stored(**store);
  if (stored.by_robot_.empty()) return recordings;
  return stored;
}

/// Pictures in the store, whose numbers are those of keyframes.
Pictures Pictures::open_stored(const maps::StoredRun& store) {
  Pictures pictures;
  const auto ids = store.reader().whole_picture_ids();
  if (!ids) return pictures;

  const maps::Map& map = store.stored().map;
  for (const core::KeyframeId id : *ids) {
    if (!map.has_keyframe(id)) continue;
    pictures.by_robot_[id.robot].stamps.emplace_back(map.keyframe(id).stamp,
                                                     static_cast<std::size_t>(id.index));
  }

  // find() needs sorted stamps
  for (auto& [robot, recording] : pictures.by_robot_)
    std::sort(recording.stamps.begin(), recording.stamps.end());
  pictures.reader_ = &store.reader();
  return pictures;
}

/// Opens the recording of each robot, with its refined camera.
core::Result<Pictures> Pictures::open_recordings(const MapSource& source) {
  const auto store = source.store("the cameras of pictures");
  if (!store) return tl::unexpected(store.error());

  // Only the caller knows how recordings are opened
  const maps::StoreHeader& header = (*store)->stored().header;
  if (!source.request().open)
    return core::input_error("recordings cannot be opened here; pictures are left out");

  const auto names = recordings_of(source, **store);
  if (!names) return tl::unexpected(names.error());

  // One recording for each robot
  Pictures pictures;
  for (std::size_t i = 0; i < header.robots.size(); ++i) {
    const maps::RobotInfo& robot = header.robots[i];
    Recording recording;
    auto opened = source.request().open((*names)[i]);
    if (!opened) return tl::unexpected(opened.error());

    // Images as the refined camera would have taken them
    recording.given = std::move(*opened);
    if (!robot.versions.empty())
      recording.corrected = recording.given->taken_by(robot.versions.back().camera);

    // find() needs sorted stamps
    for (std::size_t f = 0; f < recording.given->size(); ++f)
      recording.stamps.emplace_back(recording.given->info(f).stamp, f);
    std::sort(recording.stamps.begin(), recording.stamps.end());
    pictures.by_robot_.emplace(robot.number, std::move(recording));
  }

  return pictures;
}

std::vector<std::int32_t> Pictures::robots() const {
  std::vector<std::int32_t> numbers;
  for (const auto& [robot, recording] : by_robot_) numbers.push_back(robot);
  return numbers;
}

std::optional<geometry::Rigid3> Pictures::body_from_camera(std::int32_t robot) const {
  const auto found = by_robot_.find(robot);
  if (found == by_robot_.end()) return std::nullopt;
  const auto* body = dynamic_cast<const dataset::BodySource*>(found->second.given.get());
  if (body == nullptr) return std::nullopt;

  // The mount is known whether or not anything was measured in this time
  constexpr double kAnyTime_s = 1e300;
  return body->body_readings(kAnyTime_s, kAnyTime_s, kAnyTime_s).body_from_camera;
}

/// The frame with this stamp, which text files may have rounded.
std::optional<std::size_t> Pictures::find(std::int32_t robot, double stamp) const {
  constexpr double kSame_s = 5e-4;
  const auto recording = by_robot_.find(robot);
  if (recording == by_robot_.end()) return std::nullopt;
  const auto& stamps = recording->second.stamps;
  const auto found =
      std::lower_bound(stamps.begin(), stamps.end(), std::pair(stamp - kSame_s, std::size_t{0}));
  if (found == stamps.end() || found->first > stamp + kSame_s) return std::nullopt;
  return found->second;
}

core::Result<sensor::RgbdFrame> Pictures::read(std::int32_t robot, std::size_t frame) const {
  // Stored pictures are JPEG, without depth
  if (stored()) {
    const auto bytes = reader_->whole_picture({robot, static_cast<std::int32_t>(frame)});
    if (!bytes) return tl::unexpected(bytes.error());
    auto color = dataset::decode_jpeg_bytes(*bytes);
    if (!color) return tl::unexpected(color.error());
    sensor::RgbdFrame picture;
    picture.color = std::move(*color);
    cv::cvtColor(picture.color, picture.gray, cv::COLOR_BGR2GRAY);
    return picture;
  }

  // The refined camera, if it is known
  const Recording& recording = by_robot_.at(robot);
  return (recording.corrected ? *recording.corrected : *recording.given).read(frame);
}

/// Pictures, or nothing with a note that says why.
std::unique_ptr<Pictures> open_pictures(const MapSource& source, ExportSummary& summary) {
  auto pictures = Pictures::open(source);
  if (pictures) return std::make_unique<Pictures>(std::move(*pictures));
  const bool named = !source.request().recordings.empty() ||
                     pictures.error().message.find("--recording") != std::string::npos;
  summary.notes.push_back("poses only, without pictures: " + pictures.error().message +
                          (named ? "" : "; if the recording lies elsewhere now, name it with --recording"));
  return nullptr;
}

/// Poses to export with their pictures, named by robot and number.
core::Result<std::vector<Picture>> pictures_of(const MapSource& source, const Pictures* pictures) {
  const ExportOptions& options = source.options();
  auto keyframes = source.poses(true);
  if (!keyframes) return tl::unexpected(keyframes.error());

  // Frames replace or complete the keyframes
  std::vector<ExportPose> poses = *keyframes;
  if (options.sharpest || options.every > 0) {
    const auto frames = source.poses(false);
    if (!frames) return tl::unexpected(frames.error());
    if (options.sharpest && pictures == nullptr)
      return core::input_error("--sharpest: takes the pictures of the recording; name it with --recording");

    if (options.sharpest) {
      auto chosen = sharpest_near(source, *keyframes, *frames, *pictures);
      if (!chosen) return tl::unexpected(chosen.error());
      poses = std::move(*chosen);
    }

    // Every N-th frame
    for (std::size_t i = 0; options.every > 0 && i < frames->size();
         i += static_cast<std::size_t>(options.every))
      poses.push_back((*frames)[i]);
    const auto earlier = [](const ExportPose& a, const ExportPose& b) {
      return a.robot != b.robot ? a.robot < b.robot : a.stamp < b.stamp;
    };

    // A keyframe may also be an N-th frame
    std::stable_sort(poses.begin(), poses.end(), earlier);
    const auto same = [](const ExportPose& a, const ExportPose& b) {
      return a.robot == b.robot && a.stamp == b.stamp;
    };
    poses.erase(std::unique(poses.begin(), poses.end(), same), poses.end());
  }

  // Numbers count by robot
  std::vector<Picture> all;
  std::map<std::int32_t, int> numbers;
  for (const ExportPose& pose : poses) {
    Picture picture;
    picture.pose = pose;

    // Frames without a picture keep their pose
    const std::string number = fmt::format("{:06d}", ++numbers[pose.robot]);
    picture.name = pose.robot_name.empty() ? number : core::folder_name(pose.robot_name) + "_" + number;
    if (pictures != nullptr) picture.frame = pictures->find(pose.robot, pose.stamp);
    all.push_back(std::move(picture));
  }

  return all;
}

std::string pictures_text(const std::vector<Picture>& pictures) {
  const auto written = std::count_if(pictures.begin(), pictures.end(),
                                     [](const Picture& picture) { return picture.frame.has_value(); });
  if (static_cast<std::size_t>(written) == pictures.size()) return fmt::format("{} pictures", written);
  return fmt::format("{} poses, {} pictures", pictures.size(), written);
}

}  // namespace plumbline::exports
