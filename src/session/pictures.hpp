// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pictures of a result's keyframes.
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <string>

#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::session {

/// Keeps recordings open that it was asked for. Thread-safe.
class KeyframePictures {
 public:
  /// CV_8UC3 (BGR): from the recording, else whole or small from the store. Errors (kInput): none has it.
  core::Result<cv::Mat> read(const std::filesystem::path& store, const std::string& robot,
                             std::int32_t keyframe, double stamp);

 private:
  /// The recording of a robot as its last camera took it; null: it cannot be opened.
  const dataset::FrameSource* recording(const maps::StoreHeader& header, std::size_t robot,
                                        const std::filesystem::path& folder);

  std::mutex mutex_;
  std::unique_ptr<core::Executor> executor_;  ///< of generated worlds
  std::map<std::size_t, std::unique_ptr<dataset::FrameSource>> recordings_;
};

}  // namespace plumbline::session
