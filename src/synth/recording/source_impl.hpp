// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One camera of a generated world: its parts. Private to the module.
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "plumbline/sensor/rectify.hpp"
#include "plumbline/synth/source.hpp"
#include "recording/kept_round.hpp"
#include "render/color_faults.hpp"
#include "render/depth_sensor.hpp"
#include "render/path.hpp"
#include "render/render.hpp"
#include "scene/rig.hpp"

namespace plumbline::synth {

constexpr double kFirstStamp = 100.0;  // seconds; stamps of 0 look like missing ones

/// Size of depth images.
cv::Size depth_size(const SynthOptions& options);

/// Time stamps of one frame, seconds.
struct Stamps {
  std::int64_t number;  ///< of the frame before any were dropped; the noise's counter
  double color, depth;
};

struct SynthSource::Impl {
  std::shared_ptr<const World> world;
  int robot = 0;
  std::string name;
  std::string format = "synth";
  sensor::Camera camera;                               ///< the true one
  sensor::Camera told;                                 ///< of the recording's file
  sensor::Pinhole images;                              ///< of rectified pictures
  std::shared_ptr<const sensor::Rectifier> rectifier;  ///< by `told`; null: pictures are rectified
  geometry::Rigid3 body_from_camera;
  DepthFaults faults;
  ColorFaults color_faults;
  LensMarks marks;
  std::uint64_t seed = 0;
  std::shared_ptr<const CameraPath> path;
  std::vector<Stamps> frames;
  std::size_t round = 0;            ///< frames of one round; later ones are these again
  std::vector<Event> events;        ///< of all rounds
  std::shared_ptr<KeptRound> kept;  ///< null: there is one round
  NoiseTiles tiles;
  /// Automatic exposure, every kGainStep frames, as far as it was needed; of all sources of this recording.
  struct Exposures {
    std::mutex mutex;
    std::vector<float> gains;
    float level = 0.0F;  ///< of the last of them
  };
  std::shared_ptr<Exposures> exposures = std::make_shared<Exposures>();
  static constexpr int kGainStep = 10;

  /// Pose of the camera, which looks ahead along the path if it is not one of a rig.
  [[nodiscard]] geometry::Rigid3 at(double t) const {
    const geometry::Rigid3 ahead = path->world_from_camera(t);
    return world->options.rig.empty() ? ahead
                                      : ahead * synth::body_from_camera().inverse() * body_from_camera;
  }
  [[nodiscard]] geometry::Rigid3 pose(double stamp) const { return at(stamp - kFirstStamp); }
  [[nodiscard]] double event(EventKind kind, double stamp) const {
    for (const Event& e : world->events) {
      if (e.kind == kind && e.active(stamp - kFirstStamp)) return e.value;
    }
    return 0.0;
  }
  [[nodiscard]] const sensor::Pinhole& depth_camera() const {
    return camera.depth ? *camera.depth : camera.color;
  }
  [[nodiscard]] core::Result<void> check_way() const;
  void repeat();
  /// The frame of the first round that frame `index` shows again.
  [[nodiscard]] const Stamps& first_of(std::size_t index) const { return frames.at(index % round); }
  [[nodiscard]] float gain(std::int64_t number) const;
  /// Factor of faults on the gain of a frame's row that is taken at `stamp`.
  [[nodiscard]] float row_gain(const Stamps& at, double stamp) const {
    return faulty_gain(color_faults, at.color - kFirstStamp, stamp - kFirstStamp, seed);
  }
  [[nodiscard]] cv::Mat3b color(const Stamps& at) const;
  [[nodiscard]] cv::Mat3b rolling(const Stamps& at, const Exposure& exposure) const;
  [[nodiscard]] cv::Mat2f flow(const View& view, const Stamps& at, double extra_px) const;
};

}  // namespace plumbline::synth
