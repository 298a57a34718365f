#include "hm/laser/matching/point_to_line_step.hpp"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <vector>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

/// Pairs of random points and lines such that the motion (dx, dy, angle) brings every point onto its line but
/// for noise.
std::vector<PointLinePair> random_pairs(Rng& rng, const SE2& motion, double noise_m, int count) {
  std::vector<PointLinePair> pairs;
  for (int i = 0; i < count; ++i) {
    const double angle = rng.uniform(-3.14, 3.14);
    PointLinePair pair;
    pair.nx = std::cos(angle), pair.ny = std::sin(angle);
    pair.px = rng.uniform(-5, 5), pair.py = rng.uniform(-5, 5);
    pair.weight = rng.uniform(0.5, 4);
    const Vec2 moved = motion * Vec2(pair.px, pair.py);
    pair.error = pair.nx * (moved.x() - pair.px) + pair.ny * (moved.y() - pair.py) + rng.normal(0, noise_m);
    pairs.push_back(pair);
  }
  return pairs;
}

double cost(const std::vector<PointLinePair>& pairs, const Vec3& step) {
  const SE2 motion(step.x(), step.y(), step.z());
  double sum = 0;
  for (const PointLinePair& pair : pairs) {
    const Vec2 shift = motion * Vec2(pair.px, pair.py) - Vec2(pair.px, pair.py);
    const double error = pair.nx * shift.x() + pair.ny * shift.y() - pair.error;
    sum += pair.weight * error * error;
  }
  return sum;
}

PointToLineSums sums_of(const std::vector<PointLinePair>& pairs) {
  PointToLineSums sums;
  for (const PointLinePair& pair : pairs) sums.add(pair);
  return sums;
}

/// The best translation for an angle, by the normal equations; then a fine search over all angles.
Vec3 brute_force(const std::vector<PointLinePair>& pairs) {
  const auto best_at = [&](double angle) {
    Mat2 a = Mat2::Zero();
    Vec2 b = Vec2::Zero();
    for (const PointLinePair& pair : pairs) {
      const Vec2 normal(pair.nx, pair.ny), point(pair.px, pair.py);
      const double turned = normal.dot(SE2(0, 0, angle) * point - point);
      a += pair.weight * normal * normal.transpose();
      b += pair.weight * normal * (pair.error - turned);
    }
    const Vec2 shift = a.inverse() * b;
    return Vec3(shift.x(), shift.y(), angle);
  };
  Vec3 best = best_at(0);
  double step = 2 * std::numbers::pi / 720;
  for (int k = -360; k < 360; ++k)
    if (const Vec3 candidate = best_at(k * step); cost(pairs, candidate) < cost(pairs, best))
      best = candidate;
  for (; step > 1e-10; step /= 2)
    for (const double angle : {best.z() - step, best.z() + step})
      if (const Vec3 candidate = best_at(angle); cost(pairs, candidate) < cost(pairs, best)) best = candidate;
  return best;
}

TEST(PointToLineStep, IsTheGlobalMinimumOfTheCost) {
  Rng rng(11);
  for (int trial = 0; trial < 60; ++trial) {
    // Any angle: the step is no linearisation.
    const SE2 motion(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-3.1, 3.1));
    const double noise_m = trial % 3 == 0 ? 0 : rng.uniform(0, 0.5);
    const auto pairs = random_pairs(rng, motion, noise_m, 5 + trial);
    const Vec3 step = exact_step(sums_of(pairs)), reference = brute_force(pairs);
    EXPECT_LE(cost(pairs, step), cost(pairs, reference) * (1 + 1e-9) + 1e-12);
    EXPECT_LT((step.head<2>() - reference.head<2>()).norm(), 1e-5);
    EXPECT_LT(std::abs(wrap_angle(step.z() - reference.z())), 1e-6);
    if (noise_m == 0) {
      EXPECT_LT((step.head<2>() - motion.translation()).norm(), 1e-9);
      EXPECT_LT(std::abs(wrap_angle(step.z() - motion.angle())), 1e-10);
    }
  }
}

