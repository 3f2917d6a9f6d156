// SPDX-License-Identifier: BSD-3-Clause
// The part plumbline_dds.so: CycloneDDS behind RobotBus and HubBus.
#include "bus.hpp"

#include <dds/dds.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include "keys.hpp"
#include "qos.hpp"
#include "wire.hpp"

namespace plumbline::net {
namespace {

constexpr const char* kHubs = "_hub";  ///< a partition that is no robot's: hubs hear each other there
constexpr const char* kEverybody = "*";

struct Topic {
  const dds_topic_descriptor_t& type;
  const char* name;
};
const Topic kHello{plumbline_wire_Hello_desc, "plumbline_hello"};
const Topic kWord{plumbline_wire_Word_desc, "plumbline_word"};
const Topic kPiece{plumbline_wire_Piece_desc, "plumbline_piece"};
const Topic kFeedback{plumbline_wire_Piece_desc, "plumbline_feedback"};

/// A robot is spoken to in its own partition; an entity goes with what was made in it.
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

/// What CycloneDDS complained of first, from whichever thread.
class Complaint {
 public:
  void note(const std::string& line) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const bool of_another_one = line.rfind("Remote ", 0) == 0;
    if (text_.empty() && !of_another_one) text_ = line;
  }
  std::string text() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return text_;
  }

 private:
  std::mutex mutex_;
  std::string text_;
};

/// A participant in a domain of its own configuration.
class Participant {
 public:
  explicit Participant(const BusLog& log)
      : complaint_(std::make_shared<Complaint>()), log_([log, first = complaint_](const std::string& line) {
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
    domain_ = Entity();
    // Its log must not outlive it; by default CycloneDDS would write to stderr.
    dds_set_log_sink(&report, nullptr);
    dds_set_trace_sink(&report, nullptr);
  }

  core::Result<void> open(const NetworkOptions& options, bool hub) {
    const auto id = static_cast<dds_domainid_t>(options.domain);
    domain_ = Entity(dds_create_domain(id, domain_configuration(options, hub).c_str()));
    const auto qos = participant_qos(options);
    if (!qos) return tl::unexpected(qos.error());
    if (domain_.handle > 0) participant_ = Entity(dds_create_participant(id, qos->get(), nullptr));
    if (participant_.handle > 0) {
      waitset_ = dds_create_waitset(participant_.handle);
      others_ = dds_create_reader(participant_.handle, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr);
      return {};
    }
    const std::string complaint = complaint_->text();
    if (!options.security.empty() && !complaint.empty()) {
      return core::usage_error(
          fmt::format("--security: the keys in {} cannot be used: {}", options.security.string(), complaint));
    }
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
  /// wait() ends when it has something.
  void watch(dds_entity_t reader) const {
    dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS | DDS_SUBSCRIPTION_MATCHED_STATUS);
    dds_waitset_attach(waitset_, dds_create_readcondition(reader, DDS_ANY_STATE), reader);
  }
  void wait(std::chrono::milliseconds most) const {
    dds_attach_t first = 0;
    dds_waitset_wait(waitset_, &first, 1, DDS_MSECS(most.count()));
  }
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
  std::shared_ptr<Complaint> complaint_;
  BusLog log_;
  Entity domain_;
  Entity participant_;
  dds_entity_t waitset_ = 0;
  dds_entity_t others_ = 0;
};

/// Calls use(sample, info) for at most `most` samples that are there.
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

constexpr int kMostWords = 256;
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
  core::Result<void> open(const NetworkOptions& options, const std::string& name) {
    if (auto opened = participant_.open(options, false); !opened) return opened;
    publisher_ = participant_.publisher({name});
    subscriber_ = participant_.subscriber({name});
    hellos_ = writer_in(publisher_, participant_.topic(kHello), word_qos());
    pieces_ = writer_in(publisher_, participant_.topic(kPiece), piece_qos());
    words_ = reader_in(subscriber_, participant_.topic(kWord), word_qos());
    if (hellos_ < 0 || pieces_ < 0 || words_ < 0) {
      return core::usage_error(fmt::format(
          "the network lets nobody speak as {} here ({}); with --security, give the keys made for this name",
          name, dds_strretcode(std::min(std::min(hellos_, pieces_), words_))));
    }
    participant_.watch(words_);
    return {};
  }

