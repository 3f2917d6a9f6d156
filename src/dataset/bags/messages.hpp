// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The ROS messages of recordings as plain structs, with the interfaces that read and write their bytes.
#include <array>
#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bags/bag_file.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::dataset {

struct MessageHeader {
  std::int64_t stamp_ns = 0;  ///< since 1970, or since whatever the camera's clock began
  std::string frame_id;
};

/// sensor_msgs/Image
struct ImageMessage {
  MessageHeader header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string encoding;
  bool big_endian = false;
  std::uint32_t step = 0;  ///< bytes of a row
  Bytes data;
};

/// sensor_msgs/CompressedImage
struct CompressedImageMessage {
  MessageHeader header;
  std::string format;
  Bytes data;
};

/// sensor_msgs/RegionOfInterest, in pixels of the camera's full image; all 0: the full image
struct RegionMessage {
  std::uint32_t x_offset = 0;
  std::uint32_t y_offset = 0;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  bool do_rectify = false;
};

/// sensor_msgs/CameraInfo: size, k and p are of the camera's full image. The accompanying image is
/// the region of interest, of which binning_x times binning_y pixels became one.
struct CameraInfoMessage {
  MessageHeader header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{};    ///< row by row
  std::array<double, 12> p{};   ///< projection matrix of the rectified image, row by row
  std::uint32_t binning_x = 0;  ///< 0 means 1
  std::uint32_t binning_y = 0;
  RegionMessage roi;
};

/// geometry_msgs/TransformStamped of a tf2_msgs/TFMessage; frames, pose and stamp of a nav_msgs/Odometry
struct TransformMessage {
  std::string parent;
  std::string child;
  geometry::Rigid3 parent_from_child;
  std::int64_t stamp_ns = 0;
};

/// sensor_msgs/Imu
struct ImuMessage {
  MessageHeader header;
  Eigen::Vector3d turn_rate;     ///< rad/s
  Eigen::Vector3d acceleration;  ///< m/s^2
};

/// nav_msgs/Path: all poses in the header's frame
struct PathMessage {
  MessageHeader header;
  std::vector<geometry::StampedPose> poses;
};

/// sensor_msgs/PointCloud2 with the fields x y z (float) and rgb (float whose bytes are 0 r g b)
struct CloudMessage {
  MessageHeader header;
  std::uint32_t points = 0;
  Bytes data;  ///< 16 bytes a point
};

/// nav_msgs/OccupancyGrid, or, without an origin and a resolution, map_msgs/OccupancyGridUpdate of a part
struct GridMessage {
  MessageHeader header;
  double resolution_m = 0.0;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< lower left corner
  std::int32_t x = 0;                                ///< first column of the part
  std::int32_t y = 0;                                ///< its first row
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  Bytes data;  ///< by row: 0 free, 100 occupied, 255 (-1) unknown
};

/// geometry_msgs/PoseWithCovarianceStamped
struct PoseMessage {
  MessageHeader header;
  geometry::Rigid3 pose;
  double sigma_position_m = 0.0;    ///< of each axis
  double sigma_rotation_rad = 0.0;  ///< about each axis
};

/// A message, or what is wrong with its bytes.
template <typename Message>
using DecodedMessage = tl::expected<Message, std::string>;

/// Reads messages of one encoding; every length is checked before memory is taken. Thread-safe.
struct MessageDecoder {
  /// Stamp of a message that begins with a std_msgs/Header, ns; the bytes may end anywhere after the header.
  DecodedMessage<std::int64_t> (*stamp)(const std::uint8_t* head, std::size_t size);
  DecodedMessage<ImageMessage> (*image)(const Bytes& bytes);
  DecodedMessage<CompressedImageMessage> (*compressed_image)(const Bytes& bytes);
  DecodedMessage<CameraInfoMessage> (*camera_info)(const Bytes& bytes);
  DecodedMessage<std::vector<TransformMessage>> (*transforms)(const Bytes& bytes);
  DecodedMessage<geometry::Rigid3> (*transform)(const Bytes& bytes);  ///< geometry_msgs/Transform
  DecodedMessage<float> (*number)(const Bytes& bytes);                ///< std_msgs/Float32
  DecodedMessage<ImuMessage> (*imu)(const Bytes& bytes);
  DecodedMessage<TransformMessage> (*odometry)(const Bytes& bytes);  ///< nav_msgs/Odometry
};

/// Encodes messages as CDR, little endian, with the four bytes of encapsulation in front.
struct MessageEncoder {
  Bytes (*image)(const ImageMessage& message);
  Bytes (*compressed_image)(const CompressedImageMessage& message);
  Bytes (*camera_info)(const CameraInfoMessage& message);
  /// tf2_msgs/TFMessage; all at `stamp_ns`.
  Bytes (*transforms)(const std::vector<TransformMessage>& transforms, std::int64_t stamp_ns);
  Bytes (*path)(const PathMessage& message);
  Bytes (*cloud)(const CloudMessage& message);
  Bytes (*grid)(const GridMessage& message);
  Bytes (*grid_update)(const GridMessage& message);
  Bytes (*pose)(const PoseMessage& message);
};

}  // namespace plumbline::dataset
