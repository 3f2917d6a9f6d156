// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/synth/source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "recording/source_impl.hpp"
#include "scene/camera_error.hpp"
#include "scene/random.hpp"

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

namespace {

/// Rounds to whole microseconds, the resolution of six decimals in a file.
double whole_us(double t) { return std::round(t * 1e6) / 1e6; }

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

  constexpr double kStep = 0.02;  // s
  const auto steps = static_cast<int>(once / kStep);
  for (int i = 1; i <= steps; ++i) {
    const double t = i * kStep;
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
core::Result<std::unique_ptr<SynthSource::Impl>> SynthSource::plan(const std::shared_ptr<const World>& world,
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

core::Result<std::unique_ptr<SynthSource>> SynthSource::create(const std::shared_ptr<const World>& world,
                                                               int robot) {
  auto planned = plan(world, robot);
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
  return {at.color, at.depth, {}};
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

}  // namespace plumbline::synth
