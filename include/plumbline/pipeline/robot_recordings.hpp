// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One or several recordings, each of a robot of its own, as one source of frames.
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/dataset/live_frame_source.hpp"
#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

/// Frames come in the order of their stamps, ties by robot. If recordings do not overlap in
/// time, the seconds since each one's first frame are used instead.
class RobotRecordings : public dataset::FrameSource {
 public:
  /// One recording per robot, numbered in this order; of several with the same name, later ones get a number
  /// appended. Throws std::invalid_argument without recordings, or when one of several is live.
  explicit RobotRecordings(std::vector<std::unique_ptr<dataset::FrameSource>> recordings);

  [[nodiscard]] const std::vector<RobotInfo>& robots() const { return robots_; }
  [[nodiscard]] const RobotInfo& robot(std::int32_t number) const {
    return robots_.at(static_cast<std::size_t>(number));
  }
  [[nodiscard]] std::int32_t robot_of(std::size_t index) const { return place(index).robot; }
  /// Number of the frame within its recording.
  [[nodiscard]] std::size_t frame_of(std::size_t index) const { return place(index).index; }
  [[nodiscard]] std::size_t frames_of(std::int32_t robot) const {
    return recordings_[static_cast<std::size_t>(robot)]->size();
  }
  /// Number of the frame with this stamp within a robot's recording; none: there is no such frame.
  [[nodiscard]] std::optional<std::size_t> frame_at(std::int32_t robot, double stamp) const;
  /// Time of a frame, seconds since the run began.
  [[nodiscard]] double time_of(std::size_t index) const { return place(index).time; }

  /// Frames from `from` on are read as taken by these cameras, one per robot, and still rectified into images
  /// of robot(...).camera. Sources that cannot do so stay unchanged. May run at the same time as read().
  void correct(std::size_t from, const std::vector<sensor::Camera>& cameras);

  /// A robot's recording as taken by another camera, rectified into the same images; null: it cannot be.
  [[nodiscard]] std::unique_ptr<dataset::FrameSource> taken_by(std::int32_t robot,
                                                               const sensor::Camera& camera) const {
    return recordings_[static_cast<std::size_t>(robot)]->taken_by(camera);
  }

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] const std::string& format() const override { return recordings_.front()->format(); }
  [[nodiscard]] const sensor::Camera& camera() const override { return recordings_.front()->camera(); }
  [[nodiscard]] std::size_t size() const override { return live_ != nullptr ? live_->size() : order_.size(); }
  /// The sum of what is missing, and the first doubt that one of the recordings has.
  [[nodiscard]] dataset::RecordingNotes notes() const override;
  [[nodiscard]] dataset::PairInfo info(std::size_t index) const override;
  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t index) const override;
  /// The live source, which can only be a single one; null: these are recordings.
  [[nodiscard]] dataset::LiveFrameSource* live() { return live_; }
  [[nodiscard]] const dataset::LiveFrameSource* live() const { return live_; }
  /// True if the frame is the last one of its robot; as LiveFrameSource's.
  [[nodiscard]] bool is_last(std::size_t index, const core::StopToken& stop) const;
  [[nodiscard]] std::optional<geometry::Trajectory> truth_of(std::int32_t robot) const {
    return recordings_[static_cast<std::size_t>(robot)]->truth();
  }
  [[nodiscard]] const dataset::FrameSource& recording(std::int32_t robot) const {
    return *recordings_[static_cast<std::size_t>(robot)];
  }
  /// Truth of a single recording; none for several.
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override {
    return recordings_.size() == 1 ? recordings_.front()->truth() : std::nullopt;
  }

 private:
  struct Place {
    double time = 0.0;
    std::int32_t robot = 0;
    std::size_t index = 0;  ///< in its recording
  };
  [[nodiscard]] Place place(std::size_t index) const;
  [[nodiscard]] const dataset::FrameSource& of(const Place& place) const {
    return *recordings_[static_cast<std::size_t>(place.robot)];
  }
  [[nodiscard]] std::shared_ptr<const dataset::FrameSource> corrected(std::size_t index) const;
  std::string name_;
  std::vector<std::unique_ptr<dataset::FrameSource>> recordings_;
  dataset::LiveFrameSource* live_ = nullptr;
  std::vector<RobotInfo> robots_;
  std::vector<Place> order_;  ///< empty for live sources
  mutable std::mutex mutex_;  ///< of what follows
  std::size_t corrected_from_ = 0;
  std::vector<std::shared_ptr<const dataset::FrameSource>> corrected_;  ///< by robot; empty: none
};

}  // namespace plumbline::pipeline
