#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hm/geometry/trajectory.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_scan.hpp"

/// Messages as robots serialise them: little endian, fields in the order of their definition, strings and
/// lists behind a 32-bit length. Every parser gives nothing when the bytes are too few or too many, or a
/// length in them cannot be.
namespace hm::detail {

using MessageBytes = std::span<const std::uint8_t>;

/// The header that all of these messages start with; the only place for the stamp here.
struct MessageHeader {
  Time stamp;
  std::string frame_id;
};

/// A scan as the driver wrote it: the ranges may hold anything.
struct ScanMessage {
  MessageHeader header;
  LaserScan scan;
};
std::optional<ScanMessage> parse_laser_scan(MessageBytes bytes);

struct ImuMessage {
  MessageHeader header;
  ImuSample sample;
};
/// An orientation whose covariance starts with -1 is none, as the definition says.
std::optional<ImuMessage> parse_imu(MessageBytes bytes);

struct RangeMessage {
  MessageHeader header;
  RangeReading reading;
};
std::optional<RangeMessage> parse_range(MessageBytes bytes);

/// A pose as written: the quaternion (x, y, z, w) need not be one.
struct PoseMessage {
  MessageHeader header;
  std::string child_frame_id;  ///< of odometry
  Vec3 position_m = Vec3::Zero();
  Eigen::Vector4d quaternion = Eigen::Vector4d::Zero();
};
std::optional<PoseMessage> parse_odometry(MessageBytes bytes);
std::optional<PoseMessage> parse_pose(MessageBytes bytes);

/// The rotation of a quaternion (x, y, z, w) of nearly unit length; nothing when it is none.
std::optional<Mat3> rotation_of(const Eigen::Vector4d& quaternion);

}  // namespace hm::detail
