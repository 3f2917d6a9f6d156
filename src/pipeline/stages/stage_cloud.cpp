// SPDX-License-Identifier: BSD-3-Clause
// cloud: the filtered cloud of every keyframe.
#include <algorithm>
#include <atomic>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

#include "options/chain_option.hpp"
#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "plumbline/cloud/fusion/free_space.hpp"
#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/mapping/registration/local_map_alignment.hpp"
#include "plumbline/pipeline/observer.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

/// Numbers of points that were measured, and that each step left out; frames may be counted in parallel.
class LeftOut {
 public:
  void start(std::size_t filters) { by_filter_ = std::vector<std::atomic<std::size_t>>(filters); }
  void count_measured(const cv::Mat& depth, const cloud::KeyframeCloudOptions& options) {
    const auto least = static_cast<float>(options.min_depth_m);
    const auto most = static_cast<float>(options.max_depth_m);
    std::size_t measured = 0;
    std::size_t within = 0;
    const int stride = options.stride(depth.cols);
    for (int v = 0; v < depth.rows; v += stride) {
      const float* row = depth.ptr<float>(v);
      for (int u = 0; u < depth.cols; u += stride) {
        measured += row[u] > 0.0F ? 1U : 0U;
        within += row[u] >= least && row[u] <= most ? 1U : 0U;
      }
    }
    measured_ += measured;
    by_depth_ += measured - within;
  }
  void count_filtered(const std::vector<cloud::FilterReport>& reports) {
    for (std::size_t i = 0; i < std::min(reports.size(), by_filter_.size()); ++i) {
      const cloud::FilterReport& report = reports[i];
      by_filter_[i] += report.points_in - std::min(report.points_in, report.points_out);
    }
  }
  void report(const cloud::FilterChain& chain, Json& cloud) const {
    if (measured_ == 0) return;
    cloud["measured"] = measured_.load();
    std::vector<std::pair<std::string, std::size_t>> left_out{{"depth_limits", by_depth_.load()}};
    const std::vector<std::string> types = chain.types();
    for (std::size_t i = 0; i < by_filter_.size(); ++i) left_out.emplace_back(types[i], by_filter_[i].load());
    cloud["left_out"] = left_out_section(left_out);
  }

 private:
  std::atomic<std::size_t> measured_{0};
  std::atomic<std::size_t> by_depth_{0};
  std::vector<std::atomic<std::size_t>> by_filter_;
};

class CloudStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.integer("intermediate_every", intermediate_every_, {0, 100000}, "",
                  "Also make a cloud of every N-th frame between keyframes, and of the last; 0: of none");
    table.integer("free_space_every", free_space_every_, {0, 100000}, "",
                  "Use every N-th frame without a cloud to test free space; 0: none");
    filters_.declare(table, "Filter chain for the cloud of each keyframe; empty: none");
  }
  void check(const CheckContext& context, const core::ConfigMark& /*mark*/, const std::string& path,
             core::ConfigProblems& problems) override {
    filters_.check(context, path, problems);
  }
  [[nodiscard]] std::vector<std::string> files() const override { return filters_.files(); }
  core::Result<void> start(const RunContext& context) override {
    recordings_ = context.input.recordings;
    observer_ = context.hooks.observer;
    stop_ = context.stop;
    left_out_.start(filters_.chain().size());
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto track = io.input<TrackedFrame>("track");
    const std::int32_t robot = recordings_->robot_of(io.frame());
    const std::size_t number = recordings_->frame_of(io.frame());

    // The view of a camera that stands still is known after its first second.
    if (track->still && !track->keyframe.valid()) return {};

    // The last frame may show surface that no other frame does, if the camera was still moving.
    const bool gives_cloud =
        track->keyframe.valid() ||
        (intermediate_every_ > 0 && (number % static_cast<std::size_t>(intermediate_every_) == 0 ||
                                     recordings_->is_last(io.frame(), stop_)));

    const bool gives_view =
        free_space_every_ > 0 && number % static_cast<std::size_t>(free_space_every_) == 0;
    if (!gives_cloud && !gives_view) return {};

    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const sensor::Pinhole& camera = recordings_->robot(robot).camera.color;
    core::Result<cloud::CloudPtr> made =
        gives_cloud ? filtered(*frame, camera, track->keyframe)
                    : cloud::depth_view(*frame, camera, options_.min_depth_m, options_.max_depth_m);
    if (!made) return tl::unexpected(made.error());

    cloud::set_sensor_pose(**made, track->depth_from_camera.inverse());
    if (observer_ != nullptr && track->keyframe.valid() && track->map_from_camera) {
      observer_->added(robot, track->stamp, *track->map_from_camera * track->depth_from_camera.inverse(),
                       **made);
    }

    auto result = std::make_shared<KeyframeCloud>();
    result->id = track->keyframe;
    result->frame = track->frame;
    result->stamp = track->stamp;
    result->compact = std::make_shared<std::vector<std::uint8_t>>(cloud::encode_cloud(**made));

    if (result->id.valid()) {
      result->surface = std::make_shared<maps::StoredSurface>(
          maps::StoredSurface{kSurfaceVoxel_m, mapping::coarse_surface(**made, kSurfaceVoxel_m)});
    }

    result->cloud = std::move(*made);
    io.output<KeyframeCloud>("cloud", result);
    return {};
  }
  void report(Json& summary) const override { left_out_.report(filters_.chain(), summary["cloud"]); }

 private:
  core::Result<cloud::CloudPtr> filtered(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera,
                                         core::KeyframeId keyframe) {
    cloud::FilterContext context;
    context.viewpoint = Eigen::Vector3f::Zero();
    context.run = std::to_string(keyframe.index);
    std::vector<cloud::FilterReport> reports;
    auto cloud = filters_.chain().apply(cloud::organised_cloud(frame, camera, options_), context, &reports);
    left_out_.count_measured(frame.depth, options_);
    left_out_.count_filtered(reports);
    return cloud;
  }

  cloud::KeyframeCloudOptions options_;
  int intermediate_every_ = 10;
  int free_space_every_ = 3;
  ChainOption filters_{"filters/keyframe.yaml"};
  LeftOut left_out_;
  const RobotRecordings* recordings_ = nullptr;
  RunObserver* observer_ = nullptr;
  core::StopToken stop_;
};

}  // namespace

StageType cloud_stage() {
  return stage_type<CloudStage>(
      "cloud", "Turns a keyframe's depth into a filtered cloud with colour and normals", Mode::kStateless,
      {{"frame", frame_port()}, {"track", track_port()}}, {{"cloud", keyframe_cloud_port()}});
}

}  // namespace plumbline::pipeline
