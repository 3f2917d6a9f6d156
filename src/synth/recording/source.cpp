// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/synth/source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <opencv2/imgproc.hpp>

#include "plumbline/sensor/rectify.hpp"
#include "recording/kept_round.hpp"
#include "render/color_faults.hpp"
#include "render/depth_sensor.hpp"
#include "render/path.hpp"
#include "render/render.hpp"
#include "scene/camera_error.hpp"
#include "scene/random.hpp"
#include "scene/rig.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;
using geometry::Rigid3;

sensor::Camera make_camera(Sensor sensor, int width, int height, double fps) {
  sensor::Camera camera;
  camera.name = fmt::format("synth_{}", to_string(sensor));
  const double s = std::min(width / 640.0, height / 480.0);
  // Colour cameras 69 degrees across.
  const bool wide = sensor == Sensor::kRealsense || sensor == Sensor::kStereo || sensor == Sensor::kPhone;

  camera.color = {width,
                  height,
                  (wide ? 462.0 : 535.4) * s,
                  (wide ? 462.0 : 539.2) * s,
                  0.5 * width + 0.1 * s,
                  0.5 * height + 7.6 * s};

  if (sensor == Sensor::kIdeal) camera.color.fx = camera.color.fy = 525.0 * s;
  if (sensor == Sensor::kIdeal) camera.color.cx = 0.5 * (width - 1);
  if (sensor != Sensor::kKinect && sensor != Sensor::kStructured) camera.color.cy = 0.5 * (height - 1);
  camera.depth_scale = 5000.0;
  camera.fps = fps;
  camera.readout_s = 0.0;
  return camera;
}

/// Time stamps of one frame, seconds.
struct Stamps {
  std::int64_t number;  ///< of the frame before any were dropped; the noise's counter
  double color, depth;
};

namespace {

constexpr double kFirstStamp = 100.0;  // seconds; stamps of 0 look like missing ones

/// Rounds to whole microseconds, the resolution of six decimals in a file.
double whole_us(double t) { return std::round(t * 1e6) / 1e6; }

/// Size of depth images.
cv::Size depth_size(const SynthOptions& o) {
  if (o.depth_width > 0) return {o.depth_width, o.depth_height};
  return o.sensor == Sensor::kPhone ? cv::Size(256, 192) : cv::Size(o.width, o.height);
}

std::vector<Stamps> make_stamps(const SynthOptions& o, const std::vector<Event>& events, std::size_t frames,
                                std::uint64_t seed) {
  Rng rng(seed, 0x57a3);
  const bool ideal = o.sensor == Sensor::kIdeal;
  const double offset = ideal ? 0.0 : rng.uniform(0.002, 0.006) * (rng.uniform() < 0.5 ? -1.0 : 1.0);
  std::vector<Stamps> out;
  for (std::size_t i = 0; i < frames; ++i) {
    const double t = static_cast<double>(i) / o.fps;
    const double jitter = ideal ? 0.0 : rng.uniform(-0.0012, 0.0012),
                 other = ideal ? 0.0 : rng.uniform(-0.0006, 0.0006);
    bool dropped = false;
    for (const Event& e : events) dropped = dropped || (e.kind == EventKind::kDrop && e.active(t));
    const double stamp = whole_us(kFirstStamp + t + jitter);
    if (!dropped)
      out.push_back(
          {static_cast<std::int64_t>(i), stamp, whole_us(stamp + offset + other + o.depth_delay_s)});
  }
  return out;
}

/// A path can be repeated if all its rounds are the same.
core::Result<void> check_repeat(const RobotPath& way, const std::vector<Event>& events) {
  if (!way.closed) {
    return core::usage_error(fmt::format(
        "repeat: the path of {} does not end where it began; add `closed: true` to it in a copy of "
        "the scene, or take a world made from a number (layout), whose paths do",
        way.name));
  }
  for (const Event& e : events) {
    if (e.kind == EventKind::kSpin)
      return core::usage_error("repeat: a spin makes rounds differ; leave out one of the two");
  }
  return {};
}

}  // namespace

