// SPDX-License-Identifier: BSD-3-Clause
#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_xqos.h>
#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <utility>

#include "participant.hpp"
#include "plumbline/core/shortage.hpp"
#include "stream.hpp"

namespace plumbline::net {
namespace {

constexpr std::size_t kEncapsulation = 4;  // bytes in front of CDR that name its kind
constexpr std::uint32_t kVersion1 = 1;
/// A sample in C of a message's bytes, with all that belongs to it. The bytes are our own.
class Sample {
 public:
  Sample(const dds_topic_descriptor_t& type, const std::vector<std::uint8_t>& bytes)
      : type_(type), memory_(core::made(std::calloc(1, type.m_size))) {
    ddsi_sertype_default sertype{};
    sertype.type.size = type.m_size;
    sertype.type.align = type.m_align;
    sertype.type.flagset = type.m_flagset;
    sertype.type.ops.nops = dds_stream_countops(type.m_ops, type.m_nkeys, type.m_keys);
    sertype.type.ops.ops = const_cast<std::uint32_t*>(type.m_ops);

    // The stream's own alignment is that of its buffer.
    const std::size_t length = bytes.size() - kEncapsulation;
    const auto words = std::make_unique<std::uint64_t[]>(length / sizeof(std::uint64_t) + 1);
    std::memcpy(words.get(), bytes.data() + kEncapsulation, length);
    dds_istream_t stream;
    dds_istream_init(&stream, static_cast<std::uint32_t>(length), words.get(), kVersion1);
    dds_stream_read_sample(&stream, memory_, &sertype);
    dds_istream_fini(&stream);
  }
  Sample(const Sample&) = delete;
  Sample& operator=(const Sample&) = delete;
  ~Sample() {
    dds_stream_free_sample(memory_, type_.m_ops);
    std::free(memory_);
  }
  [[nodiscard]] const void* get() const { return memory_; }

 private:
  const dds_topic_descriptor_t& type_;
  void* memory_;
};

class Ros2Sink final : public dataset::MessageSink {
 public:
  core::Result<void> open(const NetworkOptions& options) {
    return participant_.open(options, Ros2Role::kSpeaker);
  }

  core::Result<void> announce(const std::string& topic, const std::string& type,
                              dataset::Retention retention) override {
    if (writers_.count(topic) != 0) return {};
    const KnownType* known = known_type(type);
    if (known == nullptr) return core::usage_error(fmt::format("{}: {} cannot be published", topic, type));

    // Late subscribers get the retained message
    Writer writer{0, known->descriptor};
    const dds_entity_t dds_topic = participant_.topic(topic, *known);
    writer.handle =
        dds_create_writer(participant_.handle(), dds_topic, writer_qos(*known, retention).get(), nullptr);
    if (writer.handle < 0) {
      return core::usage_error(
          fmt::format("{}: cannot be published ({})", topic, dds_strretcode(writer.handle)));
    }
    writers_.emplace(topic, writer);
    return {};
  }

  core::Result<void> send(const std::string& topic, const std::vector<std::uint8_t>& bytes) override {
    const Writer& writer = writers_.at(topic);
    const Sample sample(*writer.type, bytes);
    const dds_return_t code = dds_write(writer.handle, sample.get());
    // A subscriber that is too slow misses messages, which is not an error.
    if (code == DDS_RETCODE_OK || code == DDS_RETCODE_TIMEOUT) return {};
    return core::failure(core::ErrorKind::kOutput,
                         fmt::format("{}: cannot be published ({})", topic, dds_strretcode(code)));
  }

  std::size_t listeners(const std::string& topic) override {
    dds_publication_matched_status_t status{};
    const auto found = writers_.find(topic);
    const bool known = found != writers_.end() &&
                       dds_get_publication_matched_status(found->second.handle, &status) == DDS_RETCODE_OK;
    return known ? status.current_count : 0;
  }

  void flush(std::chrono::milliseconds most) override {
    // All topics share the time
    const auto until = std::chrono::steady_clock::now() + most;
    for (const auto& [topic, writer] : writers_) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
      if (left.count() > 0) dds_wait_for_acks(writer.handle, DDS_MSECS(left.count()));
    }
  }

 private:
  struct Writer {
    dds_entity_t handle = 0;
    const dds_topic_descriptor_t* type = nullptr;
  };

  static Qos writer_qos(const KnownType& type, dataset::Retention retention) {
    Qos qos = new_qos();
    pin_representation(qos);
    const bool latest = retention == dataset::Retention::kLatest;
    // A reliable writer serves both kinds of reader; a slow one holds it up no longer than this.
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(2));
    dds_qset_durability(qos.get(), latest ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kSamplesKeptByWriter);
    if (latest) {
      dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                                  DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
    }
    if (*type.hash != '\0') {
      const std::string hash = fmt::format("typehash=RIHS01_{};", type.hash);
      dds_qset_userdata(qos.get(), hash.data(), hash.size());
    }
    return qos;
  }

  Ros2Participant participant_;
  std::map<std::string, Writer> writers_;
};

}  // namespace

core::Result<std::unique_ptr<dataset::MessageSink>> open_sink(const NetworkOptions& options) {
  auto sink = std::make_unique<Ros2Sink>();
  if (auto opened = sink->open(options); !opened) return tl::unexpected(opened.error());
  return sink;
}

}  // namespace plumbline::net
