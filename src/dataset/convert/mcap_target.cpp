// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "bags/bag_parts.hpp"
#include "convert/copy_target.hpp"
#include "frame_images.hpp"

namespace plumbline::dataset {
namespace {

constexpr double kMillimetresOfMetre = 1000.0;
const char* const kColorTopic = "/camera/color";
const char* const kColorFrame = "camera_color_optical_frame";
const char* const kDepthFrame = "camera_depth_optical_frame";
const char* const kBodyFrame = "base_link";

/// A message's bytes as CDR, little endian.
class CdrText {
 public:
  CdrText(double stamp, const std::string& frame) {
    const std::int64_t ns = nanoseconds(stamp);
    number(static_cast<std::int32_t>(ns / 1000000000));
    number(static_cast<std::uint32_t>(ns % 1000000000));
    text(frame);
  }
  template <typename T>
  void number(T value) {
    while ((bytes_.size() - kHead) % sizeof value != 0) bytes_.push_back(0);
    const auto* from = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), from, from + sizeof value);
  }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.push_back(0);
  }
  void vector(const Eigen::Vector3d& v) {
    for (const double x : v) number(x);
  }
  void rotation(const Eigen::Quaterniond& q) {
    for (const double x : {q.x(), q.y(), q.z(), q.w()}) number(x);
  }
  void zeros(int count) {
    for (int i = 0; i < count; ++i) number(0.0);
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  static constexpr std::size_t kHead = 4;
  Bytes bytes_{0, 1, 0, 0};
};

/// No orientation is known: its covariance begins with -1. Other covariances of 0 are not known.
Bytes imu_message(const ImuReading& reading) {
  CdrText cdr(reading.stamp, kBodyFrame);
  cdr.rotation(Eigen::Quaterniond::Identity());
  cdr.number(-1.0);
  cdr.zeros(8);
  cdr.vector(reading.turn_rate);
  cdr.zeros(9);
  cdr.vector(reading.acceleration);
  cdr.zeros(9);
  return cdr.bytes();
}

/// nav_msgs/Odometry in CDR, with covariances of zero.
Bytes odometry_message(const OdometryReading& reading) {
  CdrText cdr(reading.stamp, "odom");
  cdr.text(kBodyFrame);
  cdr.vector(reading.odom_from_body.translation);
  cdr.rotation(reading.odom_from_body.quaternion());
  cdr.zeros(36);
  cdr.vector(reading.velocity);
  cdr.vector({0.0, 0.0, reading.turn_rate});
  cdr.zeros(36);
  return cdr.bytes();
}

std::string encoding_of_pixels(const cv::Mat& image) {
  switch (image.type()) {
    case CV_8UC1:
      return "mono8";
    case CV_8UC3:
      return "bgr8";
    case CV_8UC4:
      return "bgra8";
    case CV_16UC3:
      return "bgr16";
    case CV_16UC1:
      return "16UC1";
    case CV_32FC1:
      return "32FC1";
    default:
      return "";
  }
}

/// Row by row: OpenCV's images may have gaps between rows.
ImageMessage message_of(const cv::Mat& image, const MessageHeader& header, const std::string& encoding) {
  ImageMessage message;
  message.header = header;
  message.width = static_cast<std::uint32_t>(image.cols);
  message.height = static_cast<std::uint32_t>(image.rows);
  message.encoding = encoding;
  const std::size_t row = static_cast<std::size_t>(image.cols) * image.elemSize();
  message.step = static_cast<std::uint32_t>(row);
  message.data.reserve(row * static_cast<std::size_t>(image.rows));
  for (int v = 0; v < image.rows; ++v)
    message.data.insert(message.data.end(), image.ptr(v), image.ptr(v) + row);
  return message;
}

