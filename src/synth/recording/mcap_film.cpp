// SPDX-License-Identifier: BSD-3-Clause
#include "recording/mcap_film.hpp"

#include <algorithm>

#include "plumbline/dataset/convert.hpp"

namespace plumbline::synth {

namespace {

/// Frames that are read in order, rendered in batches.
class RenderedAhead final : public dataset::FrameSource {
 public:
  RenderedAhead(const SynthSource& source, const core::Executor& executor)
      : source_(source), executor_(executor) {}
  [[nodiscard]] const std::string& name() const override { return source_.name(); }
  [[nodiscard]] const std::string& format() const override { return source_.format(); }
  [[nodiscard]] const sensor::Camera& camera() const override { return source_.camera(); }
  [[nodiscard]] std::size_t size() const override { return source_.size(); }
  [[nodiscard]] dataset::PairInfo info(std::size_t index) const override { return source_.info(index); }
  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t index) const override {
    return source_.read(index);
  }
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override { return std::nullopt; }
  [[nodiscard]] core::Result<dataset::StoredPair> stored(std::size_t index) const override {
    if (index < first_ || index >= first_ + pairs_.size()) {
      // A batch is rendered in parallel.
      first_ = index;
      pairs_.clear();
      pairs_.resize(std::min(static_cast<std::size_t>(executor_.threads()) * 4, size() - index));
      executor_.parallel_for(pairs_.size(), [&](std::size_t i) { pairs_[i] = source_.stored(index + i); });
    }
    return pairs_[index - first_];
  }

 private:
  const SynthSource& source_;
  const core::Executor& executor_;
  mutable std::size_t first_ = 0;
  mutable std::vector<core::Result<dataset::StoredPair>> pairs_;
};

}  // namespace

core::Result<std::size_t> write_mcap(const RecordingJob& job, const std::filesystem::path& file,
                                     const dataset::BodyReadings& body) {
  if (job.run.stop.stop_requested()) return std::size_t{0};
  dataset::ConvertOptions options;
  options.body = &body;
  std::size_t done = 0;

  // A stopped file holds at least one frame.
  options.stop = [&] { return done > 0 && job.run.stop.stop_requested(); };
  options.progress = [&](std::size_t frames) {
    done = frames;
    if (job.progress) job.progress(frames, job.source.size());
  };

  const RenderedAhead ahead(job.source, job.run.executor);
  const auto summary = dataset::convert_recording(ahead, file, options, job.run.log);
  if (!summary) return tl::unexpected<core::Error>(summary.error());
  return summary->written;
}

}  // namespace plumbline::synth
