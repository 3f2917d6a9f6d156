// SPDX-License-Identifier: BSD-3-Clause
// The part plumbline_dds.so: CycloneDDS behind RobotBus and HubBus.
#include "bus.hpp"

#include <dds/dds.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "keys.hpp"
#include "qos.hpp"
#include "wire.hpp"

namespace plumbline::net {
namespace {

constexpr const char* kHubs = "_hub";  ///< partition for messages between hubs; no robot may have this name
constexpr const char* kEverybody = "*";
constexpr std::chrono::milliseconds kLinger{1000};

struct Topic {
  const dds_topic_descriptor_t& type;
  const char* name;
};
const Topic kRobotStatus{plumbline_wire_RobotStatus_desc, "plumbline_robot_status"};
const Topic kHubStatus{plumbline_wire_HubStatus_desc, "plumbline_hub_status"};
const Topic kChunk{plumbline_wire_Chunk_desc, "plumbline_chunk"};
const Topic kFeedback{plumbline_wire_Chunk_desc, "plumbline_feedback"};

/// Owner of a DDS entity, and with it of all entities made in it.
struct Entity {
  dds_entity_t handle = 0;
  Entity() = default;
  explicit Entity(dds_entity_t h) : handle(h) {}
  Entity(Entity&& other) noexcept : handle(std::exchange(other.handle, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle, other.handle);
    return *this;
  }
  ~Entity() {
    if (handle > 0) dds_delete(handle);
  }
};

void report(void* log, const dds_log_data_t* data) {
  std::string line(data->message, strnlen(data->message, data->size));
  while (!line.empty() && line.back() == '\n') line.pop_back();
  if (log != nullptr && *static_cast<BusLog*>(log)) (*static_cast<BusLog*>(log))(line);
}

/// The first error that CycloneDDS logged, from whichever thread.
class FirstError {
 public:
  void note(const std::string& line) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const bool of_remote = line.rfind("Remote ", 0) == 0;
    if (text_.empty() && !of_remote) text_ = line;
  }
  std::string text() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return text_;
  }

 private:
  std::mutex mutex_;
  std::string text_;
};

/// A participant in a domain with its own configuration.
class Participant {
 public:
  explicit Participant(const BusLog& log)
      : first_error_(std::make_shared<FirstError>()),
        log_([log, first = first_error_](const std::string& line) {
          first->note(line);
          if (log) log(line);
        }) {
    dds_set_log_sink(&report, &log_);
    dds_set_trace_sink(&report, &log_);
  }
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  ~Participant() {
    participant_ = Entity();
    // CycloneDDS 0.10 may abort the process at the other end of a TCP connection that is closed while it
    // still writes there: what it answers to the farewell must arrive before the connection is closed.
    if (lingers_) std::this_thread::sleep_for(kLinger);
    domain_ = Entity();
    // Its log must not outlive it; by default CycloneDDS would write to stderr.
    dds_set_log_sink(&report, nullptr);
    dds_set_trace_sink(&report, nullptr);
  }

  core::Result<void> open(const NetworkOptions& options, bool hub) {
    // Domain and participant, secured if keys are given
    lingers_ = options.transport == Transport::kTcp;
    const auto id = static_cast<dds_domainid_t>(options.domain);
    domain_ = Entity(dds_create_domain(id, domain_configuration(options, hub).c_str()));
    const auto qos = participant_qos(options);
    if (!qos) return tl::unexpected(qos.error());
    if (domain_.handle > 0) participant_ = Entity(dds_create_participant(id, qos->get(), nullptr));

    // Other participants are counted, of any kind
    if (participant_.handle > 0) {
      waitset_ = dds_create_waitset(participant_.handle);
      others_ = dds_create_reader(participant_.handle, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr);
      return {};
    }

    // Wrong keys are the likeliest failure
    const std::string error = first_error_->text();
    if (!options.security.empty() && !error.empty()) {
      return core::usage_error(
          fmt::format("--security: the keys in {} cannot be used: {}", options.security.string(), error));
    }

    // Another program may hold the port
    const dds_return_t code = domain_.handle <= 0 ? domain_.handle : participant_.handle;
    return core::usage_error(
        fmt::format("the network cannot be used on interface {}, domain {} ({}); another program may have "
                    "the port: choose other values with --interface, --port or --domain",
                    options.interface, options.domain, dds_strretcode(code)));
  }
  [[nodiscard]] dds_entity_t handle() const { return participant_.handle; }

