// SPDX-License-Identifier: BSD-3-Clause
#include "live/live_source.hpp"

#include <utility>

#include "frame_images.hpp"

namespace plumbline::dataset {
namespace {

class LiveSource final : public LiveFrameSource, public BodySource {
 public:
  LiveSource(std::shared_ptr<LiveCamera> live, sensor::Camera camera, const sensor::Pinhole& rectified,
             std::vector<double> delays)
      : live_(std::move(live)),
        queue_(*live_->queue),
        camera_(std::move(camera)),
        rectified_(rectified),
        rectifier_(camera_, rectified),
        delays_(std::move(delays)) {}

  [[nodiscard]] const std::string& name() const override { return live_->name; }
  [[nodiscard]] const std::string& format() const override { return live_->layout.format; }
  [[nodiscard]] const sensor::Camera& camera() const override { return camera_; }
  [[nodiscard]] RecordingNotes notes() const override { return {0, live_->doubt}; }
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override { return std::nullopt; }
  [[nodiscard]] std::size_t size() const override { return queue_.size(); }

  [[nodiscard]] PairInfo info(std::size_t index) const override {
    PairInfo pair = queue_.info(index);
    // One by one as for recordings: the sum is the same to the last digit
    for (const double delay : delays_) pair.depth_stamp += delay;
    return pair;
  }

  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t index) const override {
    const PairInfo pair = info(index);
    auto color = read_color(live_->layout, pair.color, camera_.color);
    if (!color) return tl::unexpected(color.error());
    auto depth = read_depth(live_->layout, pair.depth, camera_.depth ? *camera_.depth : camera_.color,
                            camera_.depth_scale);
    if (!depth) return tl::unexpected(depth.error());

    // Tracking uses the odometry of the same moment
    sensor::RgbdFrame frame = rectified_frame(index, pair, *color, *depth, rectifier_);
    frame.odometry = queue_.odometry(index);
    return frame;
  }

  [[nodiscard]] std::unique_ptr<FrameSource> taken_by(const sensor::Camera& better) const override {
    std::vector<double> delays = delays_;
    delays.push_back(better.depth_delay_s - camera_.depth_delay_s);
    return std::make_unique<LiveSource>(live_, better, rectified_, std::move(delays));
  }

  [[nodiscard]] bool decided(std::size_t index) const override { return queue_.decided(index + live_->lag); }
  void wait_for(std::size_t index, std::chrono::milliseconds most) const override {
    queue_.wait_for(index + live_->lag, most);
  }
  [[nodiscard]] bool is_last(std::size_t index, const core::StopToken& stop) const override {
    return queue_.is_last(index, stop);
  }
  [[nodiscard]] bool given_up() const override { return queue_.given_up(); }
  void hand_out(std::size_t index) override { queue_.hand_out(index); }
  void keep(std::size_t index) override { queue_.keep(index); }
  void release(std::size_t index) override { queue_.release(index); }
  void keep_in(const std::filesystem::path& folder) override { queue_.keep_in(folder); }

  [[nodiscard]] LiveReport report() const override {
    LiveReport report = live_->stream ? live_->stream->counts() : LiveReport();

    // The stream counts losses, the queue taken frames
    const LiveReport taken = queue_.report();
    report.taken = taken.taken;
    report.kept = taken.kept;
    report.kept_bytes = taken.kept_bytes;
    return report;
  }
  [[nodiscard]] core::Result<void> finish() override {
    return live_->stream ? live_->stream->finish() : core::Result<void>();
  }

  [[nodiscard]] BodyReadings body_readings(double imu_after, double odometry_after,
                                           double until) const override {
    if (!live_->stream) return {};
    BodyReadings readings = live_->stream->body_readings(imu_after, odometry_after, until);

    // The mount belongs to the frame that odometry moves
    const auto known = live_->body_from_camera.find(live_->stream->body_frame());
    if (known != live_->body_from_camera.end()) readings.body_from_camera = known->second;
    return readings;
  }

 private:
  std::shared_ptr<LiveCamera> live_;
  LiveQueue& queue_;
  sensor::Camera camera_;
  sensor::Pinhole rectified_;  ///< pinhole of the rectified images
  sensor::Rectifier rectifier_;
  std::vector<double> delays_;  ///< added to the stamps of depth
};

}  // namespace

std::unique_ptr<LiveFrameSource> make_live_source(std::shared_ptr<LiveCamera> live,
                                                  const sensor::Camera& camera) {
  return std::make_unique<LiveSource>(std::move(live), camera, camera.color,
                                      std::vector<double>{camera.depth_delay_s});
}

}  // namespace plumbline::dataset
