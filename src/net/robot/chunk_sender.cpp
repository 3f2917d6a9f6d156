// SPDX-License-Identifier: BSD-3-Clause
#include "robot/chunk_sender.hpp"

#include <algorithm>
#include <utility>

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr int kSentAtATime = 4;  // before the hub's status is read again
/// A chunk that was received but is not in the hub's status after this time was lost with a link or process.
constexpr auto kLost = 1600ms;
constexpr auto kFreshStatus = 1100ms;

std::int64_t held(const HubStatus& hub, maps::StoreStream stream) {
  return stream == maps::StoreStream::kMap ? hub.map_held : hub.clouds_held;
}

bool is_receiving(const HubStatus& hub, const ChunkedTransaction& transaction) {
  return hub.incoming == transaction.number() && hub.checksum == transaction.checksum();
}

}  // namespace

/// Selects the first transaction that the hub lacks; clouds go last.
void ChunkSender::select(const StoreWatch& own, const HubStatus& hub) {
  for (const maps::StoreStream stream : maps::kStoreStreams) {
    const std::int64_t after = held(hub, stream);
    if (own.heads()[stream] <= after) continue;
    auto next = maps::next_transaction(own.store(), stream, after);
    if (!next || !*next) continue;

    sending_.emplace(Sending{ChunkedTransaction(stream, after, std::move(**next)), 0, 0, std::nullopt});
    if (is_receiving(hub, sending_->transaction)) sending_->index = hub.chunks;
    return;
  }
}

void ChunkSender::send(const RobotStatus& robot, const StoreWatch& own, const HubStatus& hub,
                       Clock::time_point received_at) {
  // A new reader may lack less than the one before: select again.
  const bool has_reader = bus_->has_reader();
  if (has_reader && !had_reader_) sending_.reset();
  had_reader_ = has_reader;
  if (!has_reader) return;

  // The hub has this transaction: on to the next
  if (sending_ && held(hub, sending_->transaction.stream()) >= sending_->transaction.number())
    sending_.reset();
  if (!sending_) select(own, hub);
  if (!sending_) return;

  // A bounded number of chunks at a time
  for (int i = 0; i < kSentAtATime && sending_->index < sending_->transaction.count(); ++i) {
    Chunk next = sending_->transaction.chunk(sending_->index);
    next.name = robot.name;
    next.run = robot.run;
    next.incarnation = robot.incarnation;
    if (!bus_->send(next)) return;

    // Repeated bytes are counted for the summary
    sent_bytes_ += next.bytes.size();
    if (sending_->index < sending_->most) resent_bytes_ += next.bytes.size();
    sending_->most = std::max(sending_->most, ++sending_->index);
    sending_->settled.reset();
  }
  if (sending_->index == sending_->transaction.count()) resend_lost(hub, received_at);
}

/// Goes back to the first chunk that was received by the network but not by the hub.
void ChunkSender::resend_lost(const HubStatus& hub, Clock::time_point received_at) {
  if (!bus_->all_received()) {
    sending_->settled.reset();
    return;
  }
  if (!sending_->settled) sending_->settled = Clock::now();
  if (Clock::now() - *sending_->settled < kLost || received_at - *sending_->settled < kFreshStatus) return;

  const ChunkedTransaction& transaction = sending_->transaction;
  sending_->index = is_receiving(hub, transaction) ? std::min(hub.chunks, transaction.count()) : 0;
  sending_->settled.reset();
}

}  // namespace plumbline::net
