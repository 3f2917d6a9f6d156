// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Reading and writing bags, as a separate part (core/part.hpp): CycloneDDS (which brings OpenSSL along),
// SQLite and the compression libraries are loaded only when a bag is opened.
#include "bags/bag_writer.hpp"
#include "bags/messages.hpp"
#include "plumbline/core/part.hpp"

namespace plumbline::dataset {

struct BagReaders {
  static constexpr const char* kPart = "bags";
  static constexpr std::uint64_t layout() {
    return core::layout_of<BagReaders, MessageDecoder, BagEntry, BagTopic, ImageMessage, CameraInfoMessage,
                           TransformMessage, PathMessage, CloudMessage, GridMessage, PoseMessage>();
  }

  /// Opens a bag of any format, which is recognised by its content.
  OpenedBag (*open)(const std::filesystem::path& file);
  const MessageDecoder& (*cdr)();
  const MessageDecoder& (*ros1)();
  const MessageEncoder& (*encoder)();
  /// `made_by`: the program's name in the head of the file.
  std::unique_ptr<BagWriter> (*create_mcap)(const std::filesystem::path& file, const std::string& made_by);
};

}  // namespace plumbline::dataset
