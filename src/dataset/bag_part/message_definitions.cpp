// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/message_definitions.hpp"

namespace plumbline::dataset {
namespace {

const char* const kSeparator =
    "================================================================================\nMSG: ";

const char* const kTime = "int32 sec\nuint32 nanosec\n";
const char* const kHeader = "builtin_interfaces/Time stamp\nstring frame_id\n";
const char* const kImage =
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
    "uint8[] data\n";
const char* const kCompressedImage = "std_msgs/Header header\nstring format\nuint8[] data\n";
const char* const kRegion =
    "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n";
const char* const kCameraInfo =
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
    "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
    "sensor_msgs/RegionOfInterest roi\n";
const char* const kTransforms = "geometry_msgs/TransformStamped[] transforms\n";
const char* const kTransformStamped =
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n";
const char* const kTransform = "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n";
const char* const kVector3 = "float64 x\nfloat64 y\nfloat64 z\n";
const char* const kQuaternion = "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";

const char* const kImu =
    "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n";
const char* const kOdometry =
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist\n";
const char* const kPoseCovariance = "geometry_msgs/Pose pose\nfloat64[36] covariance\n";
const char* const kPose = "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n";
const char* const kPoint = "float64 x\nfloat64 y\nfloat64 z\n";
const char* const kTwistCovariance = "geometry_msgs/Twist twist\nfloat64[36] covariance\n";
const char* const kTwist = "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n";

std::string part(const char* name, const char* text) { return std::string(kSeparator) + name + "\n" + text; }

std::string with_header(const char* text) {
  return text + part("std_msgs/Header", kHeader) + part("builtin_interfaces/Time", kTime);
}

}  // namespace

/// A definition contains those of all its parts; "" if the type is not written.
std::string message_definition(const std::string& type) {
  if (type == "sensor_msgs/msg/Image") return with_header(kImage);
  if (type == "sensor_msgs/msg/CompressedImage") return with_header(kCompressedImage);
  if (type == "sensor_msgs/msg/CameraInfo")
    return with_header(kCameraInfo) + part("sensor_msgs/RegionOfInterest", kRegion);
  if (type == "tf2_msgs/msg/TFMessage") {
    return with_header(kTransforms) + part("geometry_msgs/TransformStamped", kTransformStamped) +
           part("geometry_msgs/Transform", kTransform) + part("geometry_msgs/Vector3", kVector3) +
           part("geometry_msgs/Quaternion", kQuaternion);
  }

  if (type == "sensor_msgs/msg/Imu") {
    return with_header(kImu) + part("geometry_msgs/Quaternion", kQuaternion) +
           part("geometry_msgs/Vector3", kVector3);
  }

  if (type == "nav_msgs/msg/Odometry") {
    return with_header(kOdometry) + part("geometry_msgs/PoseWithCovariance", kPoseCovariance) +
           part("geometry_msgs/Pose", kPose) + part("geometry_msgs/Point", kPoint) +
           part("geometry_msgs/Quaternion", kQuaternion) +
           part("geometry_msgs/TwistWithCovariance", kTwistCovariance) + part("geometry_msgs/Twist", kTwist) +
           part("geometry_msgs/Vector3", kVector3);
  }
  return "";
}

}  // namespace plumbline::dataset
