// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Packets of a Matroska file as they are stored. The demuxer is a separate part (core/part.hpp): FFmpeg's
// libavformat.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "plumbline/core/part.hpp"

namespace plumbline::dataset {

struct ContainerTrack {
  std::string codec;  ///< FFmpeg's name for it: mjpeg, rawvideo ...
  std::string fourcc;
  int width = 0;
  int height = 0;
  std::map<std::string, std::string> tags;
};

struct ContainerAttachment {
  std::string name;
  std::vector<std::uint8_t> bytes;
};

struct ContainerContents {
  std::vector<ContainerTrack> tracks;  ///< by stream number, those of attachments too
  std::vector<ContainerAttachment> attachments;
  std::map<std::string, std::string> tags;
};

struct ContainerPacket {
  int track = 0;
  std::int64_t stamp_us = 0;
  std::vector<std::uint8_t> bytes;
};

struct Demuxer {
  static constexpr const char* kPart = "container";
  static constexpr std::uint64_t layout() {
    return core::layout_of<Demuxer, ContainerContents, ContainerTrack, ContainerPacket>();
  }

  void* (*open)(const char* file, ContainerContents& contents);  ///< null if it is not a Matroska file
  void (*close)(void* container);
  /// The next packet of any track; false at the end, and where the file is damaged. Without
  /// `with_bytes`, tracks and stamps alone.
  bool (*next)(void* container, ContainerPacket& packet, bool with_bytes);
  /// Seeks to a packet of the track at or before that stamp.
  bool (*seek)(void* container, int track, std::int64_t stamp_us);
};

}  // namespace plumbline::dataset
