// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of a queue as those of a recording.
#include <map>
#include <memory>
#include <string>

#include "layout.hpp"
#include "live/live_queue.hpp"
#include "live/live_stream.hpp"

namespace plumbline::dataset {

/// State that all views of one live camera share.
struct LiveCamera {
  std::string name;
  std::string doubt{};
  Layout layout{};                                             ///< of the first frames
  std::shared_ptr<LiveQueue> queue{};                          ///< that frames come from
  std::shared_ptr<LiveStream> stream{};                        ///< fills the queue; null: its user does
  std::size_t lag = 0;                                         ///< later frames that a frame waits for
  std::map<std::string, geometry::Rigid3> body_from_camera{};  ///< by the body's frame
};

/// The frames as `camera` took them, rectified into images of camera.color.
std::unique_ptr<LiveFrameSource> make_live_source(std::shared_ptr<LiveCamera> live,
                                                  const sensor::Camera& camera);

}  // namespace plumbline::dataset
