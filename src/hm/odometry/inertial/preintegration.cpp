#include "hm/odometry/inertial/preintegration.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr double kMaxGap_s = 0.1;  // between readings, and to both ends

double seconds_between(Time a, Time b) { return (b - a).seconds(); }

/// Readings at one time, without bias.
struct Reading {
  Vec3 turn_rad_s, force_m_s2;
};

Reading interpolated(const ImuSample& a, const ImuSample& b, Time at) {
  const double span_s = seconds_between(a.stamp, b.stamp);
  const double share = span_s > 0 ? std::clamp(seconds_between(a.stamp, at) / span_s, 0.0, 1.0) : 0.0;
  return {a.angular_velocity_rad_s + share * (b.angular_velocity_rad_s - a.angular_velocity_rad_s),
          a.specific_force_m_s2 + share * (b.specific_force_m_s2 - a.specific_force_m_s2)};
}

Reading without(const ImuBias& bias, const Reading& reading) {
  return {reading.turn_rad_s - bias.gyro_rad_s, reading.force_m_s2 - bias.accel_m_s2};
}

/// Adds an interval of constant readings; the force is rotated by the rotation at its middle.
void add_step(Preintegration& sum, const Reading& reading, double step_s, const ImuNoise& noise) {
  const Vec3 turn = reading.turn_rad_s * step_s;
  const Mat3 half_back = so3_exp(-0.5 * turn), whole_back = so3_exp(-turn);
  const Mat3 R_middle = sum.dR * half_back.transpose();
  const Mat3 J_half = right_jacobian(0.5 * turn), J_whole = right_jacobian(turn);
  const Mat3 turned_force = R_middle * skew(reading.force_m_s2);
  const double half_s2 = 0.5 * step_s * step_s;

  Mat9 F = Mat9::Identity();
  F.block<3, 3>(0, 0) = whole_back;
  F.block<3, 3>(3, 0) = -step_s * turned_force * half_back;
  F.block<3, 3>(6, 0) = -half_s2 * turned_force * half_back;
  F.block<3, 3>(6, 3) = step_s * Mat3::Identity();
  Eigen::Matrix<double, 9, 6> G = Eigen::Matrix<double, 9, 6>::Zero();
  G.block<3, 3>(0, 0) = step_s * J_whole;
  G.block<3, 3>(3, 0) = -0.5 * half_s2 * turned_force * J_half;
  G.block<3, 3>(3, 3) = step_s * R_middle;
  G.block<3, 3>(6, 3) = half_s2 * R_middle;
  Vec6 variance;
  variance << Vec3::Constant(noise.gyro_rad_s_sqrt_hz * noise.gyro_rad_s_sqrt_hz / step_s),
      Vec3::Constant(noise.accel_m_s2_sqrt_hz * noise.accel_m_s2_sqrt_hz / step_s);
  sum.covariance = F * sum.covariance * F.transpose() + G * variance.asDiagonal() * G.transpose();

  const Mat3 middle_by_gyro = half_back * sum.R_by_gyro - 0.5 * step_s * J_half;
  sum.p_by_gyro += step_s * sum.v_by_gyro - half_s2 * turned_force * middle_by_gyro;
  sum.p_by_accel += step_s * sum.v_by_accel - half_s2 * R_middle;
  sum.v_by_gyro -= step_s * turned_force * middle_by_gyro;
  sum.v_by_accel -= step_s * R_middle;
  sum.R_by_gyro = (whole_back * sum.R_by_gyro - step_s * J_whole).eval();

  const Vec3 force = R_middle * reading.force_m_s2;
  sum.dp += step_s * sum.dv + half_s2 * force;
  sum.dv += step_s * force;
  sum.dR = sum.dR * whole_back.transpose();
  sum.duration_s += step_s;
}

/// How the sums change when both ends move: the end adds what is read there, the beginning takes away.
Vec9 change_by_delay(const Preintegration& sum, const Reading& first, const Reading& last) {
  Vec9 change;
  const Vec3& w = first.turn_rad_s;
  change.head<3>() = last.turn_rad_s - sum.dR.transpose() * w;
  change.segment<3>(3) = sum.dR * last.force_m_s2 - first.force_m_s2 - w.cross(sum.dv);
  change.tail<3>() = sum.dv - sum.duration_s * first.force_m_s2 - w.cross(sum.dp);
  return change;
}

}  // namespace

Mat3 right_jacobian(const Vec3& r) {
  const double angle = r.norm(), squared = angle * angle;
  const Mat3 K = skew(r);
  if (angle < 1e-4) return Mat3::Identity() - 0.5 * K + K * K / 6;
  return Mat3::Identity() - (1 - std::cos(angle)) / squared * K +
         (angle - std::sin(angle)) / (squared * angle) * K * K;
}

std::optional<Preintegration> preintegrate(std::span<const ImuSample> readings, Time begin, Time end,
                                           double delay_s, const ImuBias& bias, const ImuNoise& noise) {
  const Time from = begin + Duration::from_seconds(delay_s), to = end + Duration::from_seconds(delay_s);
  if (readings.empty() || !(to > from)) return std::nullopt;
  const auto later = [](Time stamp, const ImuSample& sample) { return stamp < sample.stamp; };
  const auto next = std::upper_bound(readings.begin(), readings.end(), from, later);
  auto i = static_cast<std::size_t>(next == readings.begin() ? 0 : next - readings.begin() - 1);
  if (seconds_between(from, readings[i].stamp) > kMaxGap_s) return std::nullopt;
  Preintegration sum;
  const Reading first =
      without(bias, interpolated(readings[i], readings[std::min(i + 1, readings.size() - 1)], from));
  Reading last = first;
  for (Time at = from; at < to; ++i) {
    const ImuSample& a = readings[i];
    const ImuSample& b = readings[std::min(i + 1, readings.size() - 1)];
    const bool is_last = i + 1 >= readings.size();
    const Time until = is_last || to < b.stamp ? to : b.stamp;
    if (seconds_between(a.stamp, is_last ? to : b.stamp) > kMaxGap_s) return std::nullopt;
    if (!(until > at)) continue;
    const double step_s = seconds_between(at, until);
    const Time middle = at + Duration{(until - at).ns / 2};
    add_step(sum, without(bias, interpolated(a, b, middle)), step_s, noise);
    last = without(bias, interpolated(a, b, until));
    at = until;
  }
  sum.by_delay = change_by_delay(sum, first, last);
  return sum;
}

}  // namespace hm
