// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/cdr.hpp"

#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_xqos.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <memory>
#include <utility>

#include "ros.h"

namespace plumbline::dataset {
namespace {

constexpr std::size_t kEncapsulation = 4;  // bytes that say which kind of CDR follows
constexpr std::uint32_t kVersion1 = 1;
constexpr std::uint32_t kVersion2 = 2;
constexpr std::int64_t kNanoseconds = 1'000'000'000;

/// Type description for CycloneDDS's stream functions, from idlc's output; only the fields that they read are
/// set.
ddsi_sertype_default type_of(const dds_topic_descriptor_t& descriptor) {
  ddsi_sertype_default type{};
  type.type.size = descriptor.m_size;
  type.type.align = descriptor.m_align;
  type.type.flagset = descriptor.m_flagset;
  type.type.ops.nops = dds_stream_countops(descriptor.m_ops, descriptor.m_nkeys, descriptor.m_keys);
  type.type.ops.ops = const_cast<std::uint32_t*>(descriptor.m_ops);
  return type;
}

/// A sample in C, with all that belongs to it.
template <typename Sample, const dds_topic_descriptor_t& descriptor>
class CdrSample {
 public:
  CdrSample() = default;
  ~CdrSample() { dds_stream_free_sample(&sample_, descriptor.m_ops); }
  CdrSample(const CdrSample&) = delete;
  CdrSample& operator=(const CdrSample&) = delete;
  const Sample* operator->() const { return &sample_; }

  /// Reads a message from the beginning of the bytes. Returns "" or what is wrong.
  std::string read(const std::uint8_t* bytes, std::size_t size) {
    if (size < kEncapsulation) return "is too short for a message";
    if (size > std::numeric_limits<std::uint32_t>::max()) return "is too long for a message";
    const unsigned kind = static_cast<unsigned>(bytes[0]) << 8 | bytes[1];
    const bool second = kind == 6 || kind == 7;
    if (kind > 1 && !second) return "is in no kind of CDR that is read";
    const std::uint32_t version = second ? kVersion2 : kVersion1;
    const bool little_endian = (kind & 1U) != 0;

    // Checked, and its bytes swapped, in a copy that is aligned as the stream's own buffers are.
    const std::size_t length = size - kEncapsulation;
    const auto words = std::make_unique<std::uint64_t[]>(length / sizeof(std::uint64_t) + 1);
    std::memcpy(words.get(), bytes + kEncapsulation, length);
    const ddsi_sertype_default type = type_of(descriptor);
    std::uint32_t used = 0;
    if (!dds_stream_normalize(words.get(), static_cast<std::uint32_t>(length), !little_endian, version, &type,
                              false, &used))
      return "does not hold the message that its type promises";

    dds_istream_t stream;
    dds_istream_init(&stream, used, words.get(), version);
    dds_stream_read_sample(&stream, &sample_, &type);
    dds_istream_fini(&stream);
    return "";
  }

