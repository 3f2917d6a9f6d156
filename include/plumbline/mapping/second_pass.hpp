// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The part of a recording that came before its camera was known is mapped once more
// (docs/method/calibration.md): a wrong camera makes the tracker reject right matches, which no adjustment of
// the map brings back.
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/mapping/slam.hpp"

namespace plumbline::mapping {

/// The frames of a second pass: all that became keyframes, and every third one between them. What is chosen
/// depends on the frames before only, so that a live source can keep these pictures.
class SecondPassChoice {
 public:
  /// To be called for every frame in turn. True: the frame is one of them.
  bool takes(bool keyframe) {
    constexpr int kEvery = 3;
    since_ = keyframe || since_ + 1 == kEvery ? 0 : since_ + 1;
    return since_ == 0;
  }

 private:
  int since_ = 0;
};

struct SecondPass {
  sensor::Camera camera;  ///< the better one
  /// A picture and its features, read with that camera; none: it cannot be read. `stamp`: of a frame of the
  /// first pass. Called from several threads at a time.
  using Read = std::function<std::optional<std::pair<sensor::RgbdFrame, Slam::Features>>(double stamp)>;
  Read read;
  /// A Slam like the one of the first pass, which has seen nothing yet and has the better camera.
  std::function<std::unique_ptr<Slam>()> begin;
};

/// Tracks the chosen frames again and makes keyframes where the first pass made them, with the same ids. The
/// poses of the frames between follow from the steps that the tracker measured in the first pass. The same
/// for any number of threads. Null, and the first pass stays: its map has several components, a picture
/// cannot be read, or a keyframe is not found again.
std::unique_ptr<Slam> map_again(const Slam& first, const SecondPass& how, const core::Executor& executor);

}  // namespace plumbline::mapping