  Entity publisher(const std::vector<std::string>& partitions) const {
    return Entity(dds_create_publisher(handle(), partition_qos(partitions).get(), nullptr));
  }
  Entity subscriber(const std::vector<std::string>& partitions) const {
    return Entity(dds_create_subscriber(handle(), partition_qos(partitions).get(), nullptr));
  }
  [[nodiscard]] dds_entity_t topic(const Topic& topic) const {
    return dds_create_topic(handle(), &topic.type, topic.name, nullptr, nullptr);
  }
  /// From now on wait() returns when this reader has data.
  void watch(dds_entity_t reader) const {
    dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS | DDS_SUBSCRIPTION_MATCHED_STATUS);
    dds_waitset_attach(waitset_, dds_create_readcondition(reader, DDS_ANY_STATE), reader);
  }
  void wait(std::chrono::milliseconds most) const {
    dds_attach_t first = 0;
    dds_waitset_wait(waitset_, &first, 1, DDS_MSECS(most.count()));
  }
  /// Participants that are alive, without this one.
  [[nodiscard]] int others() const {
    constexpr std::size_t kMost = 256;
    std::vector<void*> samples(kMost, nullptr);
    std::vector<dds_sample_info_t> infos(kMost);
    const dds_return_t count =
        dds_read_mask(others_, samples.data(), infos.data(), kMost, kMost,
                      DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ALIVE_INSTANCE_STATE);
    if (count > 0) dds_return_loan(others_, samples.data(), count);
    return std::max(0, static_cast<int>(count) - 1);
  }

 private:
  std::shared_ptr<FirstError> first_error_;
  BusLog log_;
  Entity domain_;
  Entity participant_;
  dds_entity_t waitset_ = 0;
  dds_entity_t others_ = 0;
  bool lingers_ = false;
};

/// Calls use(sample, info) for at most `most` available samples.
template <typename Sample, typename Use>
void take_some(dds_entity_t reader, int most, const Use& use) {
  for (int i = 0; i < most; ++i) {
    void* sample = nullptr;
    dds_sample_info_t info;
    const dds_return_t count = dds_take(reader, &sample, &info, 1, 1);
    if (count <= 0) return;
    if (info.valid_data) use(*static_cast<const Sample*>(sample), info);
    dds_return_loan(reader, &sample, count);
  }
}

constexpr int kMaxStatuses = 256;
constexpr int kFeedbackAtATime = 4;

template <typename Wire>
auto take_all(dds_entity_t reader, int most) {
  std::vector<decltype(from_wire(std::declval<const Wire&>()))> messages;
  take_some<Wire>(reader, most,
                  [&](const Wire& message, const auto&) { messages.push_back(from_wire(message)); });
  return messages;
}

dds_entity_t writer_in(const Entity& publisher, dds_entity_t topic, const Qos& qos) {
  return dds_create_writer(publisher.handle, topic, qos.get(), nullptr);
}
dds_entity_t reader_in(const Entity& subscriber, dds_entity_t topic, const Qos& qos) {
  return dds_create_reader(subscriber.handle, topic, qos.get(), nullptr);
}

template <typename Wire, typename Message>
dds_return_t write_message(dds_entity_t writer, const Message& message) {
  Wire wire;
  to_wire(message, wire);
  return dds_write(writer, &wire);
}

