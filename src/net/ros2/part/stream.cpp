// SPDX-License-Identifier: BSD-3-Clause
#include "stream.hpp"

#include <dds/ddsi/ddsi_serdata.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "participant.hpp"

namespace plumbline::net {
namespace {

/// A topic with at least one publisher.
struct Publication {
  std::string type;  ///< name of the type in DDS
  bool reliable = true;
  bool latched = true;
};

class Ros2Stream final : public dataset::MessageStream {
 public:
  ~Ros2Stream() override {
    for (auto& [name, reader] : readers_) dds_delete(reader.handle);
  }

  core::Result<void> open(const NetworkOptions& options) {
    if (auto opened = participant_.open(options, Ros2Role::kListener); !opened) return opened;

    // A built-in topic of DDS lists the publishers
    publications_ =
        dds_create_reader(participant_.handle(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
    waitset_ = dds_create_waitset(participant_.handle());
    if (publications_ > 0 && waitset_ > 0) return {};
    return core::usage_error(fmt::format("ros2://{}: cannot receive from the network ({})", options.domain,
                                         dds_strretcode(std::min(publications_, waitset_))));
  }

  /// All topics, including those of types that are not known.
  std::vector<dataset::StreamTopic> topics() override {
    look_around();
    std::vector<dataset::StreamTopic> topics;
    for (const auto& [name, publication] : seen_) {
      const bool known = known_type_of_dds(publication.type) != nullptr;
      topics.push_back({name, ros_type(publication.type), known});
    }
    return topics;
  }

  core::Result<void> subscribe(const std::string& topic) override {
    if (readers_.count(topic) != 0) return {};

    // The publisher may be new
    look_around();
    const auto found = seen_.find(topic);
    if (found == seen_.end()) return core::input_error(topic + ": nobody publishes it");

    const KnownType* type = known_type_of_dds(found->second.type);
    if (type == nullptr)
      return core::input_error(fmt::format("{}: is of {}, which is not read", topic, found->second.type));

    // The reader requests no more than publishers offer
    Reader reader;
    const dds_entity_t dds_topic = participant_.topic(topic, *type);
    reader.handle =
        dds_create_reader(participant_.handle(), dds_topic, reader_qos(found->second).get(), nullptr);
    if (reader.handle < 0) {
      return core::input_error(
          fmt::format("{}: cannot be subscribed to ({})", topic, dds_strretcode(reader.handle)));
    }

    // The wait for messages includes this topic
    reader.condition = dds_create_readcondition(reader.handle, DDS_ANY_STATE);
    dds_waitset_attach(waitset_, reader.condition, reader.handle);
    readers_.emplace(topic, reader);
    return {};
  }

  void unsubscribe(const std::string& topic) override {
    const auto found = readers_.find(topic);
    if (found == readers_.end()) return;

    // Counts of lost messages outlive the reader
    lost_before_ += lost_by(found->second);
    dds_waitset_detach(waitset_, found->second.condition);
    dds_delete(found->second.handle);
    readers_.erase(found);
  }

  std::optional<dataset::StreamMessage> next(std::chrono::milliseconds most) override {
    if (auto message = take()) return message;
    dds_attach_t first = 0;
    dds_waitset_wait(waitset_, &first, 1, DDS_MSECS(most.count()));
    return take();
  }

  [[nodiscard]] std::size_t lost() const override {
    std::size_t lost = lost_before_;
    for (const auto& [name, reader] : readers_) lost += lost_by(reader);
    return lost;
  }

 private:
  struct Reader {
    dds_entity_t handle = 0;
    dds_entity_t condition = 0;
  };

  /// A reader that asks for more than a publisher offers gets nothing.
  static Qos reader_qos(const Publication& offered) {
    Qos qos = new_qos();
    pin_representation(qos);
    // Pieces that a full buffer loses are sent again only to a reliable reader.
    dds_qset_reliability(qos.get(), offered.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                         DDS_MSECS(100));
    // Messages from before, as on /tf_static.
    dds_qset_durability(qos.get(),
                        offered.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kSamplesKeptByReader);
    return qos;
  }

  static std::size_t lost_by(const Reader& reader) {
    dds_sample_lost_status_t status{};
    return dds_get_sample_lost_status(reader.handle, &status) == DDS_RETCODE_OK ? status.total_count : 0;
  }

  /// Adds the publications that were found since the last call.
  void look_around() {
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(publications_, &sample, &info, 1, 1) > 0) {
      const auto& endpoint = *static_cast<const dds_builtintopic_endpoint_t*>(sample);

      // Publishers that left have no valid data
      const std::string name = info.valid_data ? ros_topic(endpoint.topic_name) : "";

      if (!name.empty()) {
        dds_reliability_kind_t reliability = DDS_RELIABILITY_BEST_EFFORT;
        dds_duration_t blocking = 0;
        dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
        dds_qget_reliability(endpoint.qos, &reliability, &blocking);
        dds_qget_durability(endpoint.qos, &durability);

        // The weakest offer of all publishers counts
        Publication& publication = seen_[name];
        publication.type = endpoint.type_name;
        publication.reliable = publication.reliable && reliability == DDS_RELIABILITY_RELIABLE;
        publication.latched = publication.latched && durability >= DDS_DURABILITY_TRANSIENT_LOCAL;
      }
      dds_return_loan(publications_, &sample, 1);
    }
  }

  /// Readers take turns, so that a busy one hides none.
  std::optional<dataset::StreamMessage> take() {
    if (readers_.empty()) return std::nullopt;
    auto reader = readers_.upper_bound(last_);
    for (std::size_t i = 0; i < readers_.size(); ++i, ++reader) {
      if (reader == readers_.end()) reader = readers_.begin();
      auto message = take_from(reader->first, reader->second);
      if (!message) continue;
      last_ = reader->first;
      return message;
    }
    return std::nullopt;
  }

  static std::optional<dataset::StreamMessage> take_from(const std::string& name, const Reader& reader) {
    ddsi_serdata* data = nullptr;
    dds_sample_info_t info;
    while (dds_takecdr(reader.handle, &data, 1, &info, DDS_ANY_STATE) > 0) {
      std::optional<dataset::StreamMessage> message;

      // Samples without data report changes of state
      if (info.valid_data) {
        message.emplace();
        message->topic = name;
        message->received_ns = dds_time();
        message->bytes.resize(ddsi_serdata_size(data));
        ddsi_serdata_to_ser(data, 0, message->bytes.size(), message->bytes.data());
      }
      ddsi_serdata_unref(data);
      if (message) return message;
    }
    return std::nullopt;
  }

  Ros2Participant participant_;
  dds_entity_t publications_ = 0;
  dds_entity_t waitset_ = 0;
  std::map<std::string, Publication> seen_;
  std::map<std::string, Reader> readers_;
  std::string last_;  ///< topic of the last message
  std::size_t lost_before_ = 0;
};

}  // namespace

core::Result<std::unique_ptr<dataset::MessageStream>> open_stream(const NetworkOptions& options) {
  auto stream = std::make_unique<Ros2Stream>();
  if (auto opened = stream->open(options); !opened) return tl::unexpected(opened.error());
  return stream;
}

}  // namespace plumbline::net
