// SPDX-License-Identifier: BSD-3-Clause
#include "robot/robot_link.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iterator>
#include <map>
#include <sstream>
#include <system_error>
#include <utility>

#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr auto kPublishRobotEvery = 500ms;
constexpr auto kPollEvery = 50ms;
constexpr auto kPause = 10ms;  // between rounds, so that the tracker keeps its processor time
constexpr std::size_t kMaxIncarnations = 64;

std::vector<std::uint64_t> parse_numbers(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<std::uint64_t>(words), std::istream_iterator<std::uint64_t>()};
}

/// Identity and versions, before a store is known.
RobotStatus initial_status(std::string name, std::string run) {
  RobotStatus status;
  status.name = std::move(name);
  status.run = std::move(run);
  status.program = core::version();
  status.store_format = maps::kStoreFormat;
  return status;
}

}  // namespace

/// Its thread runs from the start.
RobotLink::RobotLink(std::unique_ptr<RobotBus> bus, std::string name, std::string fresh,
                     std::shared_ptr<mapping::OtherMapsInbox> feedback, core::Log& log)
    : bus_(std::move(bus)),
      robot_(initial_status(std::move(name), std::move(fresh))),
      sender_(*bus_),
      hub_(log),
      others_(feedback == nullptr ? std::nullopt
                                  : std::optional<OtherRobots>(std::in_place, robot_.name, feedback)),
      thread_([this](const core::StopToken& stop) { run(stop); }) {}

core::Result<void> RobotLink::follow(const fs::path& store) {
  // The run's identity is stored with the map
  const maps::Ledger ledger(store.parent_path() / "network.db");
  auto known = ledger.all();
  if (!known) return tl::unexpected(known.error());
  std::error_code ignored;
  const auto heads = fs::exists(store, ignored) ? maps::store_heads(store) : maps::StoreHeads();

  // The next incarnation: of the run in the ledger, or of this run, started with an empty store.
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_new = following() && known->empty();
  RobotStatus next = robot_;
  std::map<std::string, std::string>& texts = *known;
  if (!texts["run"].empty()) next.run = texts["run"];
  if (!is_new) next.heads_at_start = parse_numbers(texts["began"]);
  next.heads_at_start.push_back(heads ? static_cast<std::uint64_t>(heads->last()) : 0);

  // Every process of a run counts as an incarnation
  const std::vector<std::uint64_t> incarnation = parse_numbers(texts["incarnation"]);
  if (!is_new) next.incarnation = incarnation.empty() ? 0 : incarnation.front();
  ++next.incarnation;
  if (next.heads_at_start.size() > kMaxIncarnations) next.heads_at_start.erase(next.heads_at_start.begin());

  // The ledger is written before anything is sent
  const auto put = ledger.put({{"run", next.run},
                               {"name", next.name},
                               {"began", fmt::format("{}", fmt::join(next.heads_at_start, " "))},
                               {"incarnation", std::to_string(next.incarnation)}});
  if (!put) return put;

  // Link and sender begin again with the new store
  next.map_head = next.clouds_head = 0;
  robot_ = std::move(next);
  store_.follow(store);
  hub_.reset();
  sender_.reset();
  return {};
}

void RobotLink::finish(const fs::path& store) {
  const std::lock_guard<std::mutex> lock(mutex_);
  store_.moved(store);
  robot_.finished = true;
}

/// The link's thread; waiting is bounded so that the store is polled.
void RobotLink::run(const core::StopToken& stop) {
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(kPause);
    bus_->wait(kPollEvery);
    const std::vector<HubStatus> statuses = bus_->poll_hub();
    exchange(statuses);
    if (others_) receive_feedback(statuses);
  }
}

/// One exchange with the hub: statuses, chunks and presence.
void RobotLink::exchange(const std::vector<HubStatus>& statuses) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const HubStatus& status : statuses) {
    if (hub_.apply(status, robot_)) sender_.reset();
  }
  if (following()) {
    poll_store();
    if (hub_.accepts()) sender_.send(robot_, store_, hub_.hub(), hub_.received_at());
    if (Clock::now() - published_at_ >= kPublishRobotEvery) publish_robot();
  }
  hub_.report_silence(*bus_);
  publish_link();
}

void RobotLink::receive_feedback(const std::vector<HubStatus>& statuses) {
  for (const HubStatus& status : statuses) others_->apply(status);
  for (const Chunk& chunk : bus_->poll_feedback()) others_->receive(chunk);
  others_->publish();
}

/// New transactions are announced at once.
void RobotLink::poll_store() {
  const StoreWatch::Change change = store_.poll();
  if (change == StoreWatch::Change::kNone) return;
  if (change == StoreWatch::Change::kRestarted) sender_.reset();
  robot_.map_head = store_.heads().map;
  robot_.clouds_head = store_.heads().clouds;
  published_at_ = {};
}

void RobotLink::publish_robot() {
  robot_.lag_median_s = store_.lag_s(0.5);
  robot_.lag_p95_s = store_.lag_s(0.95);
  bus_->publish(robot_);
  published_at_ = Clock::now();
}

void RobotLink::publish_link() {
  auto status = std::make_shared<LinkStatus>(hub_.status());
  status->behind = store_.behind({hub_.hub().map_held, hub_.hub().clouds_held});
  status->sent_bytes = sender_.sent_bytes();
  status->resent_bytes = sender_.resent_bytes();
  std::atomic_store(&status_, std::shared_ptr<const LinkStatus>(std::move(status)));
}

}  // namespace plumbline::net
