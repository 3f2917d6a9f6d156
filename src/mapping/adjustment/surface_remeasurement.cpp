// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "plumbline/features/photometric.hpp"
#include "plumbline/geometry/velocity.hpp"
#include "plumbline/mapping/adjustment/map_recalibration.hpp"
#include "plumbline/mapping/registration/surface_edge.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

/// Measures the keyframes' surfaces again in their pictures.
class SurfaceReader {
 public:
  SurfaceReader(const sensor::Pinhole& camera, const std::vector<maps::FramePose>& frames,
                const PictureReader& read, const SurfaceMeasurement& how, const core::Executor& executor,
                maps::Map& map)
      : camera_(camera),
        path_(maps::trajectory(frames, map)),
        read_(read),
        how_(how),
        executor_(executor),
        map_(map) {
    for (const auto& [number, edge] : map.edges()) by_later_[std::max(edge.a, edge.b)].push_back(number);
  }

  /// Keyframes in order of time, a few at a time: an edge needs the samples of the earlier one and the images
  /// of the later one.
  void run() {
    constexpr std::size_t kAtOnce = 16;
    const std::vector<KeyframeId> ids = map_.keyframe_ids();
    for (std::size_t begin = 0; begin < ids.size(); begin += kAtOnce) {
      const std::vector<KeyframeId> some(
          ids.begin() + static_cast<std::ptrdiff_t>(begin),
          ids.begin() + static_cast<std::ptrdiff_t>(std::min(ids.size(), begin + kAtOnce)));

      // The pictures of one batch are read in parallel; its size bounds the memory that they take.
      std::vector<Picture> pictures(some.size());
      executor_.parallel_for(some.size(), [&](std::size_t i) { pictures[i] = picture_of(some[i]); });

      // Surfaces are replaced before edges are aligned, because an edge uses the
      // surface of its earlier keyframe.
      for (std::size_t i = 0; i < some.size(); ++i) {
        if (pictures[i].surface.empty()) continue;
        auto keyframe = std::make_shared<maps::Keyframe>(map_.keyframe(some[i]));
        keyframe->surface = std::move(pictures[i].surface);
        map_.replace_keyframe(std::move(keyframe));
        samples_[some[i]] = std::move(pictures[i].samples);
      }

      align(some, pictures);
    }
  }

 private:
  struct Picture {
    cv::Mat depth;
    Rigid3 depth_from_camera;
    std::shared_ptr<features::PhotometricImage> photometric;
    std::shared_ptr<const features::PhotometricSamples> samples;
    std::vector<maps::SurfaceSample> surface;
  };

  [[nodiscard]] Picture picture_of(KeyframeId id) const {
    Picture picture;
    const auto frame = read_(map_.keyframe(id).frame_index);
    if (!frame || frame->depth.empty()) return picture;

    picture.depth = frame->depth;
    const double late_s = frame->depth_stamp - frame->stamp;
    picture.depth_from_camera = geometry::exp_se3(late_s * geometry::velocity_at(path_, frame->stamp));
    picture.surface = tracking::sample_surface(frame->depth, camera_, how_.sampler);
    const Rigid3 camera_from_depth = picture.depth_from_camera.inverse();
    picture.surface = tracking::transformed(std::move(picture.surface), camera_from_depth);

    if (!how_.photometric || frame->gray.empty()) return picture;
    picture.photometric =
        std::make_shared<features::PhotometricImage>(features::make_photometric_image(frame->gray));
    picture.samples = std::make_shared<const features::PhotometricSamples>(
        features::sample_photometric(*picture.photometric, frame->depth, camera_, camera_from_depth));
    return picture;
  }

  void align(const std::vector<KeyframeId>& some, const std::vector<Picture>& pictures) {
    struct Task {
      std::uint64_t number = 0;
      const Picture* picture = nullptr;
      std::optional<maps::SurfaceEdge> found;
    };

    // An edge is measured at its later keyframe, whose images are in memory; the
    // earlier one has left its samples.
    std::vector<Task> tasks;
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (pictures[i].depth.empty()) continue;
      for (const std::uint64_t number : by_later_[some[i]]) tasks.push_back({number, &pictures[i], {}});
    }

    executor_.parallel_for(tasks.size(), [&](std::size_t i) {
      const maps::SurfaceEdge& edge = map_.edges().at(tasks[i].number);
      const Picture& of_b = *tasks[i].picture;
      const auto of_a = samples_.find(edge.a);
      const Rigid3 b_from_a = map_.camera_from_world(edge.b) * map_.camera_from_world(edge.a).inverse();
      tasks[i].found =
          align_surface_edge(map_.keyframe(edge.a), edge.b, of_b.depth, b_from_a, of_b.depth_from_camera,
                             camera_, {how_.min_overlap, how_.sampler.max_depth_m},
                             {of_a == samples_.end() ? nullptr : of_a->second.get(), of_b.photometric.get()});
    });

    // The map is changed only after the parallel part, which reads it. Edges that
    // cannot be aligned stay as they were.
    for (const Task& task : tasks) {
      if (task.found) map_.replace_edge(task.number, *task.found);
    }
  }

  sensor::Pinhole camera_;
  geometry::Trajectory path_;
  const PictureReader& read_;
  const SurfaceMeasurement& how_;
  const core::Executor& executor_;
  maps::Map& map_;
  std::map<KeyframeId, std::vector<std::uint64_t>> by_later_;  ///< numbers of the edges to earlier keyframes
  std::map<KeyframeId, std::shared_ptr<const features::PhotometricSamples>> samples_;
};

}  // namespace

void measure_surfaces_again(const sensor::Pinhole& camera, const std::vector<maps::FramePose>& frames,
                            const PictureReader& read, const SurfaceMeasurement& how,
                            const core::Executor& executor, maps::Map& map) {
  SurfaceReader(camera, frames, read, how, executor, map).run();
}

}  // namespace plumbline::mapping
