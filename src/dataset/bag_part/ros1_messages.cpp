// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/ros1_messages.hpp"

#include <array>
#include <cstring>
#include <utility>

namespace plumbline::dataset {
namespace {

constexpr std::int64_t kNanosecondsOfSecond = 1'000'000'000;

/// Reads fields one after another; after the first incomplete one all are 0 or empty.
class Ros1Fields {
 public:
  Ros1Fields(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  explicit Ros1Fields(const Bytes& bytes) : Ros1Fields(bytes.data(), bytes.size()) {}

  template <typename Number>
  Number number() {
    Number value{};
    if (const std::uint8_t* from = take(sizeof(Number))) std::memcpy(&value, from, sizeof(Number));
    return value;
  }
  std::string text() {
    const auto length = number<std::uint32_t>();
    const std::uint8_t* from = take(length);
    return from == nullptr ? "" : std::string(reinterpret_cast<const char*>(from), length);
  }
  Bytes bytes() {
    const auto length = number<std::uint32_t>();
    const std::uint8_t* from = take(length);
    return from == nullptr ? Bytes() : Bytes(from, from + length);
  }
  template <typename List>
  void numbers(List& list) {
    for (double& value : list) value = number<double>();
  }
  MessageHeader header() {
    MessageHeader header;
    number<std::uint32_t>();  // sequence number
    header.stamp_ns = time();
    header.frame_id = text();
    return header;
  }
  std::int64_t time() {
    const auto seconds = number<std::uint32_t>();
    return seconds * kNanosecondsOfSecond + number<std::uint32_t>();
  }
  geometry::Rigid3 transform() {
    std::array<double, 7> v{};
    numbers(v);
    return {Eigen::Quaterniond(v[6], v[3], v[4], v[5]), Eigen::Vector3d(v[0], v[1], v[2])};
  }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::size_t left() const { return left_; }

 private:
  const std::uint8_t* take(std::size_t count) {
    // Nothing is read after the first missing byte
    good_ = good_ && count <= left_;
    if (!good_) return nullptr;
    const std::uint8_t* from = data_;
    data_ += count;
    left_ -= count;
    return from;
  }

  const std::uint8_t* data_;
  std::size_t left_;
  bool good_ = true;
};

template <typename Message>
DecodedMessage<Message> whole(const Ros1Fields& fields, Message message) {
  if (fields.good()) return message;
  return tl::unexpected<std::string>("does not hold the message that its type promises");
}

bool is_finite(const geometry::Rigid3& motion) {
  return motion.rotation.allFinite() && motion.translation.allFinite();
}

DecodedMessage<std::int64_t> ros1_stamp(const std::uint8_t* head, std::size_t size) {
  Ros1Fields fields(head, size);
  fields.number<std::uint32_t>();
  const std::int64_t stamp = fields.time();
  return whole(fields, stamp);
}

/// sensor_msgs/Image in ROS 1's order of fields.
DecodedMessage<ImageMessage> ros1_image(const Bytes& bytes) {
  Ros1Fields fields(bytes);
  ImageMessage message;
  message.header = fields.header();
  message.height = fields.number<std::uint32_t>();
  message.width = fields.number<std::uint32_t>();
  message.encoding = fields.text();
  message.big_endian = fields.number<std::uint8_t>() != 0;
  message.step = fields.number<std::uint32_t>();
  message.data = fields.bytes();
  return whole(fields, std::move(message));
}

/// sensor_msgs/CompressedImage in ROS 1's order of fields.
DecodedMessage<CompressedImageMessage> ros1_compressed_image(const Bytes& bytes) {
  Ros1Fields fields(bytes);
  CompressedImageMessage message;
  message.header = fields.header();
  message.format = fields.text();
  message.data = fields.bytes();
  return whole(fields, std::move(message));
}

DecodedMessage<CameraInfoMessage> ros1_camera_info(const Bytes& bytes) {
  Ros1Fields fields(bytes);
  CameraInfoMessage message;
  message.header = fields.header();
  message.height = fields.number<std::uint32_t>();
  message.width = fields.number<std::uint32_t>();
  message.distortion_model = fields.text();

  // A damaged count must not allocate memory
  const auto coefficients = fields.number<std::uint32_t>();
  if (coefficients > fields.left() / sizeof(double))
    return tl::unexpected<std::string>("has more coefficients than bytes");
  message.d.resize(coefficients);
  fields.numbers(message.d);
  fields.numbers(message.k);

  // R stands between K and P and is not used
  std::array<double, 9> rectification{};
  fields.numbers(rectification);
  fields.numbers(message.p);

  // Binning and region of interest come last
  message.binning_x = fields.number<std::uint32_t>();
  message.binning_y = fields.number<std::uint32_t>();
  message.roi.x_offset = fields.number<std::uint32_t>();
  message.roi.y_offset = fields.number<std::uint32_t>();
  message.roi.height = fields.number<std::uint32_t>();
  message.roi.width = fields.number<std::uint32_t>();
  message.roi.do_rectify = fields.number<std::uint8_t>() != 0;
  return whole(fields, std::move(message));
}

DecodedMessage<std::vector<TransformMessage>> ros1_transforms(const Bytes& bytes) {
  Ros1Fields fields(bytes);
  std::vector<TransformMessage> transforms;
  for (auto count = fields.number<std::uint32_t>(); count > 0 && fields.good(); --count) {
    TransformMessage transform;
    MessageHeader header = fields.header();
    transform.parent = std::move(header.frame_id);
    transform.stamp_ns = header.stamp_ns;
    transform.child = fields.text();
    transform.parent_from_child = fields.transform();

    // Transforms that are not finite are left out
    if (fields.good() && is_finite(transform.parent_from_child)) transforms.push_back(std::move(transform));
  }
  return whole(fields, std::move(transforms));
}

DecodedMessage<geometry::Rigid3> ros1_transform(const Bytes& bytes) {
  Ros1Fields fields(bytes);
  const geometry::Rigid3 motion = fields.transform();
  if (!is_finite(motion)) return tl::unexpected<std::string>("is not a motion");
  return whole(fields, motion);
}

DecodedMessage<float> ros1_number(const Bytes& bytes) {
  Ros1Fields fields(bytes);
  const auto value = fields.number<float>();
  return whole(fields, value);
}

DecodedMessage<ImuMessage> ros1_imu(const Bytes& bytes) {
  Ros1Fields fields(bytes);
  ImuMessage message;
  message.header = fields.header();
  std::array<double, 37> v{};  // orientation, turn rate, acceleration, each with its covariance
  fields.numbers(v);
  message.turn_rate = {v[13], v[14], v[15]};
  message.acceleration = {v[25], v[26], v[27]};

  // The IMU must measure turn rates
  if (!message.turn_rate.allFinite())
    return tl::unexpected<std::string>("has a turn rate that is not finite");
  return whole(fields, std::move(message));
}

/// The pose of nav_msgs/Odometry; its velocity is not read.
DecodedMessage<TransformMessage> ros1_odometry(const Bytes& bytes) {
  Ros1Fields fields(bytes);
  TransformMessage message;
  MessageHeader header = fields.header();
  message.parent = std::move(header.frame_id);
  message.stamp_ns = header.stamp_ns;
  message.child = fields.text();
  message.parent_from_child = fields.transform();
  if (!is_finite(message.parent_from_child)) return tl::unexpected<std::string>("is not a motion");
  return whole(fields, std::move(message));
}

}  // namespace

const MessageDecoder& ros1_decoder() {
  static const MessageDecoder decoder{&ros1_stamp,       &ros1_image,      &ros1_compressed_image,
                                      &ros1_camera_info, &ros1_transforms, &ros1_transform,
                                      &ros1_number,      &ros1_imu,        &ros1_odometry};
  return decoder;
}

}  // namespace plumbline::dataset
