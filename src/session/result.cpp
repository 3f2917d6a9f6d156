// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/session/result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "guarded.hpp"
#include "pictures.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The value at a place such as "/verdict/sentence", if it is there and of this kind.
template <typename T>
std::optional<T> value_at(const Json& summary, const char* place) {
  const Json::json_pointer pointer(place);
  if (!summary.contains(pointer) || summary.at(pointer).is_null()) return std::nullopt;
  return summary.at(pointer).get<T>();
}

/// The verdict of summary.json; values that an older version did not write stay unknown.
Verdict verdict_of(const Json& summary) {
  Verdict verdict;
  verdict.trustworthy = value_at<bool>(summary, "/trustworthy").value_or(false);
  verdict.reason = value_at<std::string>(summary, "/reason").value_or("");
  verdict.sentence = value_at<std::string>(summary, "/verdict/sentence").value_or("");

  // Accuracy that the run expects from its own checks
  verdict.expected_m = value_at<double>(summary, "/verdict/accuracy/expected_m");
  verdict.p95_m = value_at<double>(summary, "/verdict/accuracy/p95_m");
  verdict.lengths = value_at<double>(summary, "/verdict/accuracy/lengths");
  verdict.unchecked =
      value_at<std::vector<std::string>>(summary, "/verdict/unchecked").value_or(verdict.unchecked);

  // Share of the recording that was tracked
  verdict.tracked = value_at<double>(summary, "/verdict/coverage/tracked").value_or(0.0);
  verdict.lost_s = value_at<double>(summary, "/verdict/coverage/lost_s").value_or(0.0);
  return verdict;
}

/// The covariance of (rho, phi) in Exp(rho, phi) camera_from_world, as that of the position and of turns
/// about the world's axes.
geometry::Matrix6d in_world(const geometry::Matrix6d& kept, const geometry::Rigid3& world_from_camera) {
  geometry::Matrix6d turn = geometry::Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = world_from_camera.rotation;
  return turn * kept * turn.transpose();
}

}  // namespace

struct Result::Impl {
  maps::ResultFolder result;
  std::shared_ptr<void> kept;
  Verdict verdict;
  std::string sigma_note;  ///< why covariances are not known
  session::KeyframePictures pictures;

  [[nodiscard]] fs::path store() const { return result.folder / maps::kStoreFile; }

  /// The folder of a robot's files; "": the only one's.
  [[nodiscard]] core::Result<fs::path> folder_of(const std::string& robot) const {
    std::string names;
    const std::vector<fs::path> folders = result.robot_folders();
    for (const fs::path& folder : folders) {
      if (robot.empty() ? folders.size() == 1 : folder.filename() == core::folder_name(robot)) return folder;
      names += (names.empty() ? "" : ", ") + folder.filename().string();
    }
    if (folders.front() == result.folder) return folders.front();  // a robot alone needs no name
    return core::input_error(fmt::format("{}: name one of its robots: {}", result.folder.string(), names));
  }
};

Result::Result(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

core::Result<Result> Result::open(const fs::path& folder, std::shared_ptr<void> kept) {
  return session::guarded([&]() -> core::Result<Result> {
    auto result = maps::open_result(folder);
    if (!result) return tl::unexpected(result.error());
    const auto summary = core::read_json(result->summary());
    if (!summary) return tl::unexpected(summary.error());

    // The last owner removes a temporary folder
    auto impl = std::make_shared<Impl>();
    impl->result = std::move(*result);
    impl->kept = std::move(kept);

    // Other versions may store values of other types
    try {
      impl->verdict = verdict_of(*summary);
      impl->sigma_note = value_at<std::string>(*summary, "/refine/sigma_note").value_or("");
    } catch (const Json::exception&) {
      return core::input_error(
          fmt::format("{}: is not a summary of this version; map again", impl->result.summary().string()));
    }
    return Result(std::move(impl));
  });
}

const fs::path& Result::folder() const { return impl_->result.folder; }
const Verdict& Result::verdict() const { return impl_->verdict; }

std::vector<std::string> Result::robots() const {
  std::vector<std::string> names;
  for (const fs::path& folder : impl_->result.robot_folders())
    names.push_back(folder == impl_->result.folder ? "" : folder.filename().string());
  return names;
}

core::Result<cloud::CloudFile> Result::cloud() const {
  return session::guarded([&] { return maps::read_result_cloud(impl_->result); });
}

core::Result<geometry::Trajectory> Result::path(const std::string& robot) const {
  return session::guarded([&] {
    return impl_->folder_of(robot).and_then(
        [](const fs::path& folder) { return dataset::read_trajectory(folder / "trajectory.txt"); });
  });
}

core::Result<sensor::Camera> Result::camera(const std::string& robot) const {
  return session::guarded([&] {
    return impl_->folder_of(robot).and_then([&](const fs::path& folder) {
      // A robot of a joint map may have a camera file in its own folder
      const fs::path own = folder / "camera.yaml";
      return sensor::read_camera(fs::exists(own) ? own : impl_->result.folder / "camera.yaml");
    });
  });
}

core::Result<std::vector<Keyframe>> Result::keyframes() const {
  return session::guarded([&]() -> core::Result<std::vector<Keyframe>> {
    const auto run = maps::StoredRun::open_main(impl_->store());
    if (!run) return tl::unexpected(run.error());
    const auto fusion = run->fusion_state();
    if (!fusion) return tl::unexpected(fusion.error());

    // Names of the robots by number
    std::map<std::int32_t, std::string> names;
    for (const maps::RobotInfo& robot : run->stored().header.robots) names[robot.number] = robot.name;

    // Poses in the order of the store
    std::vector<Keyframe> all;
    for (const maps::KeyframePose& pose : run->keyframes()) {
      Keyframe keyframe{names[pose.id.robot], pose.id.index, pose.stamp, pose.world_from_camera, {}, {}};

      // Covariances exist for keyframes that the last adjustment reached
      const auto known = fusion->covariances.find({pose.id.robot, pose.stamp});
      if (known != fusion->covariances.end() && known->second.allFinite())
        keyframe.covariance = in_world(known->second, pose.world_from_camera);
      else
        keyframe.no_covariance =
            impl_->sigma_note.empty() ? "the adjustment did not reach this keyframe" : impl_->sigma_note;
      all.push_back(std::move(keyframe));
    }
    return all;
  });
}

core::Result<cv::Mat> Result::picture(const Keyframe& keyframe) const {
  return session::guarded(
      [&] { return impl_->pictures.read(impl_->store(), keyframe.robot, keyframe.number, keyframe.stamp); });
}

}  // namespace plumbline
