// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of a camera as they come: a thread takes messages, pairs them by stamp and puts them into a queue.
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "bags/body_messages.hpp"
#include "live/live_queue.hpp"
#include "live/live_record.hpp"
#include "live/live_survey.hpp"
#include "live/stamp_pairs.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/side_thread.hpp"
#include "plumbline/core/stop.hpp"
#include "plumbline/dataset/message_stream.hpp"

namespace plumbline::dataset {

/// One of the two topics.
struct LiveTopic {
  BagTopic topic;
  const MessageDecoder* decoder = nullptr;
};

/// Fills a queue with the frames of a network.
class LiveStream {
 public:
  struct Options {
    std::string address;
    double max_pair_gap_s = 0.02;
    double depth_delay_s = 0.0;
    double for_s = 1e300;
    core::StopToken stop;
    std::size_t most_waiting_bytes = 0;  ///< of the queue, for messages
    std::vector<BagTopic> body;          ///< topics of wheels and inertial sensors
  };

  LiveStream(std::unique_ptr<MessageStream> stream, LiveTopic color, LiveTopic depth,
             std::shared_ptr<LiveQueue> queue, Options options, core::Log& log);
  ~LiveStream();
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

  /// Adds a message that was received earlier; before start().
  void add(const LiveMessage& message);
  /// Starts the thread that receives messages; call it once. `record`, which may be null, gets all frames,
  /// also those that have a number already.
  void start(std::unique_ptr<LiveRecord> record);
  /// Receives messages until there is a first frame, before start(); false if none arrived in time.
  bool wait_for_first(std::chrono::milliseconds most);

  // The functions below are thread-safe.
  /// Counts of images that became no frames.
  [[nodiscard]] LiveReport counts() const;
  /// These are BodySource's; the frame that odometry is about is "" as long as there is none.
  [[nodiscard]] BodyReadings body_readings(double imu_after, double odometry_after, double until) const;
  [[nodiscard]] std::string body_frame() const;
  /// Ends the source and closes the record. Error (kOutput): it could not be written.
  core::Result<void> finish();

 private:
  void work(const core::StopToken& enough);
  void take(const LiveMessage& message);
  void number(const StampPairs::Pair& pair);
  void tell_silence();
  /// Counts a frame that is left out, and warns of the first.
  void leave_out(std::size_t LiveReport::*count, const std::string& why);

  std::unique_ptr<MessageStream> stream_;
  const LiveTopic color_;
  const LiveTopic depth_;
  const std::shared_ptr<LiveQueue> queue_;
  const Options options_;
  core::Log& log_;
  StampPairs pairs_;  ///< used by the thread only
  std::chrono::steady_clock::time_point first_taken_;
  std::chrono::steady_clock::time_point last_taken_;
  bool told_silence_ = false;
  bool started_ = false;
  std::vector<StampPairs::Pair> to_record_;  ///< numbered before there was a record
  std::unique_ptr<LiveRecord> record_;

  mutable std::mutex mutex_;  ///< guards the two members below
  LiveReport counts_;
  BodyMessages body_;
  std::unique_ptr<core::SideThread> thread_;
};

}  // namespace plumbline::dataset