TEST(PointToLineStep, InformationAndGradientAreTheDerivativesOfTheCost) {
  Rng rng(12);
  const auto pairs = random_pairs(rng, SE2(0.01, -0.02, 0.005), 0.0, 40);
  const PointToLineSums sums = sums_of(pairs);
  constexpr double kStep = 1e-5;
  const Mat3 information = sums.information();
  const Vec3 gradient = sums.gradient();
  for (int a = 0; a < 3; ++a) {
    const Vec3 da = kStep * Vec3::Unit(a);
    EXPECT_NEAR((cost(pairs, da) - cost(pairs, -da)) / (2 * kStep), -2 * gradient(a),
                1e-5 * information.norm());
  }
  // At the minimum the errors vanish, and with them what the Gauss-Newton form leaves out.
  const Vec3 minimum = exact_step(sums);
  std::vector<PointLinePair> there = pairs;
  for (PointLinePair& pair : there) {
    const Vec2 turned = SE2(0, 0, minimum.z()) * Vec2(pair.px, pair.py);
    pair.px = turned.x(), pair.py = turned.y(), pair.error = 0;
  }
  const Mat3 at_minimum = sums_of(there).information();
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      constexpr double kWide = 1e-4;
      const Vec3 da = kWide * Vec3::Unit(a), db = kWide * Vec3::Unit(b);
      const double second =
          (cost(there, da + db) - cost(there, da - db) - cost(there, db - da) + cost(there, -da - db)) /
          (4 * kWide * kWide);
      EXPECT_NEAR(second, 2 * at_minimum(a, b), 1e-4 * at_minimum.norm());
    }
}

TEST(PointToLineStep, ParallelLinesLeaveTheirDirectionFree) {
  Rng rng(13);
  std::vector<PointLinePair> pairs = random_pairs(rng, {}, 0, 50);
  const double along = 0.6;
  for (PointLinePair& pair : pairs) {
    pair.nx = -std::sin(along), pair.ny = std::cos(along), pair.error = 0.02;
  }
  const PointToLineSums sums = sums_of(pairs);
  const FreeDirections free = find_free_directions(sums, Mat3::Zero(), {1e-3, 0});
  ASSERT_EQ(free.count, 1);
  EXPECT_NEAR(std::abs(free.directions[0].dot(Vec3(std::cos(along), std::sin(along), 0))), 1, 1e-9);
  EXPECT_THAT(free.to_string(), testing::HasSubstr("along 34 deg"));
  const Vec3 astray(0.3 * std::cos(along), 0.3 * std::sin(along), 0);
  EXPECT_LT((step_without(free, sums, astray) - step_without(free, sums, Vec3::Zero()) + astray).norm(),
            1e-9);
  const Vec3 step = step_without(free, sums, Vec3::Zero());
  EXPECT_NEAR(step.x(), -0.02 * std::sin(along), 1e-9);
  EXPECT_NEAR(step.y(), 0.02 * std::cos(along), 1e-9);
  EXPECT_NEAR(step.z(), 0, 1e-9);
  const Mat3 inverse = inverse_information(free, sums.information());
  EXPECT_LT((inverse * Vec3(std::cos(along), std::sin(along), 0)).norm(), 1e-12);
}

TEST(PointToLineStep, AConcentricCircleLeavesTheAngleFree) {
  PointToLineSums sums;
  const Vec2 centre(0.4, -0.3);  // seen from the sensor
  for (int i = 0; i < 360; ++i) {
    const double angle = i * std::numbers::pi / 180;
    const Vec2 normal(std::cos(angle), std::sin(angle)), point = centre + 3 * normal;
    sums.add({normal.x(), normal.y(), point.x(), point.y(), 0.01, 1});
  }
  FreeDirections free = find_free_directions(sums, Mat3::Zero(), {1e-3, 0});
  ASSERT_EQ(free.count, 1);
  free.at_m = {10, 20};
  EXPECT_EQ(free.to_string(), "around (10.40, 19.70) m");
}

TEST(PointToLineStep, WhatNoisyNormalsFeignIsNotInformation) {
  Rng rng(14);
  PointToLineSums sums, across;
  for (int i = 0; i < 1000; ++i) {  // a corridor along x whose normals are off by 0.1 rad
    const double error = rng.normal(0, 0.1), nx = std::sin(error), ny = std::cos(error);
    const double px = rng.uniform(-5, 5), py = i % 2 ? 1 : -1;
    sums.add({nx, ny, px, py, 0, 1});
    across.add({-ny, nx, px, py, 0, 0.01});
  }
  EXPECT_EQ(find_free_directions(sums, Mat3::Zero(), {1e-3, 4}).count, 0);
  EXPECT_EQ(find_free_directions(sums, across.information(), {1e-3, 4}).count, 1);
}

}  // namespace
}  // namespace hm
