#pragma once
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "hm/core/result.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

/// Topic and coordinate frames of messages in a bag. A topic has one message type.
struct BagTopic {
  std::string name;                 ///< "/scan"
  std::string frame_id;             ///< "laser", "imu"; for odometry "odom"
  std::string child_frame_id = {};  ///< for odometry: "base"
};

/// Odometry measurement of a vehicle.
struct OdometryReading {
  StampedPose pose;  ///< T_odom_base
  Vec3 linear_velocity_base_m_s = Vec3::Zero();
  Vec3 angular_velocity_base_rad_s = Vec3::Zero();
};

/// Transform between two coordinate frames.
struct FrameTransform {
  Time stamp;
  std::string parent, child;
  SE3 T_parent_child;
};

/// Writes a ROS bag (rosbag v2.0) atomically: uncompressed chunks with index, and message types with
/// definitions, so that the rosbag tools need no further packages.
///
/// Every message has its own stamp and its receive time; both must lie after 1970-01-01 00:00:00 and before
/// 2106 (checked), since ROS treats time zero as "not set". Messages may be written in any order. Scan and
/// range values are stored as 32-bit floats.
class BagWriter {
 public:
  explicit BagWriter(std::filesystem::path path);
  ~BagWriter();
  BagWriter(BagWriter&&) noexcept;
  BagWriter& operator=(BagWriter&&) noexcept;

  /// Writes sensor_msgs/LaserScan: no return as infinity, an invalid beam as NaN (REP 117).
  void write_scan(const BagTopic& topic, Time received, const LaserScan& scan);
  /// Writes sensor_msgs/Imu; a missing orientation is marked by covariance -1.
  void write_imu(const BagTopic& topic, Time received, const ImuSample& sample);
  /// Writes sensor_msgs/Range.
  void write_range(const BagTopic& topic, Time received, const RangeReading& reading);
  /// Writes nav_msgs/Odometry.
  void write_odometry(const BagTopic& topic, Time received, const OdometryReading& reading);
  /// Writes geometry_msgs/PoseStamped.
  void write_pose(const BagTopic& topic, Time received, const StampedPose& pose);
  /// Writes tf2_msgs/TFMessage ("/tf", "/tf_static").
  void write_transforms(const std::string& topic, Time received, std::span<const FrameTransform> transforms);

  /// Closes the chunk and hands everything to the operating system: a kill of the process then leaves a bag
  /// without index under the name `PATH.partial`, whose messages can be read.
  void flush();
  /// Writes the index and renames the file to its final name; returns the first error.
  Result<void> finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
