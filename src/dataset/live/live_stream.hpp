// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of a camera as they come: messages are taken, paired by stamp and numbered by a thread of its own.
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "bags/body_messages.hpp"
#include "bags/message_images.hpp"
#include "live/kept_messages.hpp"
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

struct LiveCounts {
  std::size_t taken = 0;      ///< frames that got a number
  std::size_t dropped = 0;    ///< because too many waited already
  std::size_t backwards = 0;  ///< because their stamp is not later than the last one's
  std::size_t unpaired = 0;   ///< images of either kind without one of the other near them
  std::size_t lost = 0;       ///< messages, by the network
  std::size_t kept = 0;       ///< frames whose images were kept
  std::size_t kept_bytes = 0;
};

class LiveStream final : public MessageImages {
 public:
  struct Options {
    std::string address;
    double max_pair_gap_s = 0.02;
    double depth_delay_s = 0.0;
    double for_s = 1e300;
    core::StopToken stop;
    std::size_t most_waiting_bytes = 0;
    std::vector<BagTopic> body;  ///< topics of wheels and inertial sensors
  };

  LiveStream(std::unique_ptr<MessageStream> stream, LiveTopic color, LiveTopic depth, Options options,
             core::Log& log);
  ~LiveStream() override;
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
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] PairInfo info(std::size_t index) const;
  [[nodiscard]] std::vector<PairInfo> infos() const;
  /// As FrameSource's; frames before `index` no longer count as waiting.
  [[nodiscard]] bool decided(std::size_t index);
  void wait_for(std::size_t index, std::chrono::milliseconds most);
  void keep(std::size_t index);
  [[nodiscard]] std::string describe(ImageId id) const override;
  [[nodiscard]] LiveCounts counts() const;
  /// As FrameSource's; the frame that odometry is about is "" as long as there is none.
  [[nodiscard]] BodyReadings body_readings(double imu_after, double odometry_after, double until) const;
  [[nodiscard]] std::string body_frame() const;
  /// Ends the source and closes the record. Error (kOutput): it could not be written.
  core::Result<void> finish();

 private:
  struct Image {
    SharedBytes bytes;  ///< null: forgotten, or kept in the file
    std::optional<KeptMessages::Spot> spot;
  };
  struct Frame {
    Image color;
    Image depth;
    [[nodiscard]] std::size_t size() const {
      return (color.bytes ? color.bytes->size() : 0) + (depth.bytes ? depth.bytes->size() : 0);
    }
  };

  [[nodiscard]] core::Result<Message> message_of(ImageId id) const override;
  [[nodiscard]] const LiveTopic& topic_of(ImageId id) const {
    return id.list == ImageList::kColor ? color_ : depth_;
  }
  void work(const core::StopToken& enough);
  void take(const LiveMessage& message);
  void number(const StampPairs::Pair& pair);
  void tell_silence();
  void erase_unwanted();

  std::unique_ptr<MessageStream> stream_;
  const LiveTopic color_;
  const LiveTopic depth_;
  const Options options_;
  core::Log& log_;
  StampPairs pairs_;  ///< used by the thread only
  std::chrono::steady_clock::time_point first_taken_;
  std::chrono::steady_clock::time_point last_taken_;
  bool told_silence_ = false;
  bool started_ = false;
  std::vector<StampPairs::Pair> to_record_;  ///< numbered before there was a record
  std::unique_ptr<LiveRecord> record_;
  std::optional<std::int64_t> last_us_;  ///< stamp of the last frame

  mutable std::mutex mutex_;  ///< guards the members below
  std::condition_variable changed_;
  std::vector<PairInfo> infos_;
  std::map<std::size_t, Frame> frames_;  ///< those that can be read
  KeptMessages kept_;
  std::size_t reached_ = 0;    ///< frames before it have been handed out
  std::size_t forgotten_ = 0;  ///< frames before it are there only if they were kept
  std::size_t waiting_bytes_ = 0;
  LiveCounts counts_;
  BodyMessages body_;
  bool ended_ = false;
  std::unique_ptr<core::SideThread> thread_;
};

}  // namespace plumbline::dataset