 private:
  Sample sample_{};
};

using ImageSample = CdrSample<sensor_msgs_msg_dds__Image_, sensor_msgs_msg_dds__Image__desc>;
using CompressedSample =
    CdrSample<sensor_msgs_msg_dds__CompressedImage_, sensor_msgs_msg_dds__CompressedImage__desc>;
using CameraInfoSample = CdrSample<sensor_msgs_msg_dds__CameraInfo_, sensor_msgs_msg_dds__CameraInfo__desc>;
using TransformsSample = CdrSample<tf2_msgs_msg_dds__TFMessage_, tf2_msgs_msg_dds__TFMessage__desc>;
using TransformSample = CdrSample<geometry_msgs_msg_dds__Transform_, geometry_msgs_msg_dds__Transform__desc>;
using TimeSample = CdrSample<builtin_interfaces_msg_dds__Time_, builtin_interfaces_msg_dds__Time__desc>;
using NumberSample = CdrSample<std_msgs_msg_dds__Float32_, std_msgs_msg_dds__Float32__desc>;

using ImuSample = CdrSample<sensor_msgs_msg_dds__Imu_, sensor_msgs_msg_dds__Imu__desc>;
using OdometrySample = CdrSample<nav_msgs_msg_dds__Odometry_, nav_msgs_msg_dds__Odometry__desc>;

std::string text_of(const char* text) { return text == nullptr ? "" : text; }

Bytes bytes_of(const std::uint8_t* from, std::uint32_t length) {
  return length == 0 ? Bytes() : Bytes(from, from + length);
}

std::int64_t nanoseconds_of(const builtin_interfaces_msg_dds__Time_& time) {
  return time.sec * kNanoseconds + time.nanosec;
}

MessageHeader header_of(const std_msgs_msg_dds__Header_& header) {
  return {nanoseconds_of(header.stamp), text_of(header.frame_id)};
}

geometry::Rigid3 rigid_of(const geometry_msgs_msg_dds__Transform_& transform) {
  const auto& q = transform.rotation;
  const auto& t = transform.translation;
  return {Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(t.x, t.y, t.z)};
}

bool is_motion(const geometry::Rigid3& motion) {
  return motion.rotation.allFinite() && motion.translation.allFinite();
}

DecodedMessage<std::int64_t> read_stamp(const std::uint8_t* head, std::size_t size) {
  TimeSample sample;
  if (std::string wrong = sample.read(head, size); !wrong.empty()) return tl::unexpected(std::move(wrong));
  return sample->sec * kNanoseconds + sample->nanosec;
}

/// sensor_msgs/Image; strings and pixels are copied.
DecodedMessage<ImageMessage> read_image_message(const Bytes& bytes) {
  ImageSample sample;
  if (std::string wrong = sample.read(bytes.data(), bytes.size()); !wrong.empty())
    return tl::unexpected(std::move(wrong));
  return ImageMessage{header_of(sample->header),
                      sample->height,
                      sample->width,
                      text_of(sample->encoding),
                      sample->is_bigendian != 0,
                      sample->step,
                      bytes_of(sample->data._buffer, sample->data._length)};
}

DecodedMessage<CompressedImageMessage> read_compressed_message(const Bytes& bytes) {
  CompressedSample sample;
  if (std::string wrong = sample.read(bytes.data(), bytes.size()); !wrong.empty())
    return tl::unexpected(std::move(wrong));
  return CompressedImageMessage{header_of(sample->header), text_of(sample->format),
                                bytes_of(sample->data._buffer, sample->data._length)};
}

/// sensor_msgs/CameraInfo; its rectification R is not used.
DecodedMessage<CameraInfoMessage> read_camera_info(const Bytes& bytes) {
  CameraInfoSample sample;
  if (std::string wrong = sample.read(bytes.data(), bytes.size()); !wrong.empty())
    return tl::unexpected(std::move(wrong));
  CameraInfoMessage message;
  message.header = header_of(sample->header);
  message.height = sample->height;
  message.width = sample->width;
  message.distortion_model = text_of(sample->distortion_model);
  message.d.assign(sample->d._buffer, sample->d._buffer + sample->d._length);
  std::copy(std::begin(sample->k), std::end(sample->k), message.k.begin());
  std::copy(std::begin(sample->p), std::end(sample->p), message.p.begin());

  message.binning_x = sample->binning_x;
  message.binning_y = sample->binning_y;
  const auto& roi = sample->roi;
  message.roi = {roi.x_offset, roi.y_offset, roi.height, roi.width, roi.do_rectify};
  return message;
}

DecodedMessage<std::vector<TransformMessage>> read_transforms(const Bytes& bytes) {
  TransformsSample sample;
  if (std::string wrong = sample.read(bytes.data(), bytes.size()); !wrong.empty())
    return tl::unexpected(std::move(wrong));
  std::vector<TransformMessage> transforms;
  for (std::uint32_t i = 0; i < sample->transforms._length; ++i) {
    const auto& from = sample->transforms._buffer[i];
    const geometry::Rigid3 motion = rigid_of(from.transform);

    // Transforms that are not finite are left out
    if (!is_motion(motion)) continue;
    transforms.push_back({text_of(from.header.frame_id), text_of(from.child_frame_id), motion,
                          nanoseconds_of(from.header.stamp)});
  }
  return transforms;
}

/// geometry_msgs/Transform, such as RealSense's extrinsics.
DecodedMessage<geometry::Rigid3> read_transform(const Bytes& bytes) {
  TransformSample sample;
  if (std::string wrong = sample.read(bytes.data(), bytes.size()); !wrong.empty())
    return tl::unexpected(std::move(wrong));
  geometry::Rigid3 motion = rigid_of({sample->translation, sample->rotation});
  if (!is_motion(motion)) return tl::unexpected<std::string>("is not a motion");
  return motion;
}

DecodedMessage<float> read_number(const Bytes& bytes) {
  NumberSample sample;
  if (std::string wrong = sample.read(bytes.data(), bytes.size()); !wrong.empty())
    return tl::unexpected(std::move(wrong));
  return sample->data;
}

DecodedMessage<ImuMessage> read_imu_message(const Bytes& bytes) {
  ImuSample sample;
  if (std::string wrong = sample.read(bytes.data(), bytes.size()); !wrong.empty())
    return tl::unexpected(std::move(wrong));
  const auto vector = [](const geometry_msgs_msg_dds__Vector3_& v) { return Eigen::Vector3d(v.x, v.y, v.z); };
  ImuMessage message{header_of(sample->header), vector(sample->angular_velocity),
                     vector(sample->linear_acceleration)};

  // The IMU must measure turn rates
  if (!message.turn_rate.allFinite())
    return tl::unexpected<std::string>("has a turn rate that is not finite");
  return message;
}

/// The pose of nav_msgs/Odometry; its velocity is not read.
DecodedMessage<TransformMessage> read_odometry(const Bytes& bytes) {
  OdometrySample sample;
  if (std::string wrong = sample.read(bytes.data(), bytes.size()); !wrong.empty())
    return tl::unexpected(std::move(wrong));
  const auto& p = sample->pose.pose.position;
  const auto& q = sample->pose.pose.orientation;
  TransformMessage message{text_of(sample->header.frame_id),
                           text_of(sample->child_frame_id),
                           {Eigen::Quaterniond(q.w, q.x, q.y, q.z), Eigen::Vector3d(p.x, p.y, p.z)},
                           nanoseconds_of(sample->header.stamp)};
  if (!is_motion(message.parent_from_child)) return tl::unexpected<std::string>("is not a motion");
  return message;
}

// Samples to be written borrow their texts; the stream functions only read them.
char* borrowed(const std::string& text) { return const_cast<char*>(text.c_str()); }

dds_sequence_octet borrowed(const Bytes& bytes) {
  dds_sequence_octet sequence{};
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(bytes.size());
  sequence._buffer = const_cast<std::uint8_t*>(bytes.data());
  return sequence;
}

std_msgs_msg_dds__Header_ header_from(std::int64_t stamp_ns, const std::string& frame_id) {
  std_msgs_msg_dds__Header_ header{};
  std::int64_t seconds = stamp_ns / kNanoseconds;
  std::int64_t rest = stamp_ns % kNanoseconds;

  // Nanoseconds of ROS are never negative
  if (rest < 0) {
    rest += kNanoseconds;
    --seconds;
  }
  header.stamp.sec = static_cast<std::int32_t>(seconds);
  header.stamp.nanosec = static_cast<std::uint32_t>(rest);
  header.frame_id = borrowed(frame_id);
  return header;
}

Bytes write_sample(const void* sample, const dds_topic_descriptor_t& descriptor) {
  const ddsi_sertype_default type = type_of(descriptor);
  dds_ostreamLE_t stream;
  dds_ostreamLE_init(&stream, 0, kVersion1);
  const bool written = dds_stream_write_sampleLE(&stream, sample, &type);

  // The kind of encoding precedes the message
  Bytes bytes(kEncapsulation + (written ? stream.x.m_index : 0U), 0);
  bytes[1] = 1;  // plain CDR, little endian
  if (written) std::memcpy(bytes.data() + kEncapsulation, stream.x.m_buffer, stream.x.m_index);
  dds_ostreamLE_fini(&stream);
  return bytes;
}

}  // namespace

const MessageDecoder& cdr_decoder() {
  static const MessageDecoder decoder{&read_stamp,       &read_image_message, &read_compressed_message,
                                      &read_camera_info, &read_transforms,    &read_transform,
                                      &read_number,      &read_imu_message,   &read_odometry};
  return decoder;
}

/// sensor_msgs/Image; strings and pixels are borrowed while it is written.
Bytes encode_cdr(const ImageMessage& message) {
  sensor_msgs_msg_dds__Image_ sample{};
  sample.header = header_from(message.header.stamp_ns, message.header.frame_id);
  sample.height = message.height;
  sample.width = message.width;
  sample.encoding = borrowed(message.encoding);
  sample.is_bigendian = message.big_endian ? 1 : 0;
  sample.step = message.step;
  sample.data = borrowed(message.data);
  return write_sample(&sample, sensor_msgs_msg_dds__Image__desc);
}

Bytes encode_cdr(const CompressedImageMessage& message) {
  sensor_msgs_msg_dds__CompressedImage_ sample{};
  sample.header = header_from(message.header.stamp_ns, message.header.frame_id);
  sample.format = borrowed(message.format);
  sample.data = borrowed(message.data);
  return write_sample(&sample, sensor_msgs_msg_dds__CompressedImage__desc);
}

Bytes encode_cdr(const CameraInfoMessage& message) {
  sensor_msgs_msg_dds__CameraInfo_ sample{};
  sample.header = header_from(message.header.stamp_ns, message.header.frame_id);
  sample.height = message.height;
  sample.width = message.width;
  sample.distortion_model = borrowed(message.distortion_model);

  // The encoder only reads the coefficients
  sample.d._length = sample.d._maximum = static_cast<std::uint32_t>(message.d.size());
  sample.d._buffer = const_cast<double*>(message.d.data());
  std::copy(message.k.begin(), message.k.end(), std::begin(sample.k));
  std::copy(message.p.begin(), message.p.end(), std::begin(sample.p));

  // R turns nothing: there is one camera
  sample.r[0] = sample.r[4] = sample.r[8] = 1.0;

  sample.binning_x = message.binning_x;
  sample.binning_y = message.binning_y;
  const RegionMessage& roi = message.roi;
  sample.roi = {roi.x_offset, roi.y_offset, roi.height, roi.width, roi.do_rectify};
  return write_sample(&sample, sensor_msgs_msg_dds__CameraInfo__desc);
}

/// tf2_msgs/TFMessage; all transforms have one stamp.
Bytes encode_cdr(const std::vector<TransformMessage>& transforms, std::int64_t stamp_ns) {
  std::vector<geometry_msgs_msg_dds__TransformStamped_> samples;
  for (const TransformMessage& transform : transforms) {
    geometry_msgs_msg_dds__TransformStamped_ sample{};
    sample.header = header_from(stamp_ns, transform.parent);
    sample.child_frame_id = borrowed(transform.child);
    const Eigen::Quaterniond q = transform.parent_from_child.quaternion();
    const Eigen::Vector3d& t = transform.parent_from_child.translation;
    sample.transform.rotation = {q.x(), q.y(), q.z(), q.w()};
    sample.transform.translation = {t.x(), t.y(), t.z()};
    samples.push_back(sample);
  }
  tf2_msgs_msg_dds__TFMessage_ message{};
  message.transforms._length = message.transforms._maximum = static_cast<std::uint32_t>(samples.size());
  message.transforms._buffer = samples.data();
  return write_sample(&message, tf2_msgs_msg_dds__TFMessage__desc);
}

/// nav_msgs/Path; each pose has its own stamp.
Bytes encode_cdr(const PathMessage& message) {
  std::vector<geometry_msgs_msg_dds__PoseStamped_> samples;
  samples.reserve(message.poses.size());
  for (const geometry::StampedPose& pose : message.poses) {
    geometry_msgs_msg_dds__PoseStamped_ sample{};
    sample.header = header_from(std::llround(pose.stamp * 1e9), message.header.frame_id);
    const Eigen::Quaterniond q = pose.world_from_camera.quaternion();
    const Eigen::Vector3d& t = pose.world_from_camera.translation;
    sample.pose.position = {t.x(), t.y(), t.z()};
    sample.pose.orientation = {q.x(), q.y(), q.z(), q.w()};
    samples.push_back(sample);
  }
  nav_msgs_msg_dds__Path_ path{};
  path.header = header_from(message.header.stamp_ns, message.header.frame_id);
  path.poses._length = path.poses._maximum = static_cast<std::uint32_t>(samples.size());
  path.poses._buffer = samples.data();
  return write_sample(&path, nav_msgs_msg_dds__Path__desc);
}

Bytes encode_cdr(const CloudMessage& message) {
  constexpr std::uint8_t kFloat32 = 7;
  constexpr std::uint32_t kPointBytes = 16;
  constexpr const char* kNames[] = {"x", "y", "z", "rgb"};

  // Four floats a point: position and packed colour
  std::array<sensor_msgs_msg_dds__PointField_, 4> fields{};
  for (std::uint32_t i = 0; i < fields.size(); ++i)
    fields[i] = {const_cast<char*>(kNames[i]), i * 4U, kFloat32, 1};

  // One row, because the points have no order
  sensor_msgs_msg_dds__PointCloud2_ cloud{};
  cloud.header = header_from(message.header.stamp_ns, message.header.frame_id);
  cloud.height = 1;
  cloud.width = message.points;

  // Fields and points are borrowed
  cloud.fields._length = cloud.fields._maximum = static_cast<std::uint32_t>(fields.size());
  cloud.fields._buffer = fields.data();
  cloud.point_step = kPointBytes;
  cloud.row_step = kPointBytes * message.points;
  cloud.data = borrowed(message.data);
  cloud.is_dense = true;
  return write_sample(&cloud, sensor_msgs_msg_dds__PointCloud2__desc);
}

/// nav_msgs/OccupancyGrid; its axes are those of the frame.
Bytes encode_grid(const GridMessage& message) {
  nav_msgs_msg_dds__OccupancyGrid_ grid{};
  grid.header = header_from(message.header.stamp_ns, message.header.frame_id);
  grid.info.map_load_time = grid.header.stamp;
  grid.info.resolution = static_cast<float>(message.resolution_m);
  grid.info.width = message.width;
  grid.info.height = message.height;
  grid.info.origin.position = {message.origin.x(), message.origin.y(), 0.0};
  grid.info.origin.orientation = {0.0, 0.0, 0.0, 1.0};
  grid.data = borrowed(message.data);
  return write_sample(&grid, nav_msgs_msg_dds__OccupancyGrid__desc);
}

/// A rectangle of cells that replaces those sent before.
Bytes encode_grid_update(const GridMessage& message) {
  map_msgs_msg_dds__OccupancyGridUpdate_ update{};
  update.header = header_from(message.header.stamp_ns, message.header.frame_id);
  update.x = message.x;
  update.y = message.y;
  update.width = message.width;
  update.height = message.height;
  update.data = borrowed(message.data);
  return write_sample(&update, map_msgs_msg_dds__OccupancyGridUpdate__desc);
}

Bytes encode_cdr(const PoseMessage& message) {
  geometry_msgs_msg_dds__PoseWithCovarianceStamped_ sample{};
  sample.header = header_from(message.header.stamp_ns, message.header.frame_id);
  const Eigen::Quaterniond q = message.pose.quaternion();
  const Eigen::Vector3d& t = message.pose.translation;
  sample.pose.pose.position = {t.x(), t.y(), t.z()};
  sample.pose.pose.orientation = {q.x(), q.y(), q.z(), q.w()};

  // Row by row: x, y, z, then turns about them.
  for (std::size_t i = 0; i < 6; ++i) {
    const double sigma = i < 3 ? message.sigma_position_m : message.sigma_rotation_rad;
    sample.pose.covariance[i * 7] = sigma * sigma;
  }
  return write_sample(&sample, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc);
}

const MessageEncoder& cdr_encoder() {
  static const MessageEncoder encoder{&encode_cdr,  &encode_cdr,         &encode_cdr,
                                      &encode_cdr,  &encode_cdr,         &encode_cdr,
                                      &encode_grid, &encode_grid_update, &encode_cdr};
  return encoder;
}

}  // namespace plumbline::dataset