struct SynthSource::Impl {
  std::shared_ptr<const World> world;
  int robot = 0;
  std::string name;
  std::string format = "synth";
  sensor::Camera camera;                               ///< the true one
  sensor::Camera told;                                 ///< of the recording's file
  sensor::Pinhole images;                              ///< of rectified pictures
  std::shared_ptr<const sensor::Rectifier> rectifier;  ///< by `told`; null: pictures are rectified
  Rigid3 body_from_camera;
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
  [[nodiscard]] Rigid3 at(double t) const {
    const Rigid3 ahead = path->world_from_camera(t);
    return world->options.rig.empty() ? ahead
                                      : ahead * synth::body_from_camera().inverse() * body_from_camera;
  }
  [[nodiscard]] Rigid3 pose(double stamp) const { return at(stamp - kFirstStamp); }
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

/// Every step from frame to frame must be free, and must not start inside something.
core::Result<void> SynthSource::Impl::check_way() const {
  const RobotPath& robot_path =
      world->scene
          .robots[world->options.rig.empty() ? static_cast<std::size_t>(robot) % world->scene.robots.size()
                                             : 0];
  const auto complain = [&](const Vector3d& p, double t, const Hit& hit, const char* how) {
    const std::size_t k = path->waypoint_at(t), n = robot_path.waypoints.size();
    const Object& thing =
        world->scene
            .objects[static_cast<std::size_t>(world->scene.faces[static_cast<std::size_t>(hit.face)].object)];

    const core::ConfigMark& mark = robot_path.waypoints[k].mark;
    return core::usage_error(
        fmt::format("{}:{}: the path of {} {} {} (line {}) between waypoints {} and {}, at ({:.2f}, {:.2f}, "
                    "{:.2f}); move a waypoint or the object",
                    mark.file, mark.line, robot_path.name, how, thing.name, thing.mark.line, k, (k + 1) % n,
                    p.x(), p.y(), p.z()));
  };

  const double end = frames.back().color - kFirstStamp;
  const Vector3d first = at(0.0).translation;
  const Vector3d up = Vector3d(0.0123, 0.0211, 1.0).normalized();

  if (const Hit hit = world->cast(first, up, 1e4); hit.face >= 0 && !hit.front) {
    return complain(first, 0.0, hit, "starts inside");
  }

  Vector3d here = first;
  const double once = std::min(end, 2.0 * path->duration() + 60.0);  // later rounds repeat the first

  for (double t = 0.02; t <= once; t += 0.02) {
    const Vector3d to = at(t).translation;
    const Vector3d step = to - here;
    const double length = step.norm();
    if (length > 1e-7) {
      // 5 cm of room in front of the camera body
      const Hit hit = world->cast(here, step / length, length + 0.05);
      if (hit.face >= 0) return complain(to, t, hit, "goes through");
    }

    here = to;
  }

  return {};
}

float SynthSource::Impl::gain(std::int64_t number) const {
  const sensor::Camera small = make_camera(world->options.sensor, 64, 48, world->options.fps);
  const auto k = static_cast<std::size_t>(number / kGainStep);
  const std::lock_guard<std::mutex> lock(exposures->mutex);
  std::vector<float>& gains = exposures->gains;
  float& level = exposures->level;
  for (std::size_t i = gains.size(); i < k + 2; ++i) {
    const double t = static_cast<double>(i * kGainStep) / world->options.fps;
    const float now = std::max(0.02F, mean_level(*world, look(*world, small.color, this->at(t))));
    level = i == 0 ? now : level + 0.25F * (now - level);
    gains.push_back(std::clamp(0.68F / level, 0.35F, 3.0F));
  }

  const float s = static_cast<float>(number % kGainStep) / static_cast<float>(kGainStep);
  return gains[k] + s * (gains[k + 1] - gains[k]);
}

/// Pixels that things move during the exposure, on a grid 8 times coarser than the picture.
cv::Mat2f SynthSource::Impl::flow(const View& view, const Stamps& at, double extra_px) const {
  const double exposure = color_faults.motion_blur > 0.0 ? color_faults.motion_blur : 0.010;
  const Rigid3 later = pose(at.color + 0.5 * exposure).inverse(),
               sooner = pose(at.color - 0.5 * exposure).inverse();
  const int w = (view.ids.cols + 7) / 8, h = (view.ids.rows + 7) / 8;
  cv::Mat2f out(h, w);

  const double angle = Rng(seed, 0xb1 + static_cast<std::uint64_t>(at.number / 15)).uniform(0.0, 2.0 * M_PI);
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i) {
      const int x = std::min(8 * i + 4, view.ids.cols - 1), y = std::min(8 * j + 4, view.ids.rows - 1);
      double z = 3.0;
      if (const int id = view.ids(y, x); id >= 0) {
        const FaceView& f = view.faces[static_cast<std::size_t>(id)];
        z = 1.0 /
            static_cast<double>(f.c[0] * static_cast<float>(x) + f.c[1] * static_cast<float>(y) + f.c[2]);
      }

      const Vector3d p = view.world_from_camera * view.camera.unproject(x, y, z);
      const World::Mover* mover = color_faults.motion_blur > 0.0 ? world->mover_of(view.ids(y, x)) : nullptr;
      const auto at_time = [&](double dt) -> Vector3d {
        const double now = at.color - kFirstStamp;
        return mover == nullptr
                   ? p
                   : world->motion(*mover, now + dt) * (world->motion(*mover, now).inverse() * p);
      };
      const Eigen::Vector2d d = view.camera.project(later * at_time(0.5 * exposure)) -
                                view.camera.project(sooner * at_time(-0.5 * exposure));
      out(j, i) = {static_cast<float>(d.x() + extra_px * std::cos(angle)),
                   static_cast<float>(d.y() + extra_px * std::sin(angle))};
    }
  }

  return out;
}

