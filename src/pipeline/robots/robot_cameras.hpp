// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The cameras of all robots of a run, estimated from the maps: once while they grow, beside the tracker, and
// again when they are finished (CameraRefinement).
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/mapping/second_pass.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/stage.hpp"
#include "robots/camera_refinement.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

using Slams = std::vector<std::unique_ptr<mapping::Slam>>;  ///< by robot

class RobotCameras {
 public:
  /// `refine`: estimate the cameras. `pictures`: keyframes of each robot that may be read again. All
  /// arguments must outlive this. `begin`: a Slam of that robot that has seen nothing.
  using BeginSlam = std::function<std::unique_ptr<mapping::Slam>(const RobotInfo&)>;
  RobotCameras(RobotRecordings& recordings, bool refine, int pictures, BeginSlam begin,
               const RunContext& context);

  /// The robots, with all refined versions of their cameras and what is known of these.
  [[nodiscard]] const std::vector<RobotInfo>& robots() const { return robots_; }
  /// Each camera as far as it is known now.
  [[nodiscard]] std::vector<sensor::Camera> now() const;

  /// Called before a frame is tracked: waits for the answer when it is due, and uses it from the first frame
  /// that is read with it. True: the robot's map was made anew for its camera.
  bool before(std::size_t frame, std::size_t robot, Slams& slams);
  /// Called after a frame was tracked: starts the estimate from the present maps, beside the tracker, once.
  void after(std::size_t frame, const Slams& slams);
  /// True if the picture of a frame that was tracked may be read again; to be called for each. `keyframe`:
  /// what it became, invalid if it became none.
  [[nodiscard]] bool may_read_again(std::size_t frame, std::size_t robot, core::KeyframeId keyframe);
  /// Estimates from the finished maps, until nothing improves any more.
  void estimate_finished(Slams& slams);

  /// Goes on where an interrupted run stopped; `robots`: as stored. The maps are restored after that.
  void resume(const std::vector<RobotInfo>& robots, Slams& slams);
  /// Grows with everything that is learnt of a camera.
  [[nodiscard]] int news() const { return news_; }

  [[nodiscard]] Json section() const;
  void doubt(std::vector<Doubt>& reasons) const;

 private:
  /// The maps and cameras of an estimate in progress.
  struct Question {
    std::vector<CameraRefinement> cameras;  ///< by robot
    std::vector<bool> better;               ///< by robot: true if its camera was improved
    std::size_t due = 0;                    ///< the frame at which it is waited for
    core::Executor::Job job;                ///< last: its destructor waits for it
  };
  [[nodiscard]] bool knows_enough(std::size_t frame, const Slams& slams) const;
  /// Starts the estimate that belongs after that frame.
  void ask(std::size_t asked_at, const Slams& slams);
  void take_answer(std::size_t frame);
  /// Notes in robots() what is known.
  void tell();
  /// Makes the robot's map anew for its camera as it is known now: the recording is mapped again if it is
  /// `again`, and can be, else the map is rebuilt.
  void use(std::size_t robot, bool again, std::unique_ptr<mapping::Slam>& slam);

  RobotRecordings* recordings_;
  BeginSlam begin_;
  std::shared_ptr<const RunServices> services_;
  const core::Executor* executor_;
  core::Log* log_;
  bool refine_;
  int pictures_;
  bool asked_;                                      ///< while mapping
  bool answered_ = false;                           ///< while mapping: what came before is not read any more
  std::vector<mapping::SecondPassChoice> choices_;  ///< by robot
  std::vector<RobotInfo> robots_;
  std::vector<CameraRefinement> cameras_;  ///< by robot
  std::vector<CameraRefinement> given_;    ///< cameras before the estimate
  std::optional<std::size_t> ask_again_;   ///< frame after which the interrupted run asked, unanswered
  std::unique_ptr<Question> question_;     ///< estimate in progress; null: none
  int news_ = 0;
  std::size_t use_from_ = 0;   ///< frame from which the answer is used
  std::vector<bool> waiting_;  ///< by robot: its first frame from there on has not come; empty: no answer yet
};

}  // namespace plumbline::pipeline