class CycloneRobot : public RobotBus {
 public:
  explicit CycloneRobot(const BusLog& log) : participant_(log) {}
  /// A robot publishes and subscribes in its own partition only.
  core::Result<void> open(const NetworkOptions& options, const std::string& name) {
    if (auto opened = participant_.open(options, false); !opened) return opened;
    publisher_ = participant_.publisher({name});
    subscriber_ = participant_.subscriber({name});
    statuses_ = writer_in(publisher_, participant_.topic(kRobotStatus), status_qos());
    chunks_ = writer_in(publisher_, participant_.topic(kChunk), chunk_qos());
    hub_reader_ = reader_in(subscriber_, participant_.topic(kHubStatus), status_qos());
    if (statuses_ < 0 || chunks_ < 0 || hub_reader_ < 0) {
      return core::usage_error(fmt::format(
          "publishing as {} is not permitted here ({}); with --security, give the keys made for this name",
          name, dds_strretcode(std::min({statuses_, chunks_, hub_reader_}))));
    }
    participant_.watch(hub_reader_);
    return {};
  }

  void publish(const RobotStatus& status) override {
    write_message<plumbline_wire_RobotStatus>(statuses_, status);
  }
  bool send(const Chunk& chunk) override {
    return write_message<plumbline_wire_Chunk>(chunks_, chunk) == DDS_RETCODE_OK;
  }
  std::vector<HubStatus> poll_hub() override {
    return take_all<plumbline_wire_HubStatus>(hub_reader_, kMaxStatuses);
  }
  std::vector<Chunk> poll_feedback() override {
    if (feedback_reader_ == 0)
      feedback_reader_ = reader_in(subscriber_, participant_.topic(kFeedback), chunk_qos());
    return take_all<plumbline_wire_Chunk>(feedback_reader_, kFeedbackAtATime);
  }
  bool has_reader() override {
    dds_publication_matched_status_t status;
    return dds_get_publication_matched_status(chunks_, &status) == DDS_RETCODE_OK && status.current_count > 0;
  }
  bool all_received() override { return dds_wait_for_acks(chunks_, 0) == DDS_RETCODE_OK; }
  int participants() override { return participant_.others(); }
  void wait(std::chrono::milliseconds most) override { participant_.wait(most); }

 private:
  Participant participant_;
  Entity publisher_;
  Entity subscriber_;
  dds_entity_t statuses_ = 0;
  dds_entity_t chunks_ = 0;
  dds_entity_t hub_reader_ = 0;
  dds_entity_t feedback_reader_ = 0;  ///< 0: feedback was not requested
};

class CycloneHub : public HubBus {
 public:
  explicit CycloneHub(const BusLog& log) : participant_(log) {}
  /// The hub receives from all robots, and from other hubs.
  core::Result<void> open(const NetworkOptions& options) {
    if (auto opened = participant_.open(options, true); !opened) return opened;
    publisher_ = participant_.publisher({kEverybody, kHubs});
    subscriber_ = participant_.subscriber({kEverybody});
    hub_subscriber_ = participant_.subscriber({kHubs});
    const dds_entity_t statuses = participant_.topic(kHubStatus);
    statuses_ = writer_in(publisher_, statuses, status_qos());
    hub_reader_ = reader_in(hub_subscriber_, statuses, status_qos());
    robot_reader_ = reader_in(subscriber_, participant_.topic(kRobotStatus), status_qos());
    chunk_topic_ = participant_.topic(kChunk);
    if (statuses_ < 0 || hub_reader_ < 0 || robot_reader_ < 0 || chunk_topic_ < 0) {
      return core::usage_error("a hub is not permitted here; with --security, give the hub's keys");
    }
    participant_.watch(robot_reader_);
    return {};
  }