/// Renders a few rows at a time, each from the camera's pose when they were read out.
cv::Mat3b SynthSource::Impl::rolling(const Stamps& at, const Exposure& exposure) const {
  constexpr int kRows = 8;
  cv::Mat3b image(camera.color.height, camera.color.width);

  for (int first = 0; first < image.rows; first += kRows) {
    sensor::Pinhole strip = camera.color;
    strip.height = std::min(kRows, image.rows - first);
    strip.cy -= first;
    const double middle = (first + 0.5 * strip.height) / image.rows - 0.5;
    const double stamp = at.color + middle * world->options.readout_s;
    View view = look(*world, strip, pose(stamp), stamp - kFirstStamp);
    view.first_row = first;
    view.picture_rows = image.rows;

    cv::Mat3b rows = shade(*world, view, {exposure.gain * row_gain(at, stamp), exposure.vignette});
    for (int y = 0; color_faults.flicker > 0.0 && y < rows.rows; ++y) {
      const double row_stamp = stamp + (y + 0.5 - 0.5 * rows.rows) / image.rows * world->options.readout_s;
      rows.row(y) *= row_gain(at, row_stamp) / row_gain(at, stamp);
    }
    rows.copyTo(image.rowRange(first, first + strip.height));
  }
  return image;
}

cv::Mat3b SynthSource::Impl::color(const Stamps& at) const {
  const Sensor sensor = world->options.sensor;
  const View view = look(*world, camera.color, pose(at.color), at.color - kFirstStamp);
  const bool real = sensor != Sensor::kIdeal;
  Exposure exposure{gain(at.number), real ? 0.18F : 0.0F};
  if (event(EventKind::kLampOff, at.color) != 0.0) exposure.gain *= 0.08F;
  if (event(EventKind::kCover, at.color) != 0.0) exposure.gain *= 0.004F;
  if (event(EventKind::kWhiteout, at.color) != 0.0) exposure.gain *= 60.0F;

  cv::Mat3b image = world->options.readout_s > 0.0
                        ? rolling(at, exposure)
                        : shade(*world, view, {exposure.gain * row_gain(at, at.color), exposure.vignette});
  const double blur = event(EventKind::kBlur, at.color);
  const bool moves = color_faults.motion_blur > 0.0;

  if (real) {
    cv::GaussianBlur(image, image, {3, 3}, 0.6);  // lens and mosaic
    image = motion_blur(image, flow(view, at, blur));
  } else if (blur > 0.0 || moves) {
    image = motion_blur(image, flow(view, at, blur));
  }

  marks.apply(image);
  const float noise_gain = event(EventKind::kLampOff, at.color) != 0.0 ? 3.0F : exposure.gain;
  add_color_noise(image, sensor, noise_gain, tiles, {seed, at.number});
  return image;
}

