// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A scene filmed on demand: the same frames for a seed, whatever the order or the number of threads.
#include <memory>
#include <string>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/synth/options.hpp"
#include "plumbline/synth/scene.hpp"

namespace plumbline::synth {

class World;  // scene made ready to render: textures, light maps, BVH

/// Makes a scene ready to film, for all robots; checks that their paths are free. Textures and light are made
/// when a picture first needs them.
core::Result<std::shared_ptr<const World>> build_world(const Scene& scene, const SynthOptions& options,
                                                       const core::Executor& executor);

/// Ground truth of one frame, for tests and instruments.
struct ExactFrame {
  geometry::Rigid3 world_from_depth;  ///< pose at the depth stamp
  cv::Mat depth;  ///< CV_32FC1 metres, of the true surfaces at the depth stamp, 0 = nothing hit
  cv::Mat face;   ///< CV_32SC1, index into Scene::faces, beyond them: a walker's, -1 = nothing hit
};

/// Motion of the camera, or of a frame that is fixed to it, at one moment.
struct PathMotion {
  geometry::Rigid3 world_from_frame;
  Eigen::Vector3d velocity;      ///< m/s, world
  Eigen::Vector3d acceleration;  ///< m/s^2, world, without gravity
  Eigen::Vector3d turn_rate;     ///< rad/s, in that frame
};

/// A door of a world made from a number that swings, or a drawer that slides.
struct DoorSwing {
  int opening;         ///< index into Plan::openings
  std::string drawer;  ///< its name; empty: a door
  double from, to;     ///< stamps, s
  double open;         ///< how far it is open afterwards, rad, or m
};

class SynthSource final : public dataset::FrameSource {
 public:
  /// Robot `robot` (from 0) of the scene. Errors: no frames, path through a solid (names the segment and the
  /// thing).
  static core::Result<std::unique_ptr<SynthSource>> create(const std::shared_ptr<const World>& world,
                                                           int robot);
  ~SynthSource() override;

  [[nodiscard]] const std::string& name() const override;
  [[nodiscard]] const std::string& format() const override;
  /// As the recording's file describes it (SynthOptions::camera_error).
  [[nodiscard]] const sensor::Camera& camera() const override;
  [[nodiscard]] const sensor::Camera& true_camera() const;
  [[nodiscard]] std::size_t size() const override;
  /// Frames of one round (SynthOptions::repeat); frame i shows what frame i modulo this shows.
  [[nodiscard]] std::size_t round() const;
  [[nodiscard]] dataset::PairInfo info(std::size_t index) const override;
  /// With the time at which depth really was taken.
  [[nodiscard]] dataset::PairInfo true_info(std::size_t index) const;
  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t index) const override;
  /// As the sensors give them, not rectified.
  [[nodiscard]] core::Result<dataset::StoredPair> stored(std::size_t index) const override;
  /// The same, rendered anew and not kept for further rounds.
  [[nodiscard]] dataset::StoredPair rendered(std::size_t index) const;
  /// Null if the camera's file is right.
  [[nodiscard]] std::unique_ptr<dataset::FrameSource> taken_by(const sensor::Camera& better) const override;
  /// Exact poses at the colour stamps, in the frame of the scene file.
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override;

  /// Exact pose at any time between first and last stamp (clamped to them).
  [[nodiscard]] geometry::Rigid3 world_from_camera(double stamp) const;
  /// At any time; outside of the recording the path goes on. `camera_from_frame`: whose motion it is.
  [[nodiscard]] PathMotion motion(double stamp, const geometry::Rigid3& camera_from_frame = {}) const;
  /// Pose of the camera on its body, whose x is forward and z up.
  [[nodiscard]] const geometry::Rigid3& body_from_camera() const;
  /// Time of the first frame without jitter, from which events count.
  [[nodiscard]] double start() const;
  [[nodiscard]] const std::vector<Event>& events() const;
  /// All that begin before the last frame, in the order of doors and times.
  [[nodiscard]] std::vector<DoorSwing> swings() const;
  /// CV_8UC1, 255 where the colour picture shows something that moves; empty if the world has nothing that
  /// does.
  [[nodiscard]] cv::Mat1b moving(std::size_t index) const;
  [[nodiscard]] ExactFrame exact(std::size_t index) const;
  /// True if an event blinds the depth sensor in this frame (covered camera, no depth).
  [[nodiscard]] bool blind(std::size_t index) const;
  /// Metres of path from the first to the last frame.
  [[nodiscard]] double path_length() const;

 private:
  struct Impl;
  friend core::Result<void> check_paths(const std::shared_ptr<const World>& world);
  static core::Result<std::unique_ptr<Impl>> plan(const std::shared_ptr<const World>& world, int robot);
  explicit SynthSource(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Checks that every robot's path is free, without building textures and light. The error names the segment
/// and the object.
core::Result<void> check_paths(const Scene& scene, const SynthOptions& options);
core::Result<void> check_paths(const std::shared_ptr<const World>& world);

/// Opens "synth:SCENE?key=value&..."; keys are those of SynthOptions and `robot` (0 .. robots-1).
/// Unknown scenes and keys are errors with a suggestion.
core::Result<std::unique_ptr<dataset::FrameSource>> open_synth(const std::string& url,
                                                               const std::filesystem::path& scenes_folder,
                                                               const core::Executor& executor,
                                                               core::Log& log);

/// True if an input is such a URL ("synth:...").
bool is_synth_url(const std::string& input);

/// The camera of a sensor at an image size. kinect: TUM fr3's intrinsics; depth_scale 5000; no distortion.
sensor::Camera make_camera(Sensor sensor, int width, int height, double fps);

}  // namespace plumbline::synth
