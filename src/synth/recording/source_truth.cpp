// SPDX-License-Identifier: BSD-3-Clause
// What is true of a generated recording: motion, events, and what each frame shows.
#include <algorithm>
#include <cmath>

#include "recording/source_impl.hpp"

namespace plumbline::synth {

using geometry::Rigid3;

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

  // Central differences over two steps.
  return {now, (after.translation - before.translation) / (2.0 * kStep),
          (after.translation - 2.0 * now.translation + before.translation) / (kStep * kStep),
          geometry::log_so3(before.rotation.transpose() * after.rotation) / (2.0 * kStep)};
}

const Rigid3& SynthSource::body_from_camera() const { return impl_->body_from_camera; }
double SynthSource::start() const { return kFirstStamp; }
const std::vector<Event>& SynthSource::events() const { return impl_->events; }

namespace {

/// A row for each time that a part of a lift moves.
void add_moves(const MovingDoor& part, std::vector<DoorSwing>& out) {
  const std::vector<double>& shares = part.shares;
  const auto stamp = [](std::size_t k) {
    return kFirstStamp + static_cast<double>(k) * MovingDoor::kShareStep;
  };

  for (std::size_t i = 0; i + 1 < shares.size();) {
    const std::size_t begin = i++;
    if (shares[begin + 1] == shares[begin]) continue;
    while (i + 1 < shares.size() && shares[i + 1] != shares[i]) ++i;
    out.push_back({part.opening, part.drawer, stamp(begin), stamp(i), shares[i] * part.slide.norm()});
  }
}

}  // namespace

std::vector<DoorSwing> SynthSource::swings() const {
  std::vector<DoorSwing> out;
  const double end = impl_->frames.back().color - kFirstStamp;
  const double once = impl_->kept ? impl_->path->duration() : end;
  for (const MovingDoor& door : impl_->world->scene.moving_doors) {
    add_moves(door, out);

    // Each round repeats them, there and back.
    for (int round = 0; round * once < end; ++round) {
      for (const double start : door.starts) {
        for (const bool back : {false, true}) {
          const double at = round * once + start + (back ? door.swing + door.hold : 0.0);

          // Drawers move in metres, doors in radians.
          const double unit = door.drawer.empty() ? 1.0 : door.slide.norm();
          if (start < once && at < end)
            out.push_back({door.opening, door.drawer, kFirstStamp + at, kFirstStamp + at + door.swing,
                           unit * (back ? door.rest_rad : door.other_rad)});
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
