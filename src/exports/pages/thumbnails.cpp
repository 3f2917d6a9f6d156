// SPDX-License-Identifier: BSD-3-Clause
#include "pages/thumbnails.hpp"

#include <opencv2/core.hpp>

#include "plumbline/dataset/jpeg.hpp"
#include "source/pictures.hpp"

namespace plumbline::exports {
namespace {

/// Adds the pictures that the store keeps; true: all are there.
bool add_stored(const MapSource& source, const std::vector<ExportPose>& poses,
                std::vector<viewer::Keyframe>& keyframes) {
  const auto store = source.store("pictures of keyframes");
  if (!store) return false;
  bool all = true;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    if (const auto picture = (*store)->reader().small_picture(poses[i].keyframe))
      keyframes[i].jpeg.assign(picture->begin(), picture->end());
    all = all && !keyframes[i].jpeg.empty();
  }
  return all;
}

}  // namespace

/// Adds small pictures of keyframes from the store, else from the recording.
void add_thumbnails(const MapSource& source, const std::vector<ExportPose>& poses, MapView& view) {
  std::vector<viewer::Keyframe>& keyframes = view.scene.keyframes;
  if (!source.has_store() || add_stored(source, poses, keyframes) || !source.request().open) return;

  // The store lacks some pictures
  const auto pictures = Pictures::open(source);
  if (!pictures) {
    view.notes.push_back("without pictures of keyframes: " + pictures.error().message);
    return;
  }

  // Keyframes whose picture is still missing
  source.executor().parallel_for(keyframes.size(), [&](std::size_t i) {
    if (!keyframes[i].jpeg.empty()) return;
    const auto frame = pictures->find(keyframes[i].robot, keyframes[i].stamp);
    if (!frame) return;
    const auto picture = pictures->read(keyframes[i].robot, *frame);
    if (!picture) return;
    const std::vector<std::uint8_t> small = dataset::encode_small_jpeg(picture->color);
    keyframes[i].jpeg.assign(small.begin(), small.end());
  });
}

}  // namespace plumbline::exports
