// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/input.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "plumbline/dataset/live.hpp"
#include "plumbline/dataset/selection.hpp"
#include "plumbline/synth/source.hpp"

namespace plumbline::pipeline {
namespace {

/// The frames of a source that have the given indices, numbered from 0.
class SelectedFrames : public dataset::FrameSource {
 public:
  SelectedFrames(std::unique_ptr<dataset::FrameSource> source, std::vector<std::size_t> indices)
      : source_(std::move(source)), indices_(std::move(indices)) {}

  [[nodiscard]] const std::string& name() const override { return source_->name(); }
  [[nodiscard]] const std::string& format() const override { return source_->format(); }
  [[nodiscard]] const sensor::Camera& camera() const override { return source_->camera(); }
  [[nodiscard]] std::size_t size() const override { return indices_.size(); }
  [[nodiscard]] dataset::PairInfo info(std::size_t index) const override {
    return source_->info(indices_.at(index));
  }
  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t index) const override {
    auto frame = source_->read(indices_.at(index));
    if (frame) frame->index = static_cast<std::int64_t>(index);
    return frame;
  }
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override { return source_->truth(); }
  [[nodiscard]] std::unique_ptr<FrameSource> taken_by(const sensor::Camera& better) const override {
    auto source = source_->taken_by(better);
    if (source == nullptr) return nullptr;
    return std::make_unique<SelectedFrames>(std::move(source), indices_);
  }

 private:
  std::unique_ptr<dataset::FrameSource> source_;
  std::vector<std::size_t> indices_;
};

/// The part of `source` that the options name. Error (kUsage): nothing lies there.
core::Result<std::unique_ptr<dataset::FrameSource>> select_frames(
    std::unique_ptr<dataset::FrameSource> source, const dataset::OpenOptions& options) {
  std::vector<double> stamps;
  for (std::size_t i = 0; i < source->size(); ++i) stamps.push_back(source->info(i).stamp);
  auto indices = dataset::selected_frames(source->name(), stamps, options);
  if (!indices) return tl::unexpected<core::Error>(indices.error());
  if (indices->size() == source->size()) return source;
  return std::make_unique<SelectedFrames>(std::move(source), std::move(*indices));
}

constexpr double kForever_s = 1e299;  // values of --for from here on mean no limit

core::Result<std::unique_ptr<dataset::FrameSource>> open_live_input(const std::string& address,
                                                                    dataset::OpenOptions options,
                                                                    core::Log& log) {
  if (!options.live.open) {
    return core::usage_error(
        fmt::format("{}: is live, but a recording is needed; record it while mapping: plumbline map "
                    "'{}' -o OUT --record take.mcap",
                    address, address));
  }
  auto stream = options.live.open(address, options.topics);
  if (!stream) return tl::unexpected(stream.error());
  return dataset::open_live(address, std::move(*stream), options, log);
}

}  // namespace

core::Result<std::unique_ptr<dataset::FrameSource>> open_input(const std::string& input,
                                                               const dataset::OpenOptions& options,
                                                               const std::filesystem::path& scenes_folder,
                                                               const core::Executor& executor,
                                                               core::Log& log) {
  if (dataset::is_live_address(input)) return open_live_input(input, options, log);

  // Options without effect are refused: silence would suggest that they were obeyed.
  if (!options.live.record.empty() || options.live.for_s < kForever_s ||
      options.live.most_waiting_bytes != dataset::kMostWaitingBytes) {
    return core::usage_error(fmt::format(
        "{}: is a recording; --record, --for and --max-memory are for live cameras (ros2://DOMAIN)", input));
  }

  if (!synth::is_synth_url(input)) return dataset::open_recording(input, options, log);

  // A generated world is rendered with its own camera; another one would contradict its images.
  if (!options.camera.empty()) {
    return core::usage_error(
        fmt::format("{}: has its own camera, which '{}' cannot replace; write the world to a folder "
                    "(plumbline synth), and map that with --camera",
                    input, options.camera));
  }

  // Recordings select their frames when they are opened, generated worlds do not.
  auto source = synth::open_synth(input, scenes_folder, executor, log);
  if (!source) return source;
  return select_frames(std::move(*source), options);
}

}  // namespace plumbline::pipeline
