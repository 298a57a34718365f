#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "hm/core/result.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

/// Where messages of a bag go, and whose coordinates they are in. A topic has one type of message.
struct BagTopic {
  std::string name;                 ///< "/scan"
  std::string frame_id;             ///< "laser", "imu", or of odometry "odom"
  std::string child_frame_id = {};  ///< of odometry: "base"
};

/// Odometry as vehicles report it.
struct OdometryReading {
  StampedPose pose;  ///< T_odom_base
  Vec3 linear_velocity_base_m_s = Vec3::Zero();
  Vec3 angular_velocity_base_rad_s = Vec3::Zero();
};

/// Writes a ROS bag (rosbag v2.0): plain chunks with their index, the types of messages with their
/// definitions, so that rosbag's own tools read it without further packages. Whole or not at all.
///
/// Every message has its own stamp and the time at which the recorder received it; both lie after 1970-01-01
/// 00:00:00 and before 2106 (checked), for robots take time zero for "not set". Messages may come in any
/// order. Numbers of scans and ranges are rounded to 32 bits.
class BagWriter {
 public:
  explicit BagWriter(std::filesystem::path path);
  ~BagWriter();
  BagWriter(BagWriter&&) noexcept;
  BagWriter& operator=(BagWriter&&) noexcept;

  /// sensor_msgs/LaserScan: no return is written as infinity, an invalid beam as NaN (REP 117).
  void write_scan(const BagTopic& topic, Time received, const LaserScan& scan);
  /// sensor_msgs/Imu: without orientation, its covariance says so.
  void write_imu(const BagTopic& topic, Time received, const ImuSample& sample);
  /// sensor_msgs/Range
  void write_range(const BagTopic& topic, Time received, const RangeReading& reading);
  /// nav_msgs/Odometry
  void write_odometry(const BagTopic& topic, Time received, const OdometryReading& reading);
  /// geometry_msgs/PoseStamped
  void write_pose(const BagTopic& topic, Time received, const StampedPose& pose);

  /// Writes the index and gives the file its name; says what went wrong, if anything did.
  Result<void> finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
