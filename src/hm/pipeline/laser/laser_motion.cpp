#include "hm/pipeline/laser/laser_motion.hpp"

#include <algorithm>
#include <cmath>

#include "hm/sensors/odometry_jump.hpp"

namespace hm {
namespace {

constexpr double kAttitudeKept_s = 5.0, kAttitudeMaxGap_s = 0.1;
/// An accelerometer that does not measure gravity, or in other units, seems to fall.
constexpr double kMostUpward_m_s2 = 6;
constexpr double kMaxImuStep_s = 0.5;  // a longer gap of the gyroscope leaves the yaw unknown
constexpr std::size_t kOdometryKept = 4096, kJumpsKept = 64;
/// Odometry that is read less often tells nothing of tenths of a second.
constexpr double kFrequent_s = 0.25;

/// Rate of the yaw of R = Rz(yaw) Ry(pitch) Rx(roll).
double yaw_rate(const Vec3& angular_velocity_base, double roll, double pitch) {
  const double cosine = std::cos(pitch);
  if (std::abs(cosine) < 1e-3) return 0;
  return (angular_velocity_base.y() * std::sin(roll) + angular_velocity_base.z() * std::cos(roll)) / cosine;
}

}  // namespace

LaserMotion::LaserMotion(const StateEstimatorParams& params, const SE3& T_base_imu, Duration max_odometry_gap)
    : estimator_(params, T_base_imu),
      T_base_imu_(T_base_imu),
      max_odometry_gap_(max_odometry_gap),
      attitude_(kAttitudeKept_s, kAttitudeMaxGap_s) {}

Mat3 LaserMotion::R_world_base_of(const ImuSample& sample) {
  if (sample.R_world_imu) return *sample.R_world_imu * T_base_imu_.rotation().transpose();
  const VehicleState state = estimator_.state();
  const Vec3 rpy = state.roll_pitch_yaw_rad;
  const double dt_s = any_imu_ ? (sample.stamp - newest_imu_).seconds() : 0;
  if (dt_s < kMaxImuStep_s) {
    const Vec3 rates = T_base_imu_.rotation() * sample.angular_velocity_rad_s;
    yaw_rad_ += (yaw_rate(rates, rpy.x(), rpy.y()) - state.yaw_rate_bias_rad_s) * dt_s;
  }
  return rotation_from_roll_pitch_yaw({rpy.x(), rpy.y(), yaw_rad_});
}

void LaserMotion::add_imu(const ImuSample& sample) {
  const FusionStatus status = estimator_.add_imu(sample);
  if (status == FusionStatus::kInvalid || status == FusionStatus::kTimeBackwards) return;
  const Mat3 R_world_base = R_world_base_of(sample);
  if (!attitude_.add(sample.stamp, R_world_base)) return;
  add_climb(sample, R_world_base);
  newest_imu_ = sample.stamp;
  any_imu_ = true;
}

/// Sums up the upward acceleration, taken as that of the sample since the one before.
void LaserMotion::add_climb(const ImuSample& sample, const Mat3& R_world_base) {
  double climb_m_s = 0;
  if (!climbs_.empty()) {
    const double up_m_s2 =
        (R_world_base * (T_base_imu_.rotation() * sample.specific_force_m_s2)).z() - kGravity_m_s2;
    climb_m_s = climbs_.back().second + up_m_s2 * (sample.stamp - climbs_.back().first).seconds();
  }
  climbs_.emplace_back(sample.stamp, climb_m_s);
  while (climbs_.front().first < sample.stamp - Duration::from_seconds(kAttitudeKept_s)) climbs_.pop_front();
}

std::optional<double> LaserMotion::climb_at(Time stamp) const {
  const auto after = std::ranges::lower_bound(climbs_, stamp, {}, &std::pair<Time, double>::first);
  if (after == climbs_.begin() || after == climbs_.end()) return std::nullopt;
  const auto before = std::prev(after);
  const double gap_s = (after->first - before->first).seconds();
  if (gap_s > kAttitudeMaxGap_s) return std::nullopt;
  return std::lerp(before->second, after->second, (stamp - before->first).seconds() / gap_s);
}

std::optional<double> LaserMotion::upward_acceleration(Time begin, Time end) const {
  const auto first = climb_at(begin), last = climb_at(end);
  if (!(end > begin) || !first || !last) return std::nullopt;
  const double mean_m_s2 = (*last - *first) / (end - begin).seconds();
  return std::abs(mean_m_s2) < kMostUpward_m_s2 ? std::optional(mean_m_s2) : std::nullopt;
}

void LaserMotion::add_odometry(const StampedPose& T_odom_base) {
  if (!odometry_.empty() && T_odom_base.stamp <= odometry_.back().stamp) return;
  if (!is_rigid(T_odom_base.T_world_base)) return;
  if (odometry_.size() >= 2 * kOdometryKept)
    odometry_.erase(odometry_.begin(), odometry_.end() - static_cast<std::ptrdiff_t>(kOdometryKept));
  if (!odometry_.empty() && odometry_jumps(odometry_.back(), T_odom_base)) {
    if (jumps_.size() >= kJumpsKept) jumps_.pop_front();
    jumps_.emplace_back(odometry_.back().stamp, T_odom_base.stamp);
  }
  odometry_.push_back(T_odom_base);
}

bool LaserMotion::odometry_jumped(Time begin, Time end) const {
  return std::any_of(jumps_.begin(), jumps_.end(),
                     [&](const auto& jump) { return jump.second > begin && jump.first < end; });
}

bool LaserMotion::odometry_reaches(Time stamp) const {
  return !odometry_.empty() && odometry_.back().stamp >= stamp - delay_.delay();
}

SweepAttitude LaserMotion::sweep_attitude(Time begin, Time end) const {
  SweepAttitude sweep;
  sweep.begin = begin, sweep.end = end;
  const auto first = attitude_.at(begin), last = attitude_.at(end);
  if (!first || !last) return sweep;
  sweep.R_world_base_begin = Eigen::Quaterniond(*first);
  sweep.R_world_base_end = Eigen::Quaterniond(*last);
  return sweep;
}

std::optional<SE3> LaserMotion::odometry_at(Time stamp) const {
  return pose_at(odometry_, stamp - delay_.delay(), max_odometry_gap_);
}

std::optional<SE2> LaserMotion::frequent_odometry_at(Time stamp) const {
  const auto pose = pose_at(odometry_, stamp, Duration::from_seconds(kFrequent_s));
  return pose ? std::optional(SE2::from_se3(*pose)) : std::nullopt;
}

std::optional<Vec3> LaserMotion::odometry_velocity(Time begin, Time end) const {
  if (!(end > begin)) return std::nullopt;  // all beams at one moment
  begin = begin - delay_.delay(), end = end - delay_.delay();
  const auto first = frequent_odometry_at(begin), last = frequent_odometry_at(end);
  if (!first || !last || odometry_jumped(begin, end)) return std::nullopt;
  return (first->inverse() * *last).log() / (end - begin).seconds();
}

MotionPrediction LaserMotion::since_last(Time now) const {
  MotionPrediction prediction;
  if (const auto attitude = attitude_.at(now); attitude && last_attitude_)
    prediction.yaw_change_rad =
        wrap_angle(roll_pitch_yaw(*attitude).z() - roll_pitch_yaw(*last_attitude_).z());
  // With the delay as it is known by now; after a long gap only the pose of then is kept.
  auto last = last_ ? odometry_at(*last_) : std::nullopt;
  if (!last) last = last_odometry_;
  if (last_ && odometry_jumped(*last_ - delay_.delay(), now - delay_.delay())) return prediction;
  if (const auto odometry = odometry_at(now); odometry && last)
    prediction.T_last_now = SE2::from_se3(*last).inverse() * SE2::from_se3(*odometry);
  return prediction;
}

void LaserMotion::remember(Time now, const std::optional<double>& heading_rad) {
  if (heading_rad && last_heading_rad_) {
    const auto by_wheels = [this](Time stamp) -> std::optional<double> {
      const auto pose = frequent_odometry_at(stamp);
      return pose ? std::optional(pose->angle()) : std::nullopt;
    };
    delay_.learn(*last_, now, *heading_rad - *last_heading_rad_, by_wheels);
  }
  last_attitude_ = attitude_.at(now);
  last_odometry_ = odometry_at(now);
  last_ = now;
  last_heading_rad_ = heading_rad;
}

}  // namespace hm
