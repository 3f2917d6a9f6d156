// SPDX-License-Identifier: BSD-3-Clause
#include "images/container.hpp"

#include <memory>

extern "C" {
#include <libavcodec/packet.h>
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
#include <libavutil/log.h>
}

namespace plumbline::dataset {
namespace {

constexpr AVRational kMicroseconds = {1, 1'000'000};

AVFormatContext* context_of(void* container) { return static_cast<AVFormatContext*>(container); }

void close_container(void* container) {
  AVFormatContext* context = context_of(container);
  avformat_close_input(&context);
}

std::map<std::string, std::string> tags_of(const AVDictionary* dictionary) {
  std::map<std::string, std::string> tags;
  const AVDictionaryEntry* entry = nullptr;
  while ((entry = av_dict_get(dictionary, "", entry, AV_DICT_IGNORE_SUFFIX)) != nullptr)
    tags[entry->key] = entry->value;
  return tags;
}

/// The printable characters of the code, lowest byte first.
std::string fourcc_of(std::uint32_t tag) {
  std::string text;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    const char c = static_cast<char>((tag >> shift) & 0xFFU);
    if (c >= ' ' && c <= '~') text += c;
  }
  return text;
}

ContainerContents contents_of(const AVFormatContext& context) {
  ContainerContents contents;
  contents.tags = tags_of(context.metadata);
  for (unsigned i = 0; i < context.nb_streams; ++i) {
    const AVStream& stream = *context.streams[i];
    const AVCodecParameters& codec = *stream.codecpar;
    ContainerTrack track{avcodec_get_name(codec.codec_id), fourcc_of(codec.codec_tag), codec.width,
                         codec.height, tags_of(stream.metadata)};

    // FFmpeg lists attachments as streams
    if (codec.codec_type == AVMEDIA_TYPE_ATTACHMENT) {
      const auto* bytes = codec.extradata;
      contents.attachments.push_back(
          {track.tags["filename"], {bytes, bytes + static_cast<std::size_t>(codec.extradata_size)}});
    }
    contents.tracks.push_back(std::move(track));
  }
  return contents;
}

/// Null if the file is not readable as Matroska.
void* open_container(const char* file, ContainerContents& contents) {
  av_log_set_level(AV_LOG_QUIET);  // callers report errors with the file's name
  AVFormatContext* context = nullptr;
  const AVInputFormat* matroska = av_find_input_format("matroska");
  if (matroska == nullptr || avformat_open_input(&context, file, matroska, nullptr) < 0) return nullptr;
  contents = contents_of(*context);
  return context;
}

bool next_packet(void* container, ContainerPacket& packet, bool with_bytes) {
  const std::unique_ptr<AVPacket, void (*)(AVPacket*)> read(av_packet_alloc(),
                                                            [](AVPacket* p) { av_packet_free(&p); });
  if (read == nullptr || av_read_frame(context_of(container), read.get()) < 0) return false;

  // The stamp of decoding replaces a missing one
  packet.track = read->stream_index;
  const AVRational base = context_of(container)->streams[read->stream_index]->time_base;
  const std::int64_t pts = read->pts != AV_NOPTS_VALUE ? read->pts : read->dts;
  packet.stamp_us = av_rescale_q(pts == AV_NOPTS_VALUE ? 0 : pts, base, kMicroseconds);

  // Bytes are not needed to list the stamps
  packet.bytes.clear();
  if (with_bytes) packet.bytes.assign(read->data, read->data + read->size);
  return true;
}

bool seek_packet(void* container, int track, std::int64_t stamp_us) {
  AVFormatContext* context = context_of(container);
  const AVRational base = context->streams[track]->time_base;
  return av_seek_frame(context, track, av_rescale_q(stamp_us, kMicroseconds, base), AVSEEK_FLAG_BACKWARD) >=
         0;
}

}  // namespace
}  // namespace plumbline::dataset

PLUMBLINE_PART(plumbline::dataset::Demuxer, &plumbline::dataset::open_container,
               &plumbline::dataset::close_container, &plumbline::dataset::next_packet,
               &plumbline::dataset::seek_packet)
