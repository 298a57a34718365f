#include "hm/io/rosbag/bag_messages.hpp"

#include <cmath>

#include "hm/io/bytes/byte_cursor.hpp"

namespace hm::detail {
namespace {

MessageHeader read_header(ByteCursor& cursor) {
  cursor.value<std::uint32_t>();  // seq
  const auto seconds = cursor.value<std::uint32_t>();
  const auto nanoseconds = cursor.value<std::uint32_t>();
  return {Time{std::int64_t{seconds} * 1'000'000'000 + nanoseconds}, cursor.text()};
}

Vec3 read_vector(ByteCursor& cursor) {
  const auto x = cursor.value<double>(), y = cursor.value<double>();
  return {x, y, cursor.value<double>()};
}

Eigen::Vector4d read_quaternion(ByteCursor& cursor) {
  const Vec3 xyz = read_vector(cursor);
  return {xyz.x(), xyz.y(), xyz.z(), cursor.value<double>()};
}

/// Skips a matrix of `count` doubles and returns the first one.
double read_covariance(ByteCursor& cursor, std::size_t count) {
  const auto first = cursor.value<double>();
  cursor.take((count - 1) * sizeof(double));
  return first;
}

bool read_floats(ByteCursor& cursor, std::vector<float>& values) {
  const auto count = cursor.value<std::uint32_t>();
  const auto bytes = cursor.take(std::size_t{count} * sizeof(float));
  if (!cursor.ok()) return false;
  values.resize(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  return true;
}

bool at_end(const ByteCursor& cursor) { return cursor.ok() && cursor.remaining() == 0; }

}  // namespace

std::optional<ScanMessage> parse_laser_scan(MessageBytes bytes) {
  ByteCursor cursor(bytes);
  ScanMessage message{read_header(cursor), {}};
  LaserScan& scan = message.scan;
  const auto next = [&] { return static_cast<double>(cursor.value<float>()); };
  scan.angle_min_rad = next();
  const double angle_max_rad = next();
  scan.angle_increment_rad = next();
  scan.time_increment_s = next();
  next();  // scan_time: the stamps are more accurate
  scan.range_min_m = next();
  scan.range_max_m = next();
  std::vector<float> intensities;
  if (!read_floats(cursor, scan.ranges_m) || !read_floats(cursor, intensities) || !at_end(cursor))
    return std::nullopt;
  // The increment is rounded to float; over a thousand beams it is more accurate to derive it from the end
  // angles.
  const double by_ends =
      (angle_max_rad - scan.angle_min_rad) / std::max(1.0, static_cast<double>(scan.size()) - 1);
  if (std::fabs(by_ends - scan.angle_increment_rad) < 1e-4 * std::fabs(scan.angle_increment_rad))
    scan.angle_increment_rad = by_ends;
  return message;
}

std::optional<ImuMessage> parse_imu(MessageBytes bytes) {
  ByteCursor cursor(bytes);
  ImuMessage message{read_header(cursor), {}};
  const Eigen::Vector4d quaternion = read_quaternion(cursor);
  const double orientation_variance = read_covariance(cursor, 9);
  message.sample.angular_velocity_rad_s = read_vector(cursor);
  read_covariance(cursor, 9);
  message.sample.specific_force_m_s2 = read_vector(cursor);
  read_covariance(cursor, 9);
  if (!at_end(cursor)) return std::nullopt;
  if (orientation_variance != -1) message.sample.R_world_imu = rotation_of(quaternion);
  return message;
}

std::optional<RangeMessage> parse_range(MessageBytes bytes) {
  ByteCursor cursor(bytes);
  RangeMessage message{read_header(cursor), {}};
  RangeReading& reading = message.reading;
  cursor.value<std::uint8_t>();  // radiation type
  cursor.value<float>();         // field of view
  reading.range_min_m = static_cast<double>(cursor.value<float>());
  reading.range_max_m = static_cast<double>(cursor.value<float>());
  reading.range_m = static_cast<double>(cursor.value<float>());
  if (!at_end(cursor)) return std::nullopt;
  return message;
}

std::optional<PoseMessage> parse_odometry(MessageBytes bytes) {
  ByteCursor cursor(bytes);
  PoseMessage message{.header = read_header(cursor), .child_frame_id = cursor.text()};
  message.position_m = read_vector(cursor);
  message.quaternion = read_quaternion(cursor);
  read_covariance(cursor, 36);
  read_vector(cursor);  // velocities
  read_vector(cursor);
  read_covariance(cursor, 36);
  if (!at_end(cursor)) return std::nullopt;
  return message;
}

std::optional<PoseMessage> parse_pose(MessageBytes bytes) {
  ByteCursor cursor(bytes);
  PoseMessage message{.header = read_header(cursor), .child_frame_id = {}};
  message.position_m = read_vector(cursor);
  message.quaternion = read_quaternion(cursor);
  if (!at_end(cursor)) return std::nullopt;
  return message;
}

std::optional<std::vector<TransformMessage>> parse_transforms(MessageBytes bytes) {
  ByteCursor cursor(bytes);
  const auto count = cursor.value<std::uint32_t>();
  std::vector<TransformMessage> transforms;
  for (std::uint32_t i = 0; i < count && cursor.ok(); ++i) {
    TransformMessage transform{.header = read_header(cursor), .child_frame_id = cursor.text()};
    transform.position_m = read_vector(cursor);
    transform.quaternion = read_quaternion(cursor);
    transforms.push_back(std::move(transform));
  }
  if (!at_end(cursor)) return std::nullopt;
  return transforms;
}

std::optional<Mat3> rotation_of(const Eigen::Vector4d& quaternion) {
  constexpr double kTolerance = 0.05;
  if (!(std::fabs(quaternion.norm() - 1.0) <= kTolerance)) return std::nullopt;
  return Eigen::Quaterniond(quaternion.w(), quaternion.x(), quaternion.y(), quaternion.z())
      .normalized()
      .toRotationMatrix();
}

}  // namespace hm::detail