CameraInfoMessage info_of(const sensor::Pinhole& camera, const sensor::Lens& lens,
                          const MessageHeader& header) {
  CameraInfoMessage info;
  info.header = header;
  info.width = static_cast<std::uint32_t>(camera.width);
  info.height = static_cast<std::uint32_t>(camera.height);

  // The shortest model that holds all coefficients
  const bool fisheye = lens.model == sensor::LensModel::kEquidistant;
  const bool rational = !fisheye && (lens.k[5] != 0.0 || lens.k[6] != 0.0 || lens.k[7] != 0.0);
  info.distortion_model = fisheye ? "equidistant" : rational ? "rational_polynomial" : "plumb_bob";
  info.d.assign(lens.k.begin(), lens.k.begin() + (fisheye ? 4 : rational ? 8 : 5));
  info.k = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  info.p = {camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

class McapTarget final : public CopyTarget {
 public:
  McapTarget(std::unique_ptr<BagWriter> bag, sensor::Camera camera, bool standard_depth,
             const BodyReadings* body, core::Log& log)
      : bag_(std::move(bag)),
        camera_(std::move(camera)),
        standard_depth_(standard_depth),
        body_(body),
        log_(log) {
    // Depth that is not registered has another topic
    own_depth_camera_ = camera_.color_from_depth && camera_.depth;
    depth_topic_ = own_depth_camera_ ? "/camera/depth" : "/camera/aligned_depth_to_color";
  }

  core::Result<void> add(std::int64_t color_ns, std::int64_t depth_ns, const StoredPair& pair) override {
    if (!begun_) begin(color_ns);
    write_readings(color_ns);

    const MessageHeader header{color_ns, kColorFrame};
    const auto size = write_color(header, pair.color);
    if (!size) return tl::unexpected(size.error());

    // CameraInfo describes the stored size
    const sensor::Pinhole stored = camera_.color.resized(size->width, size->height);
    bag_->write(std::string(kColorTopic) + "/camera_info", info_of(stored, camera_.lens(), header));

    // Depth has the frame of its camera
    const MessageHeader depth_header{depth_ns, own_depth_camera_ ? kDepthFrame : kColorFrame};
    bag_->write(depth_topic_ + (own_depth_camera_ ? "/image_rect_raw" : "/image_raw"),
                depth_message(pair.depth.pixels, depth_header));
    bag_->write(depth_topic_ + "/camera_info", own_depth_camera_
                                                   ? info_of(*camera_.depth, camera_.depth_lens, depth_header)
                                                   : info_of(stored, camera_.lens(), depth_header));
    return {};
  }

  core::Result<void> finish(const std::optional<geometry::Trajectory>& /*truth*/) override {
    write_readings(std::numeric_limits<std::int64_t>::max());
    bag_->write_camera_yaml(sensor::to_yaml(camera_));
    return bag_->finish();
  }

 private:
  void begin(std::int64_t stamp_ns) {
    // Fixed transforms come before the first image
    begun_ = true;
    std::vector<TransformMessage> fixed;
    if (own_depth_camera_) fixed.push_back({kColorFrame, kDepthFrame, *camera_.color_from_depth});
    if (body_ != nullptr && body_->body_from_camera)
      fixed.push_back({kBodyFrame, kColorFrame, *body_->body_from_camera});
    if (!fixed.empty()) bag_->write("/tf_static", fixed, stamp_ns);
  }

  /// Writes what the body measured up to a time.
  void write_readings(std::int64_t until_ns) {
    if (body_ == nullptr) return;
    for (; imu_ < body_->imu.size() && nanoseconds(body_->imu[imu_].stamp) <= until_ns; ++imu_) {
      const ImuReading& reading = body_->imu[imu_];
      bag_->write_bytes("/imu", "sensor_msgs/msg/Imu", nanoseconds(reading.stamp), imu_message(reading));
    }
    for (; odometry_ < body_->odometry.size() && nanoseconds(body_->odometry[odometry_].stamp) <= until_ns;
         ++odometry_) {
      const OdometryReading& reading = body_->odometry[odometry_];
      bag_->write_bytes("/odom", "nav_msgs/msg/Odometry", nanoseconds(reading.stamp),
                        odometry_message(reading));
    }
  }

  /// Writes JPEG unchanged, everything else as pixels; returns the image's size.
  core::Result<cv::Size> write_color(const MessageHeader& header, const StoredImage& image) {
    cv::Mat pixels = image.pixels;
    if (pixels.type() == CV_16UC4)
      cv::cvtColor(pixels, pixels, cv::COLOR_BGRA2BGR);  // ROS has no name for it
    const std::string topic = std::string(kColorTopic) + "/image_raw";
    const std::string encoding = encoding_of_pixels(pixels);
    if (image.ending == ".jpg" || image.ending == ".jpeg") {
      bag_->write(topic + "/compressed",
                  CompressedImageMessage{header, "bgr8; jpeg compressed bgr8", image.bytes});
    } else if (encoding.empty()) {
      return core::input_error("a colour image in a format for which ROS has no name");
    } else {
      bag_->write(topic, message_of(pixels, header, encoding));
    }
    return pixels.size();
  }

  /// Millimetres unchanged; other units as metres, which are converted back without loss.
  ImageMessage depth_message(const cv::Mat& stored, const MessageHeader& header) {
    // ROS's depth is 16 bits or 32-bit floats
    cv::Mat depth = stored;
    if (depth.type() == CV_16UC3) cv::extractChannel(depth, depth, 0);
    if (depth.type() == CV_64FC1) depth.convertTo(depth, CV_32F);
    const bool others = standard_depth_ && camera_.depth_scale != kMillimetresOfMetre;

    // Units that other programs take for millimetres
    if (depth.type() == CV_16UC1 && (camera_.depth_scale == kFloatDepthScale || others)) {
      cv::Mat metres(depth.size(), CV_32FC1);

      // 65535 marks pixels without measurement
      for (int v = 0; v < depth.rows; ++v) {
        const auto* from = depth.ptr<std::uint16_t>(v);
        auto* to = metres.ptr<float>(v);
        for (int u = 0; u < depth.cols; ++u)
          to[u] =
              from[u] == 65535 ? 0.0F : static_cast<float>(from[u]) / static_cast<float>(camera_.depth_scale);
      }
      depth = metres;
    }

    // One warning, not one for each frame
    const bool odd = depth.type() == CV_16UC1 && camera_.depth_scale != kMillimetresOfMetre;
    if (odd && !told_scale_) {
      log_.warning(
          fmt::format("depth is written in its own units, {} per metre; other programs take 16UC1 for "
                      "millimetres",
                      camera_.depth_scale));
      told_scale_ = true;
    }

    return message_of(depth, header, encoding_of_pixels(depth));
  }

  std::unique_ptr<BagWriter> bag_;
  sensor::Camera camera_;
  bool standard_depth_;
  const BodyReadings* body_;
  std::size_t imu_ = 0, odometry_ = 0;  ///< next to be written
  core::Log& log_;
  std::string depth_topic_;
  bool own_depth_camera_ = false;
  bool begun_ = false;
  bool told_scale_ = false;
};

}  // namespace

core::Result<std::unique_ptr<CopyTarget>> make_mcap_target(const std::filesystem::path& file,
                                                           const sensor::Camera& camera,
                                                           const BodyReadings* body, core::Log& log) {
  const auto& part = core::part<BagReaders>();
  if (!part) return tl::unexpected(part.error());
  return make_message_target((*part)->create_mcap(file, kCopyMaker), camera, false, body, log);
}

std::unique_ptr<CopyTarget> make_message_target(std::unique_ptr<BagWriter> bag, const sensor::Camera& camera,
                                                bool standard_depth, const BodyReadings* body,
                                                core::Log& log) {
  return std::make_unique<McapTarget>(std::move(bag), camera, standard_depth, body, log);
}

}  // namespace plumbline::dataset
