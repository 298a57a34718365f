#include "hm/laser/odometry/wheel_calibration.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

/// Errors that do not grow with the motion, such as those of the moment of a reading.
constexpr double kLeast_m = 0.01, kLeast_rad = 0.005;
/// Shorter motions teach nothing.
constexpr double kLeastWay_m = 0.05, kLeastTurn_rad = 0.05;
/// An error counts as this many deviations at most.
constexpr double kMostDeviationsOfWheels = 3;

/// A motion is split along its own direction; one on the spot along x.
Mat2 axes_of(const SE2& motion) {
  const double way_m = motion.translation().norm();
  const Vec2 along = way_m > 1e-9 ? Vec2(motion.translation() / way_m) : Vec2(1, 0);
  Mat2 axes;
  axes << along.x(), -along.y(), along.y(), along.x();
  return axes;
}

/// Factor on the innovation of an error so many variances large.
double trust(double error2, double variance) {
  const double limit = kMostDeviationsOfWheels * kMostDeviationsOfWheels * variance;
  return error2 <= limit ? 1 : std::sqrt(limit / error2);
}

}  // namespace

void WheelCalibration::Spread::learn(double error2, double amount) {
  const double limit = kMostDeviationsOfWheels * kMostDeviationsOfWheels * variance;
  count += 1;
  variance += (std::clamp(error2 / amount, 0.0, limit) - variance) / count;
}

SE2 WheelCalibration::corrected(const SE2& wheels) const {
  const double way_m = wheels.translation().norm();
  return {(1 + scale_) * wheels.translation(),
          wheels.angle() + heading_.dot(Vec2(way_m, wrap_angle(wheels.angle())))};
}

Mat3 WheelCalibration::covariance(const SE2& wheels) const {
  const double way_m = wheels.translation().norm(), turn_rad = wrap_angle(wheels.angle());
  const Mat2 axes = axes_of(wheels);
  const Vec2 variances(along_.variance * way_m + scale_variance_ * way_m * way_m + kLeast_m * kLeast_m,
                       across_.variance * way_m + kLeast_m * kLeast_m);
  const Vec2 motion(way_m, turn_rad);
  Mat3 covariance = Mat3::Zero();
  covariance.topLeftCorner<2, 2>() = axes * variances.asDiagonal() * axes.transpose();
  covariance(2, 2) = veering_.variance * way_m + turning_.variance * std::abs(turn_rad) +
                     motion.dot(heading_covariance_ * motion) + kLeast_rad * kLeast_rad;
  return covariance;
}

void WheelCalibration::learn(const SE2& wheels, const SE2& matched, const Mat3& covariance) {
  const double way_m = wheels.translation().norm(), turn_rad = wrap_angle(wheels.angle());
  if (way_m < kLeastWay_m && std::abs(turn_rad) < kLeastTurn_rad) return;
  const SE2 expected = corrected(wheels);
  const Mat2 axes = axes_of(wheels);
  const Vec2 error = axes.transpose() * (matched.translation() - expected.translation());
  const Vec2 measured = (axes.transpose() * covariance.topLeftCorner<2, 2>() * axes).diagonal();
  if (way_m >= kLeastWay_m) {
    const double noise = along_.variance * way_m + kLeast_m * kLeast_m;
    if (measured.x() < noise) {
      const double variance = noise + measured.x() + scale_variance_ * way_m * way_m;
      const double gain = scale_variance_ * way_m / variance, error2 = error.x() * error.x();
      along_.learn(error2 - measured.x(), way_m);
      scale_ += gain * trust(error2, variance) * error.x();
      scale_variance_ *= 1 - gain * way_m;
    }
    if (measured.y() < across_.variance * way_m) across_.learn(error.y() * error.y() - measured.y(), way_m);
  }
  const double turn_error = wrap_angle(matched.angle() - expected.angle());
  // The true turn: the measured one has the error that is to be explained.
  const Vec2 motion(way_m, wrap_angle(matched.angle()));
  const double noise =
      veering_.variance * way_m + turning_.variance * std::abs(turn_rad) + kLeast_rad * kLeast_rad;
  const double variance = noise + covariance(2, 2) + motion.dot(heading_covariance_ * motion);
  const double error2 = turn_error * turn_error;
  if (covariance(2, 2) < noise) {
    // By the part of both that was larger.
    const double by_way = veering_.variance * way_m, by_turn = turning_.variance * std::abs(turn_rad);
    if (by_way > by_turn)
      veering_.learn(std::max(0.0, error2 - covariance(2, 2) - by_turn), way_m);
    else
      turning_.learn(std::max(0.0, error2 - covariance(2, 2) - by_way), std::abs(turn_rad));
  }
  const Vec2 gain = heading_covariance_ * motion / variance;
  heading_ += gain * trust(error2, variance) * turn_error;
  heading_covariance_ -= gain * (heading_covariance_ * motion).transpose();
}

}  // namespace hm