/// The frames of one round, and again with later stamps.
void SynthSource::Impl::repeat() {
  const SynthOptions& o = world->options;
  const auto once = static_cast<std::size_t>(std::lround(path->duration() * o.fps));
  const std::size_t all = once * static_cast<std::size_t>(o.repeat);
  const std::size_t wanted = o.frames > 0 ? std::min(all, static_cast<std::size_t>(o.frames)) : all;
  frames = make_stamps(o, world->events, std::min(once, wanted), seed);
  round = frames.size();
  kept = std::make_shared<KeptRound>(round);

  for (std::size_t first = once; first < wanted; first += once) {
    const double later = static_cast<double>(first) / o.fps;
    for (std::size_t i = 0; i < round; ++i) {
      const Stamps& at = frames[i];
      if (first + static_cast<std::size_t>(at.number) >= wanted) break;
      frames.push_back({at.number, whole_us(at.color + later), whole_us(at.depth + later)});
    }
    for (Event event : world->events) {
      event.start_s += later;
      events.push_back(event);
    }
  }
}

SynthSource::SynthSource(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SynthSource::~SynthSource() = default;

/// Everything that needs no picture: motion, stamps, and the check of the path.
core::Result<std::unique_ptr<SynthSource::Impl>> SynthSource::plan(std::shared_ptr<const World> world,
                                                                   int robot) {
  const SynthOptions& o = world->options;
  if (auto ok = check(o); !ok) return tl::unexpected<core::Error>(ok.error());
  if (robot < 0 || robot >= recordings(o)) {
    return core::usage_error(
        fmt::format("robot {} of {}: robots count from 0 to {}", robot, recordings(o), recordings(o) - 1));
  }

  const auto paths = world->scene.robots.size();
  const int driver = o.rig.empty() ? robot : 0;
  const RobotPath& way = world->scene.robots[static_cast<std::size_t>(driver) % paths];
  auto impl = std::make_unique<Impl>();
  impl->world = world;
  impl->robot = robot;
  impl->name = recordings(o) > 1 ? fmt::format("{}-robot{}", world->scene.name, robot) : world->scene.name;

  impl->camera = make_camera(o.sensor, o.width, o.height, o.fps);
  impl->camera.readout_s = o.readout_s;
  impl->camera.depth_delay_s = o.depth_delay_s;
  if (const cv::Size depth = depth_size(o); depth != cv::Size(o.width, o.height)) {
    impl->camera.depth = impl->camera.color.resized(depth.width, depth.height);
    impl->camera.color_from_depth = Rigid3();
  }

  auto told = told_camera(o, robot, impl->camera);
  if (!told) return tl::unexpected<core::Error>(told.error());
  impl->told = std::move(*told);
  impl->images = impl->told.color;
  impl->body_from_camera =
      o.rig.empty() ? synth::body_from_camera() : (*read_rig(o))[static_cast<std::size_t>(robot)];

  impl->faults = *depth_faults(o.depth_faults);
  impl->color_faults = *color_faults(o.color_faults);
  if (!o.camera_error.empty() || impl->camera.depth)
    impl->rectifier = std::make_shared<const sensor::Rectifier>(impl->told);
  impl->seed = mix(static_cast<std::uint64_t>(o.seed), static_cast<std::uint64_t>(robot) + 1);

  if (o.repeat > 1) {
    if (auto ok = check_repeat(way, world->events); !ok) return tl::unexpected<core::Error>(ok.error());
  }
  impl->path = std::make_shared<const CameraPath>(camera_path(world->scene, o, world->events, driver));

  impl->events = world->events;
  if (o.repeat > 1) {
    impl->repeat();
  } else {
    const std::size_t frames = o.frames > 0 ? static_cast<std::size_t>(o.frames)
                                            : static_cast<std::size_t>(impl->path->duration() * o.fps) + 1;
    impl->frames = make_stamps(o, world->events, frames, impl->seed);
    impl->round = impl->frames.size();
  }
  if (impl->frames.empty())
    return core::usage_error("events: every frame is dropped, nothing is left to film");
  if (auto free = impl->check_way(); !free) return tl::unexpected<core::Error>(free.error());

  return impl;
}

core::Result<std::unique_ptr<SynthSource>> SynthSource::create(std::shared_ptr<const World> world,
                                                               int robot) {
  auto planned = plan(std::move(world), robot);
  if (!planned) return tl::unexpected<core::Error>(planned.error());
  std::unique_ptr<Impl> impl = std::move(*planned);
  impl->marks =
      LensMarks(impl->color_faults, {impl->camera.color.width, impl->camera.color.height}, impl->seed);
  impl->tiles = make_noise(impl->world->options.sensor, impl->seed);
  return std::unique_ptr<SynthSource>(new SynthSource(std::move(impl)));
}

core::Result<void> check_paths(const std::shared_ptr<const World>& world) {
  for (int robot = 0; robot < recordings(world->options); ++robot) {
    if (auto planned = SynthSource::plan(world, robot); !planned)
      return tl::unexpected<core::Error>(planned.error());
  }
  return {};
}

core::Result<void> check_paths(const Scene& scene, const SynthOptions& options) {
  if (auto ok = check(options); !ok) return ok;
  if (scene.faces.empty() || scene.robots.empty())
    return core::usage_error(
        fmt::format("scene '{}' has no surfaces or no robot; add `objects:` and `robots:`", scene.name));
  return check_paths(std::make_shared<const World>(scene, options));
}

const std::string& SynthSource::name() const { return impl_->name; }
const std::string& SynthSource::format() const { return impl_->format; }
const sensor::Camera& SynthSource::camera() const { return impl_->told; }
const sensor::Camera& SynthSource::true_camera() const { return impl_->camera; }
std::size_t SynthSource::size() const { return impl_->frames.size(); }
std::size_t SynthSource::round() const { return impl_->round; }

dataset::PairInfo SynthSource::true_info(std::size_t index) const {
  const Stamps& at = impl_->frames.at(index);
  return {at.color, at.depth, "", ""};
}

dataset::PairInfo SynthSource::info(std::size_t index) const {
  dataset::PairInfo info = true_info(index);
  info.depth_stamp += impl_->told.depth_delay_s - impl_->camera.depth_delay_s;
  return info;
}

std::unique_ptr<dataset::FrameSource> SynthSource::taken_by(const sensor::Camera& better) const {
  const SynthOptions& o = impl_->world->options;
  if (o.camera_error.empty() && o.depth_faults.empty()) return nullptr;
  auto impl = std::make_unique<Impl>(*impl_);
  impl->rectifier = std::make_shared<const sensor::Rectifier>(better, impl_->images);
  impl->told = better;
  return std::unique_ptr<FrameSource>(new SynthSource(std::move(impl)));
}

core::Result<dataset::StoredPair> SynthSource::stored(std::size_t index) const {
  if (index >= impl_->frames.size()) {
    return core::input_error(fmt::format("{}: frame {} of {}", impl_->name, index, impl_->frames.size()));
  }

  const std::size_t first = index % impl_->round;
  if (impl_->kept == nullptr) return rendered(index);
  if (auto pair = impl_->kept->find(first)) return std::move(*pair);
  dataset::StoredPair pair = rendered(index);
  if (first + impl_->round < size()) impl_->kept->keep(first, pair);
  return pair;
}

dataset::StoredPair SynthSource::rendered(std::size_t index) const {
  const Stamps& at = impl_->first_of(index);
  dataset::StoredPair pair;
  pair.color.pixels = impl_->color(at);
  if (blind(index)) {
    pair.depth.pixels = cv::Mat1w::zeros(depth_size(impl_->world->options));
  } else {
    const View view =
        look(*impl_->world, impl_->depth_camera(), impl_->pose(at.depth), at.depth - kFirstStamp);
    pair.depth.pixels = measure_depth(*impl_->world, view, impl_->world->options.sensor, impl_->faults,
                                      impl_->tiles, {impl_->seed, at.number});
  }
  return pair;
}

core::Result<sensor::RgbdFrame> SynthSource::read(std::size_t index) const {
  const auto pair = stored(index);
  if (!pair) return tl::unexpected<core::Error>(pair.error());
  const sensor::Rectifier* rectifier = impl_->rectifier.get();
  const dataset::PairInfo at = info(index);
  sensor::RgbdFrame frame;
  frame.index = static_cast<std::int64_t>(index);
  frame.stamp = at.stamp;
  frame.depth_stamp = at.depth_stamp;

  frame.color = rectifier ? rectifier->color(pair->color.pixels) : pair->color.pixels;
  cv::cvtColor(frame.color, frame.gray, cv::COLOR_BGR2GRAY);
  if (rectifier) {
    frame.depth = rectifier->depth(pair->depth.pixels);
  } else {
    pair->depth.pixels.convertTo(frame.depth, CV_32F, 1.0 / impl_->camera.depth_scale);
  }
  return frame;
}

std::optional<geometry::Trajectory> SynthSource::truth() const {
  geometry::Trajectory trajectory;
  for (const Stamps& at : impl_->frames) trajectory.push_back({at.color, impl_->pose(at.color)});
  return trajectory;
}

Rigid3 SynthSource::world_from_camera(double stamp) const {
  const auto& f = impl_->frames;
  return impl_->pose(std::clamp(stamp, std::min(f.front().color, f.front().depth),
                                std::max(f.back().color, f.back().depth)));
}

PathMotion SynthSource::motion(double stamp, const Rigid3& camera_from_frame) const {
  constexpr double kStep = 1e-3;
  const auto at = [&](double t) { return impl_->pose(t) * camera_from_frame; };
  const Rigid3 before = at(stamp - kStep), now = at(stamp), after = at(stamp + kStep);
  return {now, (after.translation - before.translation) / (2.0 * kStep),
          (after.translation - 2.0 * now.translation + before.translation) / (kStep * kStep),
          geometry::log_so3(before.rotation.transpose() * after.rotation) / (2.0 * kStep)};
}

const Rigid3& SynthSource::body_from_camera() const { return impl_->body_from_camera; }
double SynthSource::start() const { return kFirstStamp; }
const std::vector<Event>& SynthSource::events() const { return impl_->events; }

std::vector<DoorSwing> SynthSource::swings() const {
  std::vector<DoorSwing> out;
  const double end = impl_->frames.back().color - kFirstStamp;
  const double once = impl_->kept ? impl_->path->duration() : end;
  for (const MovingDoor& door : impl_->world->scene.moving_doors) {
    for (int round = 0; round * once < end; ++round) {
      for (const double start : door.starts) {
        for (const bool back : {false, true}) {
          const double at = round * once + start + (back ? door.swing + door.hold : 0.0);
          if (start < once && at < end)
            out.push_back({door.opening, kFirstStamp + at, kFirstStamp + at + door.swing,
                           back ? door.rest_rad : door.other_rad});
        }
      }
    }
  }
  return out;
}

cv::Mat1b SynthSource::moving(std::size_t index) const {
  const World& world = *impl_->world;
  if (world.movers.empty()) return {};
  const double stamp = impl_->first_of(index).color;
  const View view = look(world, impl_->camera.color, impl_->pose(stamp), stamp - kFirstStamp);
  return cv::Mat1b(view.ids >= static_cast<int>(world.fixed_faces));
}

ExactFrame SynthSource::exact(std::size_t index) const {
  const Stamps& at = impl_->first_of(index);
  ExactFrame out;
  out.world_from_depth = impl_->pose(at.depth);
  const View view = look(*impl_->world, impl_->depth_camera(), out.world_from_depth, at.depth - kFirstStamp);
  out.depth = exact_depth(view);
  out.face = view.ids;
  return out;
}

bool SynthSource::blind(std::size_t index) const {
  const double stamp = impl_->first_of(index).depth;
  return impl_->event(EventKind::kNoDepth, stamp) != 0.0 || impl_->event(EventKind::kCover, stamp) != 0.0;
}

double SynthSource::path_length() const {
  double length = 0.0;
  for (std::size_t i = 1; i < impl_->frames.size(); ++i) {
    length += (impl_->pose(impl_->frames[i].color).translation -
               impl_->pose(impl_->frames[i - 1].color).translation)
                  .norm();
  }
  return length;
}

}  // namespace plumbline::synth
