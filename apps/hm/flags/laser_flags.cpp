#include "flags/laser_flags.hpp"

void LaserFlags::add_to(Command command) {
  const auto topic = [&](const char* name, std::string& value, const char* help) {
    command.add_option(name, value, help).group("ROS bag");
  };
  topic("--scan-topic", options_.scan_topic, "topic of the laser scans (default: all, the busiest first)");
  topic("--imu-topic", options_.imu_topic, "topic of the IMU (default: the busiest)");
  topic("--odometry-topic", options_.odometry_topic, "topic of the odometry (default: the busiest)");
  topic("--range-topic", options_.range_topic, "topic of a downward distance sensor (default: the busiest)");
  topic("--pose-topic", options_.pose_topic, "topic of true poses (default: the busiest)");
}
