// SPDX-License-Identifier: BSD-3-Clause
#include <optional>
#include <utility>

#include "frame_images.hpp"
#include "layout.hpp"
#include "plumbline/sensor/rectify.hpp"

namespace plumbline::dataset {
namespace {

/// The frames of any recording on disk, of a bag or a film as of a folder: Layout::images knows which.
class FolderSource final : public FrameSource, public BodySource {
 public:
  FolderSource(std::string name, Layout layout, sensor::Camera camera, const sensor::Pinhole& rectified)
      : name_(std::move(name)),
        layout_(std::move(layout)),
        camera_(std::move(camera)),
        rectified_(rectified),
        rectifier_(camera_, rectified) {}

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] const std::string& format() const override { return layout_.format; }
  [[nodiscard]] const sensor::Camera& camera() const override { return camera_; }
  [[nodiscard]] std::size_t size() const override { return layout_.pairs.size(); }
  [[nodiscard]] RecordingNotes notes() const override {
    return {layout_.missing, doubt_, layout_.truth_is_odometry};
  }
  [[nodiscard]] PairInfo info(std::size_t index) const override { return layout_.pairs.at(index); }
  [[nodiscard]] std::optional<geometry::Trajectory> truth() const override { return layout_.truth; }
  [[nodiscard]] BodyReadings body_readings(double imu_after, double odometry_after,
                                           double until) const override {
    if (layout_.body == nullptr) return {};
    BodyReadings readings =
        readings_between(layout_.body->imu, layout_.body->odometry, imu_after, odometry_after, until);

    // The mount is fixed
    readings.body_from_camera = layout_.body->body_from_camera;
    return readings;
  }
  void set_doubt(std::string doubt) { doubt_ = std::move(doubt); }

  [[nodiscard]] std::unique_ptr<FrameSource> taken_by(const sensor::Camera& better) const override {
    Layout layout = layout_;
    if (auto again = layout_.images->opened_again()) layout.images = std::move(again);

    // The other camera may have another delay
    for (PairInfo& pair : layout.pairs) pair.depth_stamp += better.depth_delay_s - camera_.depth_delay_s;
    auto source = std::make_unique<FolderSource>(name_, std::move(layout), better, rectified_);
    source->set_doubt(doubt_);
    return source;
  }

  [[nodiscard]] core::Result<sensor::RgbdFrame> read(std::size_t index) const override {
    const PairInfo& pair = layout_.pairs.at(index);
    auto color = read_color(layout_, pair.color, camera_.color);
    if (!color) return tl::unexpected(color.error());

    auto depth = measured_depth(pair);
    if (!depth) return tl::unexpected(depth.error());

    // Each image may have its own camera
    std::optional<sensor::Rectifier> own;
    if (pair.camera >= 0) own.emplace(camera_of(pair), rectified_);
    const sensor::Rectifier& rectifier = own ? *own : rectifier_;
    sensor::RgbdFrame frame = rectified_frame(index, pair, *color, *depth, rectifier);

    // The recorder's odometry at the time of the frame
    if (layout_.gives_odometry && layout_.truth)
      frame.odometry = geometry::pose_at(*layout_.truth, pair.stamp, kNearestPose_s);
    return frame;
  }

  [[nodiscard]] core::Result<StoredPair> stored(std::size_t index) const override {
    const PairInfo& pair = layout_.pairs.at(index);
    if (pair.camera >= 0) {
      return core::usage_error(
          name_ + ": each image has its own camera, which a copy cannot describe; map the original");
    }

    // Colour of the camera's size
    auto color = stored_image(pair.color);
    if (!color) return tl::unexpected(color.error());
    std::string problem = color_problem(color->pixels, camera_.color, layout_.color_reduction);
    if (!problem.empty()) return core::input_error(color->name + ": " + problem);

    // Uncertain depth is not copied
    auto depth = layout_.confidence.empty() ? stored_image(pair.depth) : masked_depth(pair);
    if (!depth) return tl::unexpected(depth.error());
    problem = depth_problem(depth->pixels, depth_camera());
    if (!problem.empty()) return core::input_error(depth->name + ": " + problem);
    return StoredPair{std::move(*color), std::move(*depth)};
  }