  void say(const Hello& hello) override { write_message<plumbline_wire_Hello>(hellos_, hello); }
  bool send(const Piece& piece) override {
    return write_message<plumbline_wire_Piece>(pieces_, piece) == DDS_RETCODE_OK;
  }
  std::vector<Word> hear() override { return take_all<plumbline_wire_Word>(words_, kMostWords); }
  std::vector<Piece> hear_of_others() override {
    if (others_pieces_ == 0)
      others_pieces_ = reader_in(subscriber_, participant_.topic(kFeedback), piece_qos());
    return take_all<plumbline_wire_Piece>(others_pieces_, kFeedbackAtATime);
  }
  bool listened_to() override {
    dds_publication_matched_status_t status;
    return dds_get_publication_matched_status(pieces_, &status) == DDS_RETCODE_OK && status.current_count > 0;
  }
  bool all_received() override { return dds_wait_for_acks(pieces_, 0) == DDS_RETCODE_OK; }
  int others() override { return participant_.others(); }
  void wait(std::chrono::milliseconds most) override { participant_.wait(most); }

 private:
  Participant participant_;
  Entity publisher_;
  Entity subscriber_;
  dds_entity_t hellos_ = 0;
  dds_entity_t pieces_ = 0;
  dds_entity_t words_ = 0;
  dds_entity_t others_pieces_ = 0;  ///< 0: not asked for
};

class CycloneHub : public HubBus {
 public:
  explicit CycloneHub(const BusLog& log) : participant_(log) {}
  core::Result<void> open(const NetworkOptions& options) {
    if (auto opened = participant_.open(options, true); !opened) return opened;
    publisher_ = participant_.publisher({kEverybody, kHubs});
    subscriber_ = participant_.subscriber({kEverybody});
    hub_subscriber_ = participant_.subscriber({kHubs});
    const dds_entity_t words = participant_.topic(kWord);
    words_ = writer_in(publisher_, words, word_qos());
    hubs_ = reader_in(hub_subscriber_, words, word_qos());
    hellos_ = reader_in(subscriber_, participant_.topic(kHello), word_qos());
    piece_topic_ = participant_.topic(kPiece);
    if (words_ < 0 || hubs_ < 0 || hellos_ < 0 || piece_topic_ < 0) {
      return core::usage_error("the network lets nobody be a hub here; with --security, give the hub's keys");
    }
    participant_.watch(hellos_);
    return {};
  }

  void say(const Word& word) override { write_message<plumbline_wire_Word>(words_, word); }
  std::vector<HeardHello> hear() override {
    std::vector<HeardHello> hellos;
    take_some<plumbline_wire_Hello>(
        hellos_, kMostWords, [&](const plumbline_wire_Hello& hello, const dds_sample_info_t& info) {
          hellos.push_back({from_wire(hello), partition_of(info.publication_handle)});
        });
    return hellos;
  }
  std::vector<Word> hear_hubs() override { return take_all<plumbline_wire_Word>(hubs_, kMostWords); }
  core::Result<void> listen_to(const std::string& robot) override {
    if (robots_.count(robot) != 0) return {};
    Robot listener;
    listener.subscriber = participant_.subscriber({robot});
    listener.pieces = reader_in(listener.subscriber, piece_topic_, piece_qos());
    listener.publisher = participant_.publisher({robot});
    listener.feedback = writer_in(listener.publisher, participant_.topic(kFeedback), piece_qos(0));
    if (listener.pieces < 0) {
      return core::usage_error(
          fmt::format("{}: cannot be listened to ({})", robot, dds_strretcode(listener.pieces)));
    }
    participant_.watch(listener.pieces);
    robots_.emplace(robot, std::move(listener));
    return {};
  }
  std::vector<Piece> take(const std::string& robot, int most) override {
    const auto found = robots_.find(robot);
    return found == robots_.end() ? std::vector<Piece>()
                                  : take_all<plumbline_wire_Piece>(found->second.pieces, most);
  }
  int begun_to_hear(const std::string& robot) override {
    const auto found = robots_.find(robot);
    dds_publication_matched_status_t status;
    const bool heard =
        found != robots_.end() &&
        dds_get_publication_matched_status(found->second.feedback, &status) == DDS_RETCODE_OK &&
        status.current_count > 0;
    return heard ? static_cast<int>(status.total_count) : 0;
  }
  bool tell(const std::string& robot, const Piece& piece) override {
    const auto found = robots_.find(robot);
    return found != robots_.end() &&
           write_message<plumbline_wire_Piece>(found->second.feedback, piece) == DDS_RETCODE_OK;
  }
  void wait(std::chrono::milliseconds most) override { participant_.wait(most); }

 private:
  struct Robot {
    Entity subscriber;
    dds_entity_t pieces = 0;
    Entity publisher;
    dds_entity_t feedback = 0;  ///< what it is told of others; negative: keys do not permit it
  };
  /// Empty: not known, or several.
  std::string partition_of(dds_instance_handle_t writer) const {
    dds_builtintopic_endpoint_t* endpoint = dds_get_matched_publication_data(hellos_, writer);
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
  dds_entity_t words_ = 0;
  dds_entity_t hubs_ = 0;
  dds_entity_t hellos_ = 0;
  dds_entity_t piece_topic_ = 0;
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
