// SPDX-License-Identifier: BSD-3-Clause
#include "visits/revised_clouds.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "plumbline/mapping/registration/local_map_alignment.hpp"
#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

void RevisedClouds::apply(const View& view, cloud::Cloud& cloud) const {
  const auto found = removed.find(view);
  if (found == removed.end()) return;
  for (std::size_t i = 0; i < std::min(cloud.size(), found->second.size()); ++i) {
    if (found->second[i] != 0) cloud[i].x = cloud[i].y = cloud[i].z = std::numeric_limits<float>::quiet_NaN();
  }
  cloud.is_dense = false;
}

core::Result<maps::StoreCloud> RevisedClouds::stored(const maps::StoredViews& views, std::size_t view) const {
  const View name{views.keyframes[view], views.frames[view]};
  auto bytes = views.bytes(view);
  if (!bytes) return tl::unexpected<core::Error>(bytes.error());

  maps::StoreCloud result{name.first, name.second, nullptr, nullptr};

  // Most clouds lose no points and are copied as they are stored, without being decoded.
  if (removed.count(name) == 0) {
    auto surface = views.surface(view);
    if (!surface) return tl::unexpected<core::Error>(surface.error());
    if (*surface) result.surface = std::make_shared<maps::StoredSurface>(std::move(**surface));
    result.bytes = std::make_shared<std::vector<std::uint8_t>>(std::move(*bytes));
    return result;
  }

  const auto cloud = cloud::decode_cloud(bytes->data(), bytes->size());
  if (!cloud) return tl::unexpected<core::Error>(cloud.error());
  apply(name, **cloud);
  result.bytes = std::make_shared<std::vector<std::uint8_t>>(cloud::encode_cloud(**cloud));

  // Later runs align keyframes by their coarse surfaces, which must lack what is gone as well.
  if (name.first.valid()) {
    result.surface = std::make_shared<maps::StoredSurface>(
        maps::StoredSurface{kSurfaceVoxel_m, mapping::coarse_surface(**cloud, kSurfaceVoxel_m)});
  }
  return result;
}

}  // namespace plumbline::pipeline
