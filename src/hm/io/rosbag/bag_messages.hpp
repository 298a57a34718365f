#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/geometry/trajectory.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_scan.hpp"

/// ROS 1 message serialisation: little endian, fields in the order of their definition, strings and lists
/// preceded by a 32-bit length. Every parser returns nothing when there are too few or too many bytes, or a
/// length is impossible.
namespace hm::detail {

using MessageBytes = std::span<const std::uint8_t>;

/// Header at the start of all these messages; holds their stamp.
struct MessageHeader {
  Time stamp;
  std::string frame_id;
};

/// Scan as written by the driver; its ranges are not yet validated.
struct ScanMessage {
  MessageHeader header;
  LaserScan scan;
};
std::optional<ScanMessage> parse_laser_scan(MessageBytes bytes);

struct ImuMessage {
  MessageHeader header;
  ImuSample sample;
};
/// Parses sensor_msgs/Imu; the orientation is absent when its covariance starts with -1, as the definition
/// says.
std::optional<ImuMessage> parse_imu(MessageBytes bytes);

struct RangeMessage {
  MessageHeader header;
  RangeReading reading;
};
std::optional<RangeMessage> parse_range(MessageBytes bytes);

/// Pose as written; the quaternion (x, y, z, w) is not yet validated.
struct PoseMessage {
  MessageHeader header;
  std::string child_frame_id;  ///< of odometry and transforms
  Vec3 position_m = Vec3::Zero();
  Eigen::Vector4d quaternion = Eigen::Vector4d::Zero();
};
std::optional<PoseMessage> parse_odometry(MessageBytes bytes);
std::optional<PoseMessage> parse_pose(MessageBytes bytes);

/// Transform between two frames as written (`header.frame_id`: the parent): parent from child; the quaternion
/// (x, y, z, w) is not yet validated.
using TransformMessage = PoseMessage;
/// Parses tf2_msgs/TFMessage, which is tf/tfMessage too.
std::optional<std::vector<TransformMessage>> parse_transforms(MessageBytes bytes);

/// Rotation matrix of a quaternion (x, y, z, w) of nearly unit length; nothing if it is not.
std::optional<Mat3> rotation_of(const Eigen::Vector4d& quaternion);

}  // namespace hm::detail