  void publish(const HubStatus& status) override {
    write_message<plumbline_wire_HubStatus>(statuses_, status);
  }
  /// Statuses with the partition in which they were sent.
  std::vector<ReceivedStatus> poll_robots() override {
    std::vector<ReceivedStatus> received;
    take_some<plumbline_wire_RobotStatus>(
        robot_reader_, kMaxStatuses,
        [&](const plumbline_wire_RobotStatus& status, const dds_sample_info_t& info) {
          received.push_back({from_wire(status), partition_of(info.publication_handle)});
        });
    return received;
  }
  std::vector<HubStatus> poll_hubs() override {
    return take_all<plumbline_wire_HubStatus>(hub_reader_, kMaxStatuses);
  }
  /// Chunks come from the robot's partition, feedback goes there.
  core::Result<void> subscribe(const std::string& robot) override {
    if (robots_.count(robot) != 0) return {};
    Robot entities;
    entities.subscriber = participant_.subscriber({robot});
    entities.chunks = reader_in(entities.subscriber, chunk_topic_, chunk_qos());
    entities.publisher = participant_.publisher({robot});
    entities.feedback = writer_in(entities.publisher, participant_.topic(kFeedback), chunk_qos(0));
    if (entities.chunks < 0) {
      return core::usage_error(
          fmt::format("{}: cannot be subscribed to ({})", robot, dds_strretcode(entities.chunks)));
    }
    participant_.watch(entities.chunks);
    robots_.emplace(robot, std::move(entities));
    return {};
  }
  std::vector<Chunk> receive(const std::string& robot, int most) override {
    const auto found = robots_.find(robot);
    return found == robots_.end() ? std::vector<Chunk>()
                                  : take_all<plumbline_wire_Chunk>(found->second.chunks, most);
  }
  /// Changes whenever a reader joins, so that a new one is noticed.
  int feedback_subscriptions(const std::string& robot) override {
    const auto found = robots_.find(robot);
    dds_publication_matched_status_t status;
    const bool subscribed =
        found != robots_.end() &&
        dds_get_publication_matched_status(found->second.feedback, &status) == DDS_RETCODE_OK &&
        status.current_count > 0;
    return subscribed ? static_cast<int>(status.total_count) : 0;
  }
  bool send_feedback(const std::string& robot, const Chunk& chunk) override {
    const auto found = robots_.find(robot);
    return found != robots_.end() &&
           write_message<plumbline_wire_Chunk>(found->second.feedback, chunk) == DDS_RETCODE_OK;
  }
  void wait(std::chrono::milliseconds most) override { participant_.wait(most); }

 private:
  struct Robot {
    Entity subscriber;
    dds_entity_t chunks = 0;
    Entity publisher;
    dds_entity_t feedback = 0;  ///< writer of other robots' maps; negative: keys do not permit it
  };

  /// Partition of a writer; empty: unknown, or several.
  std::string partition_of(dds_instance_handle_t writer) const {
    dds_builtintopic_endpoint_t* endpoint = dds_get_matched_publication_data(robot_reader_, writer);
    if (endpoint == nullptr) return {};
    std::string partition;
    std::uint32_t count = 0;
    char** names = nullptr;
    if (dds_qget_partition(endpoint->qos, &count, &names)) {
      if (count == 1) partition = names[0];
      for (std::uint32_t i = 0; i < count; ++i) dds_free(names[i]);
      dds_free(names);
    }
    dds_builtintopic_free_endpoint(endpoint);
    return partition;
  }

  Participant participant_;
  Entity publisher_;
  Entity subscriber_;
  Entity hub_subscriber_;
  dds_entity_t statuses_ = 0;
  dds_entity_t hub_reader_ = 0;
  dds_entity_t robot_reader_ = 0;
  dds_entity_t chunk_topic_ = 0;
  std::map<std::string, Robot> robots_;
};

core::Result<std::unique_ptr<RobotBus>> open_robot(const NetworkOptions& options, const std::string& name,
                                                   const BusLog& log) {
  auto bus = std::make_unique<CycloneRobot>(log);
  if (auto opened = bus->open(options, name); !opened) return tl::unexpected(opened.error());
  return bus;
}

core::Result<std::unique_ptr<HubBus>> open_hub(const NetworkOptions& options, const BusLog& log) {
  auto bus = std::make_unique<CycloneHub>(log);
  if (auto opened = bus->open(options); !opened) return tl::unexpected(opened.error());
  return bus;
}

}  // namespace
}  // namespace plumbline::net

PLUMBLINE_PART(plumbline::net::BusPart, &plumbline::net::open_robot, &plumbline::net::open_hub,
               &plumbline::net::make_authority, &plumbline::net::make_keys, &plumbline::net::revoke,
               &plumbline::net::days_left)
