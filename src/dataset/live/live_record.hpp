// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// MCAP file with the messages of a live camera's frames, as they arrived.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "bags/bag_writer.hpp"
#include "live/stamp_pairs.hpp"
#include "plumbline/sensor/camera_file.hpp"

namespace plumbline::dataset {

class LiveRecord {
 public:
  struct Topics {
    BagTopic color;
    BagTopic depth;
    std::string info;        ///< CameraInfo of colour; "": none
    std::string depth_info;  ///< "": none, or the same
  };
  /// CameraInfo messages that accompany each frame; none: nothing is known.
  struct Infos {
    std::optional<CameraInfoMessage> color;
    std::optional<CameraInfoMessage> depth;
  };

  /// Error (kUsage): there is such a file, and it may not be replaced; its ending is not ".mcap".
  static core::Result<void> check(const std::filesystem::path& file, bool replace);
  static core::Result<std::unique_ptr<LiveRecord>> create(const std::filesystem::path& file, Topics topics,
                                                          Infos infos, sensor::Camera camera);
  void add(const StampPairs::Pair& pair);
  core::Result<void> finish();

 private:
  LiveRecord(std::unique_ptr<BagWriter> bag, Topics topics, Infos infos, sensor::Camera camera);
  void begin(std::int64_t stamp_ns);
  void add_info(const std::string& topic, std::optional<CameraInfoMessage>& info, std::int64_t stamp_ns);

  std::unique_ptr<BagWriter> bag_;
  Topics topics_;
  Infos infos_;
  sensor::Camera camera_;
  bool begun_ = false;
};

}  // namespace plumbline::dataset
