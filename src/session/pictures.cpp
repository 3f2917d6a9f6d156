// SPDX-License-Identifier: BSD-3-Clause
#include "pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "plumbline/dataset/jpeg.hpp"
#include "plumbline/exports/recordings.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/session/map.hpp"

namespace plumbline::session {
namespace {

/// The frame of that time, if it can be read.
std::optional<cv::Mat> color_at(const dataset::FrameSource& recording, double stamp) {
  constexpr double kSame_s = 5e-4;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (std::abs(recording.info(i).stamp - stamp) > kSame_s) continue;
    const auto frame = recording.read(i);
    return frame ? std::optional(frame->color) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

const dataset::FrameSource* KeyframePictures::recording(const maps::StoreHeader& header, std::size_t robot,
                                                        const std::filesystem::path& folder) {
  if (const auto known = recordings_.find(robot); known != recordings_.end()) return known->second.get();
  std::unique_ptr<dataset::FrameSource>& recording = recordings_[robot];
  const auto names = exports::recordings_of_run(header.configuration, folder);
  const auto pipelines = find_pipelines();
  if (names.size() != header.robots.size() || !pipelines) return nullptr;

  dataset::OpenOptions open;
  open.camera = names[robot].camera;
  open.format = names[robot].format.empty() ? "auto" : names[robot].format;
  open.cameras_folder = *pipelines / "cameras";
  if (executor_ == nullptr) executor_ = std::make_unique<core::Executor>();
  auto opened =
      pipeline::open_input(names[robot].input, open, *pipelines / "scenes", *executor_, *core::null_log());
  if (!opened) return nullptr;

  // Frames as the refined camera takes them, where the source can do that.
  const std::vector<maps::CameraVersion>& versions = header.robots[robot].versions;
  if (!versions.empty()) recording = (*opened)->taken_by(versions.back().camera);
  if (recording == nullptr) recording = std::move(*opened);
  return recording.get();
}

core::Result<cv::Mat> KeyframePictures::read(const std::filesystem::path& store, const std::string& robot,
                                             std::int32_t keyframe, double stamp) {
  const auto reader = maps::StoreReader::open(store);
  if (!reader) return tl::unexpected(reader.error());
  const std::vector<maps::RobotInfo>& robots = reader->header().robots;
  const auto info = std::find_if(robots.begin(), robots.end(),
                                 [&](const maps::RobotInfo& one) { return one.name == robot; });
  if (info == robots.end())
    return core::input_error(fmt::format("{}: has no robot '{}'", store.string(), robot));

  const std::lock_guard lock(mutex_);
  const auto place = static_cast<std::size_t>(info - robots.begin());
  const dataset::FrameSource* frames = recording(reader->header(), place, store.parent_path());
  auto color = frames != nullptr ? color_at(*frames, stamp) : std::nullopt;
  if (color) return std::move(*color);

  // The store has it whole, small, or not at all.
  const core::KeyframeId id{info->number, keyframe};
  for (const auto& kept : {reader->whole_picture(id), reader->small_picture(id)}) {
    if (!kept) return tl::unexpected(kept.error());
    if (!kept->empty()) return dataset::decode_jpeg_bytes(*kept);
  }
  return core::input_error(
      fmt::format("{}: has no picture of keyframe {}, and its recording cannot be read any more",
                  store.string(), keyframe));
}

}  // namespace plumbline::session
