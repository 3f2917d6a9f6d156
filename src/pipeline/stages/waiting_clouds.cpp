// SPDX-License-Identifier: BSD-3-Clause
#include "stages/waiting_clouds.hpp"

#include <utility>

#include "plumbline/cloud/compact_cloud.hpp"
#include "plumbline/pipeline/stored_maps.hpp"

namespace plumbline::pipeline {

core::Result<WaitingClouds> WaitingClouds::create(const RunContext& context) {
  WaitingClouds clouds(context.stored_maps);
  if (clouds.maps_ != nullptr) return clouds;
  auto spool = cloud::CloudSpool::create(context.output_folder);
  if (!spool) return tl::unexpected<core::Error>(spool.error());
  clouds.spool_.emplace(std::move(*spool));
  return clouds;
}

core::Result<void> WaitingClouds::append(const std::vector<std::uint8_t>* compact, std::size_t frame) {
  if (spool_) {
    bytes_ += compact->size();
    return spool_->append(*compact);
  }
  frames_.push_back(frame);
  return {};
}

core::Result<cloud::CloudPtr> WaitingClouds::read(std::size_t place) const {
  if (spool_) return spool_->read(place);
  const std::size_t frame = frames_.at(place);
  const auto bytes = maps_->cloud_bytes(frame);
  if (!bytes) return tl::unexpected<core::Error>(bytes.error());
  auto cloud = cloud::decode_cloud(bytes->data(), bytes->size());
  if (!cloud) return tl::unexpected<core::Error>(maps_->damaged(maps_->clouds()[frame].robot, cloud.error()));
  return cloud;
}

}  // namespace plumbline::pipeline
