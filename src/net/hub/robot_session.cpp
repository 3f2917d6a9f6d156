// SPDX-License-Identifier: BSD-3-Clause
#include "hub/robot_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <system_error>
#include <utility>

#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr auto kSilent = 3s;
constexpr std::uint32_t kMaxChunks = 1U << 20U;

}  // namespace

void Presence::note() {
  if (received_at_) longest_break_s_ = std::max(longest_break_s_, silent_s());
  received_at_ = Clock::now();
}

double Presence::silent_s() const {
  return received_at_ ? std::chrono::duration<double>(Clock::now() - *received_at_).count() : 0.0;
}

bool Presence::silent() const { return !received_at_ || Clock::now() - *received_at_ > kSilent; }

/// The hub's copy of one robot's store.
core::Result<RobotSession> RobotSession::open(RobotStatus known, const std::filesystem::path& file,
                                              std::uint64_t quota_bytes) {
  if (auto made = core::make_folder(file.parent_path()); !made) return tl::unexpected(made.error());
  auto copy = maps::StoreReplica::open(file);
  if (!copy) return tl::unexpected(copy.error());
  RobotSession session;
  session.robot = std::move(known);
  session.file_ = file;
  session.quota_bytes_ = quota_bytes;
  session.copy_.emplace(std::move(*copy));
  return session;
}

/// The head below which transactions are certain. Those above may be of a process that ended in a power cut:
/// the robot has given their numbers to others.
std::int64_t RobotSession::certain_head(const RobotStatus& next) const {
  if (next.incarnation <= robot.incarnation) return std::numeric_limits<std::int64_t>::max();
  const std::uint64_t since = next.incarnation - robot.incarnation;
  const std::vector<std::uint64_t>& heads = next.heads_at_start;
  if (since > heads.size()) return 0;
  return static_cast<std::int64_t>(
      *std::min_element(heads.end() - static_cast<std::ptrdiff_t>(since), heads.end()));
}

/// The robot's newest status; true if the copy had to be cleared.
core::Result<bool> RobotSession::apply(const RobotStatus& next) {
  presence.note();
  const maps::StoreHeads& heads = copy_->heads();
  const bool has_heads = next.map_head > 0 || next.clouds_head > 0;  // not while it opens its store
  const bool lost = heads.last() > certain_head(next) ||
                    (has_heads && (heads.map > next.map_head || heads.clouds > next.clouds_head));
  if (next.incarnation > robot.incarnation) end_transaction();
  robot = next;
  if (!lost) return false;

  end_transaction();
  if (auto cleared = copy_->clear(); !cleared) return tl::unexpected(cleared.error());
  done = false;
  return true;
}

bool RobotSession::has_all() const {
  return robot.finished && copy_->heads().map == robot.map_head &&
         copy_->heads().clouds == robot.clouds_head && robot.map_head > 0;
}

void RobotSession::end_transaction() {
  copy_->roll_back();
  incoming_ = {};
  changed = true;
}

/// A new transaction; the robot's share of the disk is limited.
core::Result<void> RobotSession::begin(const Chunk& chunk) {
  std::error_code ignored;
  const std::uintmax_t size = std::filesystem::file_size(file_, ignored);
  if (size != static_cast<std::uintmax_t>(-1) && size > quota_bytes_) {
    return core::output_error(
        fmt::format("{}: its map takes {} MB at the hub, more than the {} MB it may have; start the hub with "
                    "a larger --quota",
                    robot.name, size / 1000000, quota_bytes_ / 1000000));
  }

  end_transaction();
  const auto stream = static_cast<maps::StoreStream>(chunk.stream);
  if (auto begun = copy_->begin(stream, chunk.number); !begun) return begun;
  incoming_.number = chunk.number;
  incoming_.checksum = chunk.checksum;
  return {};
}

core::Result<void> RobotSession::receive(const Chunk& chunk) {
  // Numbers that no robot sends
  traffic_.received_bytes += chunk.bytes.size();
  if (chunk.stream > 1) return core::input_error("an unknown stream");
  if (chunk.count == 0 || chunk.count > kMaxChunks || chunk.index >= chunk.count || chunk.number <= 0) {
    return core::input_error("impossible numbers");
  }

  // Received before: acknowledged once more.
  const std::int64_t head = copy_->heads()[static_cast<maps::StoreStream>(chunk.stream)];
  const bool same = chunk.number == incoming_.number && chunk.checksum == incoming_.checksum;
  if (chunk.number <= head || (same && chunk.index < incoming_.chunks)) {
    traffic_.again_bytes += chunk.bytes.size();
    changed = true;
    return {};
  }

  // A chunk before this one was lost; the status reports which.
  if (chunk.after != head) return {};
  if (!same) {
    if (chunk.index != 0) return {};
    if (auto begun = begin(chunk); !begun) return begun;
  }
  if (chunk.index != incoming_.chunks) return {};

  // The last chunk commits the transaction
  const bool last = chunk.index + 1 == chunk.count;
  const core::Result<void> appended = append(chunk, last);
  if (!appended || last) end_transaction();
  changed = true;
  return appended;
}

/// A chunk with the right hash; the last one commits the transaction.
core::Result<void> RobotSession::append(const Chunk& chunk, bool last) {
  core::Hash hash;
  hash.bytes(chunk.bytes.data(), chunk.bytes.size());
  incoming_.hash.bytes(chunk.bytes.data(), chunk.bytes.size());
  if (hash.value() != chunk.hash || (last && incoming_.hash.value() != incoming_.checksum)) {
    return core::input_error("bytes were changed in transit");
  }
  if (auto appended = copy_->append(chunk.bytes.data(), chunk.bytes.size()); !appended) return appended;
  ++incoming_.chunks;
  return last ? copy_->commit() : core::Result<void>();
}

HubStatus RobotSession::status() const {
  HubStatus status;
  status.robot = robot.name;
  status.run = robot.run;
  status.incarnation = robot.incarnation;
  status.answer = reply.answer;
  // Chunks that could not be stored are requested again.
  if (status.answer == Answer::kTrouble && Clock::now() >= reply.until) status.answer = Answer::kAccepted;
  status.problem = reply.problem;

  status.map_held = copy_->heads().map;
  status.clouds_held = copy_->heads().clouds;
  status.incoming = incoming_.number;
  status.checksum = incoming_.checksum;
  status.chunks = incoming_.chunks;
  return status;
}

/// The robot's numbers for the summary.
RobotTraffic RobotSession::traffic() const {
  RobotTraffic t = traffic_;
  t.name = robot.name;
  t.keyframes = copy_->keyframes();
  t.complete = copy_->complete();
  t.done = done;
  t.place_bytes = copy_->bytes().place;
  t.map_bytes = copy_->bytes().map;
  t.cloud_bytes = copy_->bytes().cloud;
  t.longest_break_s =
      done ? presence.longest_break_s() : std::max(presence.longest_break_s(), presence.silent_s());
  t.lag_median_s = robot.lag_median_s;
  t.lag_p95_s = robot.lag_p95_s;
  return t;
}

}  // namespace plumbline::net
