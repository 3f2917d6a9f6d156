// SPDX-License-Identifier: BSD-3-Clause
#include "results/waiting_clouds.hpp"

#include <fmt/format.h>

#include <set>
#include <system_error>
#include <utility>

namespace plumbline::pipeline {

bool keeps_clouds(const Graph& graph) {
  std::set<std::pair<std::size_t, std::size_t>> kept, wanted;
  for (const Node& node : graph.nodes) {
    if (!node.stage->keeps_map() && !node.stage->lays_clouds_down()) continue;
    for (std::size_t i = 0; i < node.inputs.size(); ++i) {
      if (!node.inputs[i] || !(node.type->inputs[i].type == keyframe_cloud_port())) continue;
      (node.stage->keeps_map() ? kept : wanted).insert({node.inputs[i]->node, node.inputs[i]->port});
    }
  }
  return kept.size() == 1 && kept == wanted;
}

core::Result<WaitingClouds> WaitingClouds::create(const RunContext& context) {
  WaitingClouds clouds;
  clouds.file_ = context.output_folder / maps::kStoreFile;
  if (context.store.keeps_clouds) return clouds;
  std::error_code ignored;
  for (int i = 1; std::filesystem::exists(clouds.file_, ignored) || i == 1; ++i) {
    clouds.file_ = context.output_folder / fmt::format(".clouds-{}.db", i);
  }
  auto writer = maps::StoreWriter::create(clouds.file_, {}, maps::StoreUse::kInOneGo);
  if (!writer) return tl::unexpected(writer.error());
  clouds.writer_.emplace(std::move(*writer));
  return clouds;
}

core::Result<void> WaitingClouds::append(const KeyframeCloud& cloud) {
  if (!cloud.id.valid() && !cloud.frame.valid()) return {};
  if (!cloud.id.valid()) arrivals_.emplace(cloud.frame, arrivals_.size() + 1);
  if (!writer_) return {};
  const auto waiting = store_cloud_of(cloud);
  return waiting ? writer_->add_cloud(*waiting) : tl::unexpected(waiting.error());
}

core::Result<const maps::StoreReader*> WaitingClouds::open() {
  auto reader = maps::StoreReader::open(file_);
  if (!reader) return tl::unexpected(reader.error());
  reader_.emplace(std::move(*reader));
  return &*reader_;
}

void WaitingClouds::clear() {
  reader_.reset();
  if (!writer_) return;
  writer_.reset();
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

}  // namespace plumbline::pipeline
