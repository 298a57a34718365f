#pragma once
#include <Eigen/Cholesky>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/odometry/registration/rigid_registration.hpp"

namespace hm {

/// Random transform with a translation of up to `reach_m` per axis and a rotation of up to about `angle_rad`.
inline SE3 random_motion(Rng& rng, double reach_m, double angle_rad) {
  const auto any = [&rng](double limit) {
    const double x = rng.uniform(-limit, limit), y = rng.uniform(-limit, limit);
    return Vec3(x, y, rng.uniform(-limit, limit));
  };
  const Vec3 translation = any(reach_m);
  return {so3_exp(any(angle_rad / 1.8)), translation};
}

inline Vec3 point_in_view(Rng& rng) {
  const double x = rng.uniform(-1.5, 1.5), y = rng.uniform(-1.2, 1.2);
  return {x, y, rng.uniform(0.8, 4.5)};
}

/// Pairs without noise for a given transform.
inline std::vector<PointPair> exact_pairs(const SE3& T_a_b, int count, Rng& rng) {
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    const Vec3 p = point_in_view(rng);
    pairs.push_back({T_a_b * p, p, Mat3::Zero(), Mat3::Zero()});
  }
  return pairs;
}

/// Covariance of a point measured by a Kinect: 0.001425 z^2 along the ray, a pixel of 1/525 across.
inline Mat3 kinect_covariance(const Vec3& p) {
  const double sigma = 0.001425 * p.z() * p.z();
  const Vec3 ray = p / p.z();
  Mat3 covariance = sigma * sigma * ray * ray.transpose();
  covariance(0, 0) += p.z() * p.z() / (525.0 * 525.0);
  covariance(1, 1) += p.z() * p.z() / (525.0 * 525.0);
  return covariance;
}

/// Draws from a normal distribution.
inline Vec3 draw(const Vec3& mean, const Mat3& covariance, Rng& rng) {
  const Mat3 root = covariance.llt().matrixL();
  const double x = rng.normal(), y = rng.normal();
  return mean + root * Vec3(x, y, rng.normal());
}

/// Pairs with the Kinect's noise and matching covariances.
inline std::vector<PointPair> noisy_pairs(const SE3& T_a_b, int count, Rng& rng) {
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    const Vec3 b = point_in_view(rng);
    const Vec3 a = T_a_b * b;
    const Mat3 in_a = kinect_covariance(a), in_b = kinect_covariance(b);
    const Vec3 seen_a = draw(a, in_a, rng);
    pairs.push_back({seen_a, draw(b, in_b, rng), in_a, in_b});
  }
  return pairs;
}

/// Unrelated pairs.
inline std::vector<PointPair> outlier_pairs(int count, Rng& rng) {
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    const Vec3 a = point_in_view(rng);
    const Vec3 b = point_in_view(rng);
    pairs.push_back({a, b, kinect_covariance(a), kinect_covariance(b)});
  }
  return pairs;
}

}  // namespace hm
