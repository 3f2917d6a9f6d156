// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The one queue of frames that arrive while others are read: numbered, bounded in memory, some of them kept.
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "plumbline/core/packed_blocks.hpp"
#include "plumbline/dataset/live_frame_source.hpp"

namespace plumbline::dataset {

using SharedBytes = std::shared_ptr<const core::Bytes>;

/// A frame with its images as the camera sent them.
struct LiveEntry {
  double stamp = 0.0;        ///< seconds
  double depth_stamp = 0.0;  ///< seconds, without the camera's depth_delay_s
  SharedBytes color;
  SharedBytes depth;
  std::optional<geometry::Rigid3> odometry{};
};

/// Thread-safe.
class LiveQueue {
 public:
  enum class Answer {
    kTaken,
    kEnded,
    kBackwards,  ///< not later than the last one by a microsecond, the unit of written trajectories
    kFull        ///< the waiting frames have `most_bytes` or more
  };

  explicit LiveQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}
  Answer push(LiveEntry entry);
  /// No more frames will come.
  void end();
  /// No more frames will come, and the others are not needed.
  void abandon();

  [[nodiscard]] std::size_t size() const;
  /// Frames that have not been handed out.
  [[nodiscard]] std::size_t waiting() const;
  [[nodiscard]] bool wait_for_room(std::size_t most, double seconds) const;
  [[nodiscard]] PairInfo info(std::size_t index) const;
  /// Null: it was released, or never came.
  [[nodiscard]] SharedBytes image(ImageId id) const;
  [[nodiscard]] std::optional<geometry::Rigid3> odometry(std::size_t index) const;

  // These are LiveFrameSource's.
  [[nodiscard]] bool decided(std::size_t index) const;
  void wait_for(std::size_t index, std::chrono::milliseconds most) const;
  [[nodiscard]] bool is_last(std::size_t index, const core::StopToken& stop) const;
  [[nodiscard]] bool given_up() const;
  /// Counts of frames that were taken and kept.
  [[nodiscard]] LiveReport report() const;
  void hand_out(std::size_t index);
  void keep(std::size_t index);
  void release(std::size_t index);
  void keep_in(const std::filesystem::path& folder);

 private:
  struct Frame {
    LiveEntry entry;                    ///< without images: they are in the file alone
    std::optional<std::size_t> kept{};  ///< block of colour, that of depth is the next
  };
  [[nodiscard]] bool settled(std::size_t index) const { return index < infos_.size() || ended_; }
  [[nodiscard]] bool full() const { return waiting_bytes_ > 0 && waiting_bytes_ >= most_bytes_; }
  void stop_waiting(std::size_t index);

  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool ended_ = false;
  bool abandoned_ = false;
  std::vector<PairInfo> infos_;
  std::map<std::size_t, Frame> frames_;  ///< those that can be read
  std::size_t handed_out_ = 0;           ///< frames before it do not wait
  std::size_t waiting_bytes_ = 0;
  core::PackedBlocks kept_;
};

}  // namespace plumbline::dataset