 private:
  static constexpr double kNearestPose_s = 0.02;

  [[nodiscard]] const sensor::Pinhole& depth_camera() const {
    return camera_.depth ? *camera_.depth : camera_.color;
  }

  /// The camera of a pair, if each has its own (a lens that focuses): corrections found for the recording's
  /// camera are applied to it in proportion.
  [[nodiscard]] sensor::Camera camera_of(const PairInfo& pair) const {
    sensor::Camera camera = camera_;
    const sensor::Pinhole stored = layout_.frame_cameras.at(static_cast<std::size_t>(pair.camera));
    sensor::Pinhole color = stored.resized(rectified_.width, rectified_.height);
    color.fx *= camera_.color.fx / rectified_.fx;
    color.fy *= camera_.color.fy / rectified_.fy;
    color.cx += camera_.color.cx - rectified_.cx;
    color.cy += camera_.color.cy - rectified_.cy;
    camera.color = color;
    if (camera.depth) camera.depth = stored.resized(camera.depth->width, camera.depth->height);
    return camera;
  }

  [[nodiscard]] core::Result<StoredImage> stored_image(ImageId id) const {
    auto image = layout_.images->stored(id);
    if (!image) return image;
    image->linked_out = linked_out(id);
    image->name = layout_.images->describe(id);
    return image;
  }

  /// True if a link in the recording's folder leads out of it to an image's file, or to its film. The folder
  /// itself may be a link, and a list may name files elsewhere.
  [[nodiscard]] bool linked_out(ImageId id) const {
    const std::filesystem::path file = layout_.images->file(id);
    if (file.empty()) return false;
    const auto inside = [](const std::filesystem::path& path, const std::filesystem::path& folder) {
      const std::filesystem::path relative = path.lexically_relative(folder);
      return !relative.empty() && *relative.begin() != "..";
    };

    std::error_code problem;
    const auto named = std::filesystem::absolute(file, problem).lexically_normal();
    const auto folder = std::filesystem::absolute(layout_.folder, problem).lexically_normal();
    if (problem || !inside(named, folder)) return false;
    const auto real = std::filesystem::canonical(file, problem);
    return !problem && !inside(real, std::filesystem::canonical(layout_.folder, problem)) && !problem;
  }

  /// Depth without the pixels that the recorder's masks exclude.
  [[nodiscard]] core::Result<cv::Mat> measured_depth(const PairInfo& pair) const {
    auto depth = read_depth(layout_, pair.depth, depth_camera(), camera_.depth_scale);
    if (!depth || layout_.confidence.empty()) return depth;
    const auto mask = std::filesystem::path(layout_.confidence) / layout_.images->file(pair.depth).filename();
    if (auto masked = mask_depth(mask.string(), *depth); !masked) return tl::unexpected(masked.error());
    return depth;
  }

  /// A copy has no masks, so masked depth is removed from the images.
  [[nodiscard]] core::Result<StoredImage> masked_depth(const PairInfo& pair) const {
    auto depth = measured_depth(pair);
    if (!depth) return tl::unexpected(depth.error());
    return StoredImage{
        "", {}, std::move(*depth), linked_out(pair.depth), layout_.images->describe(pair.depth)};
  }

  std::string name_;
  std::string doubt_;
  Layout layout_;
  sensor::Camera camera_;
  sensor::Pinhole rectified_;  ///< pinhole of the rectified images
  sensor::Rectifier rectifier_;
};

}  // namespace

std::unique_ptr<FrameSource> make_folder_source(std::string name, Layout layout, sensor::Camera camera,
                                                std::string doubt) {
  // Rectified images keep the camera's pinhole
  const sensor::Pinhole rectified = camera.color;
  auto source =
      std::make_unique<FolderSource>(std::move(name), std::move(layout), std::move(camera), rectified);
  source->set_doubt(std::move(doubt));
  return source;
}

}  // namespace plumbline::dataset
