// SPDX-License-Identifier: BSD-3-Clause
#include "robots/robot_cameras.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

namespace plumbline::pipeline {
namespace {

// Size of the map when its camera is estimated: keyframes, or seconds of the recording; fewer seconds do if
// they have as many frames as an estimate uses at most.
constexpr std::size_t kKeyframes = 40;
constexpr double kSeconds = 10.0;
constexpr double kLeastSeconds = 6.5;
constexpr std::size_t kFrames = 200;
// Frames from the start of an estimate until its answer is awaited, and from then until it is used: by then
// no frame for which it is used has been read, for any number of threads. No estimate is started if it would
// not be used. A live source has no known end: the answer is used once that many more frames have arrived.
constexpr std::size_t kAnswerFrames = 32;
constexpr std::size_t kUseFrames = kMostUnderWay;
// Most estimates from a finished map. Effects of a wrong camera on a map that was made with it show only
// after it is rebuilt; one that a better camera has made is asked once.
constexpr int kMostQuestions = 2;

}  // namespace

RobotCameras::RobotCameras(RobotRecordings& recordings, bool refine, int pictures, BeginSlam begin,
                           const RunContext& context)
    : recordings_(&recordings),
      begin_(std::move(begin)),
      services_(context.services),
      executor_(context.executor),
      log_(context.log),
      pictures_(pictures),
      choices_(recordings.robots().size()),
      robots_(recordings.robots()) {
  // Generated recordings have no lens, and no error but on request.
  asked_ = recordings.format() == "synth" && recordings.taken_by(0, recordings.robot(0).camera) == nullptr;
  refine_ = refine && !asked_;
  for (const RobotInfo& robot : robots_) cameras_.emplace_back(robot);
}

std::vector<sensor::Camera> RobotCameras::now() const {
  std::vector<sensor::Camera> cameras;
  for (const CameraRefinement& camera : cameras_) cameras.push_back(camera.camera());
  return cameras;
}

bool RobotCameras::knows_enough(std::size_t frame, const Slams& slams) const {
  const double seconds = recordings_->time_of(frame) - recordings_->time_of(0);
  return seconds >= kSeconds || (seconds >= kLeastSeconds && frame >= kFrames) ||
         std::all_of(slams.begin(), slams.end(),
                     [](const auto& slam) { return slam->map().keyframe_count() >= kKeyframes; });
}

void RobotCameras::after(std::size_t frame, const Slams& slams) {
  if (!refine_ || asked_ || !knows_enough(frame, slams)) return;
  asked_ = true;
  const bool ends_before = frame + kAnswerFrames + kUseFrames >= recordings_->size();
  if (ends_before && recordings_->live() == nullptr) return;

  answered_ = true;
  for (CameraRefinement& camera : cameras_) camera.asked_at(static_cast<std::int64_t>(frame));
  tell();
  ask(frame, slams);
}

void RobotCameras::ask(std::size_t asked_at, const Slams& slams) {
  question_ = std::make_unique<Question>();
  question_->cameras = cameras_;
  question_->better.resize(cameras_.size());
  question_->due = asked_at + kAnswerFrames;

  std::vector<std::pair<maps::Map, std::vector<maps::FramePose>>> maps;
  for (const auto& slam : slams) maps.emplace_back(slam->map(), slam->frame_poses());
  question_->job = executor_->submit([question = question_.get(), maps = std::move(maps), log = log_] {
    const core::Executor here(1);
    for (std::size_t r = 0; r < maps.size(); ++r)
      question->better[r] = question->cameras[r].ask(maps[r].first, maps[r].second, here, *log);
  });
}

void RobotCameras::take_answer(std::size_t frame) {
  question_->job.wait();
  use_from_ = frame + kUseFrames;
  given_ = std::exchange(cameras_, question_->cameras);
  waiting_ = question_->better;
  question_.reset();
  if (std::count(waiting_.begin(), waiting_.end(), true) > 0) recordings_->correct(use_from_, now());
  for (std::size_t r = 0; r < cameras_.size(); ++r) {
    if (waiting_[r]) cameras_[r].used_from(use_from_);
  }
  tell();
}

void RobotCameras::tell() {
  if (!refine_) return;
  for (std::size_t r = 0; r < cameras_.size(); ++r) robots_[r].estimate = cameras_[r].known();
  ++news_;
}

bool RobotCameras::before(std::size_t frame, std::size_t robot, Slams& slams) {
  if (ask_again_ && frame > *ask_again_) {
    ask(*ask_again_, slams);
    ask_again_.reset();
  }
  if (question_ != nullptr && frame >= question_->due) take_answer(frame);
  if (waiting_.empty() || !waiting_[robot] || frame < use_from_) return false;
  waiting_[robot] = false;
  use(robot, true, slams[robot]);
  return true;
}

bool RobotCameras::may_read_again(std::size_t frame, std::size_t robot, core::KeyframeId keyframe) {
  const bool taken = choices_[robot].takes(keyframe.valid());
  const bool before = !answered_ || question_ != nullptr || frame < use_from_;
  return refine_ && (keyframe.valid() ? keyframe.index < pictures_ : taken && before);
}

void RobotCameras::use(std::size_t robot, bool again, std::unique_ptr<mapping::Slam>& slam) {
  const auto number = static_cast<std::int32_t>(robot);
  const sensor::Camera& camera = cameras_[robot].camera();
  robots_[robot].versions.push_back({camera, slam->map().next_keyframe_id(number).index,
                                     static_cast<std::int32_t>(slam->frame_poses().size())});
  const std::shared_ptr<const dataset::FrameSource> pictures = recordings_->taken_by(number, camera);

  // A picture that a live source would not have kept is not read from a recording either.
  std::size_t end = std::numeric_limits<std::size_t>::max();
  for (const core::KeyframeId id : slam->map().keyframe_ids()) {
    if (id.index >= pictures_)
      end = std::min(end, static_cast<std::size_t>(slam->map().keyframe(id).frame_index));
  }

  const auto read = [&](std::size_t index) -> std::optional<sensor::RgbdFrame> {
    if (pictures == nullptr || index >= end) return std::nullopt;
    auto frame = pictures->read(index);
    if (!frame) return std::nullopt;
    return std::move(*frame);
  };

  if (again && pictures != nullptr && services_->features) {
    mapping::SecondPass pass;
    pass.camera = camera;
    pass.read = [&](double stamp) -> std::optional<std::pair<sensor::RgbdFrame, mapping::Slam::Features>> {
      const auto index = recordings_->frame_at(number, stamp);
      auto frame = index ? read(*index) : std::nullopt;
      if (!frame) return std::nullopt;
      auto features = services_->features(*frame, number);
      return std::pair(std::move(*frame), std::move(features));
    };

    pass.begin = [&] {
      auto begun = begin_(robots_[robot]);
      begun->set_camera(camera);
      return begun;
    };

    if (auto mapped = mapping::map_again(*slam, pass, *executor_)) {
      log_->debug(fmt::format("{}: {} frames were mapped again with the better camera", robots_[robot].name,
                              slam->frame_poses().size()));
      slam = std::move(mapped);
      return;
    }
  }

  slam->recalibrate(camera, [&read](std::int64_t index) { return read(static_cast<std::size_t>(index)); });
}

void RobotCameras::estimate_finished(Slams& slams) {
  if (!refine_) return;
  // A live source ended before the answer was used: it is dropped, because for a recording of that length no
  // estimate would have been made before its end.
  if (recordings_->live() != nullptr && answered_ &&
      (question_ != nullptr || recordings_->size() <= use_from_)) {
    if (!waiting_.empty()) cameras_ = given_;
    for (CameraRefinement& camera : cameras_) camera.asked_at(-1);
    waiting_.assign(waiting_.size(), false);

    answered_ = false;
  }

  for (std::size_t r = 0; r < slams.size(); ++r) {
    std::unique_ptr<mapping::Slam>& slam = slams[r];
    if (!waiting_.empty() && waiting_[r])
      use(r, true, slam);  // its last frame came before the answer was used
    for (int i = robots_[r].versions.empty() ? 0 : 1; i < kMostQuestions; ++i) {
      if (!cameras_[r].ask(slam->map(), slam->frame_poses(), *executor_, *log_)) break;
      use(r, !answered_ && i == 0, slam);
    }
  }

  tell();
  for (const Json& pair : camera_pairs(robots_)) log_->info(pair.at("text").get<std::string>());
}

void RobotCameras::resume(const std::vector<RobotInfo>& robots, Slams& slams) {
  given_ = cameras_;
  std::vector<bool> waiting(cameras_.size());
  for (const RobotInfo& stored : robots) {
    const auto number = static_cast<std::size_t>(stored.number);
    CameraRefinement& camera = cameras_.at(number);
    camera.restore(stored);
    robots_[number].versions = stored.versions;
    if (!stored.versions.empty()) slams.at(number)->set_camera(camera.camera());

    // A question without answer is asked again; an answer that was not used waits for its frame.
    const maps::CameraEstimate& known = camera.known();
    answered_ = answered_ || known.asked_at >= 0;
    asked_ = asked_ || answered_ || known.better;
    if (known.asked_at >= 0 && known.answers == 0) ask_again_ = static_cast<std::size_t>(known.asked_at);
    use_from_ = std::max(use_from_, static_cast<std::size_t>(known.used_from));
    waiting[number] = known.better && stored.versions.empty();
  }

  tell();
  if (answered_ && !ask_again_) waiting_ = std::move(waiting);
  const auto better = [](const CameraRefinement& camera) { return camera.known().better; };
  if (refine_ && std::any_of(cameras_.begin(), cameras_.end(), better))
    recordings_->correct(use_from_, now());
}

Json RobotCameras::section() const {
  Json list = Json::array();
  for (std::size_t r = 0; r < cameras_.size(); ++r) {
    if (!refine_ && !robots_[r].camera.guess) continue;
    RobotInfo robot = robots_[r];
    robot.estimate = cameras_[r].known();
    if (!refine_) robot.estimate->doubt = "no camera file was given: the camera is a guess";
    list.push_back(camera_section(robot));
  }
  return list;
}

void RobotCameras::doubt(std::vector<Doubt>& reasons) const {
  for (const Json& camera : section()) {
    const auto text = camera.at("doubt").get<std::string>();
    if (!text.empty()) reasons.push_back({Doubt::About::kCamera, text});
  }
}

}  // namespace plumbline::pipeline
