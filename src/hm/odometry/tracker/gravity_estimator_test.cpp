#include "hm/odometry/tracker/gravity_estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/sensors/imu.hpp"

namespace hm {
namespace {

constexpr double kGravityFrame_s = 1.0 / 30;
const Vec3 kUpOdom = Vec3(0.2, -0.1, 1).normalized();  // odom need not be level

/// Camera that oscillates with up to 4 m/s^2 while rotating, in closed form.
struct Swing {
  double amplitude_m = 0.4, rate_rad_s = 3.2;
  Vec3 bias = Vec3(0.1, -0.15, 0.05);
  [[nodiscard]] SE3 pose(double t) const {
    return {so3_exp(Vec3(0.3 * std::sin(0.7 * t), 0.5 * t, 0.2)),
            Vec3(amplitude_m * std::sin(rate_rad_s * t), 0.1 * t, 0)};
  }
  /// Mean specific force from t - kGravityFrame_s to t.
  [[nodiscard]] Vec3 force(double t) const {
    Vec3 sum = Vec3::Zero();
    constexpr int kSteps = 20;
    for (int i = 0; i < kSteps; ++i) {
      const double at = t - kGravityFrame_s * (i + 0.5) / kSteps;
      const Vec3 a(-amplitude_m * rate_rad_s * rate_rad_s * std::sin(rate_rad_s * at), 0, 0);
      sum += pose(at).rotation().transpose() * (a + kGravity_m_s2 * kUpOdom);
    }
    return sum / kSteps + bias;
  }
};

Time at(double t) { return Time::from_seconds(100 + t); }

double angle(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

GravityEstimator trained(const Swing& swing, int frames) {
  GravityEstimator estimator;
  for (int i = 0; i < frames; ++i)
    estimator.add(at(i * kGravityFrame_s), swing.pose(i * kGravityFrame_s), swing.force(i * kGravityFrame_s));
  return estimator;
}

TEST(GravityEstimator, LearnsUpAndBiasWhileTheCameraIsSwung) {
  const Swing swing;
  const GravityEstimator estimator = trained(swing, 900);
  // The camera mostly rotates about one axis: the bias along it is not separable from gravity.
  EXPECT_LT(angle(estimator.gravity_odom_m_s2(), kUpOdom), 0.01);
  EXPECT_LT((estimator.bias_camera_m_s2() - swing.bias).norm(), 0.1);
  EXPECT_NEAR(estimator.gravity_odom_m_s2().norm(), kGravity_m_s2, 0.06);
  // The instantaneous specific force differs.
  double worst = 0;
  for (double t = 0; t < 5; t += 0.1)
    worst = std::max(worst, angle(swing.pose(t).rotation() * swing.force(t), kUpOdom));
  EXPECT_GT(worst, 0.3);
}

/// The tilt of a guess is measured; a turn about up is not observable.
TEST(GravityEstimator, SeesTheTiltOfThePathAndNoTurnAboutUp) {
  const Swing swing;
  const double t = 900 * kGravityFrame_s;
  for (const Vec3& turn : {Vec3(0.02, 0, 0), Vec3(0, -0.02, 0)}) {
    GravityEstimator estimator = trained(swing, 860);
    const SE3 tilt(so3_exp(turn), Vec3::Zero());  // the path has drifted from here on
    estimator.interrupt();
    for (int i = 860; i < 900; ++i)
      estimator.add(at(i * kGravityFrame_s), tilt * swing.pose(i * kGravityFrame_s),
                    swing.force(i * kGravityFrame_s));
    estimator.interrupt();
    for (int i = 850; i < 900; ++i)
      estimator.add(at(i * kGravityFrame_s), tilt * swing.pose(i * kGravityFrame_s),
                    swing.force(i * kGravityFrame_s));
    const auto answer = estimator.observe(at(t), tilt * swing.pose(t), swing.force(t));
    ASSERT_EQ(answer.verdict, GravityEstimator::Verdict::kUsed);
    const Vec3 predicted = (tilt * swing.pose(t)).rotation().transpose() * answer.up.up_odom;
    EXPECT_NEAR(angle(predicted, answer.up.up_camera), turn.cross(kUpOdom).norm(), 0.006);
  }
}

TEST(GravityEstimator, RejectsBlowsFallsAndADeviceThatIsTurnedOtherwise) {
  const Swing swing;
  const GravityEstimator estimator = trained(swing, 900);
  const auto verdict_of = [&](const auto& force) {
    GravityEstimator other = estimator;
    for (int i = 900; i < 950; ++i)
      other.add(at(i * kGravityFrame_s), swing.pose(i * kGravityFrame_s), force(i * kGravityFrame_s));
    EXPECT_LT(angle(other.gravity_odom_m_s2(), estimator.gravity_odom_m_s2()), 0.004);
    return other
        .observe(at(950 * kGravityFrame_s), swing.pose(950 * kGravityFrame_s), force(950 * kGravityFrame_s))
        .verdict;
  };
  using Verdict = GravityEstimator::Verdict;
  EXPECT_EQ(verdict_of([&](double s) { return swing.force(s); }), Verdict::kUsed);
  EXPECT_EQ(verdict_of([&](double) { return Vec3(Vec3::Zero()); }), Verdict::kRejected);
  EXPECT_EQ(verdict_of([&](double s) { return Vec3(swing.force(s) * 1.3); }), Verdict::kRejected);
  EXPECT_EQ(verdict_of([&](double s) { return Vec3(swing.force(s).cross(Vec3::UnitX()) * 1.1); }),
            Verdict::kRejected);
}

TEST(GravityEstimator, SaysNothingBeforeItKnowsAnything) {
  const Swing swing;
  const GravityEstimator estimator = trained(swing, 20);
  EXPECT_EQ(estimator.gravity_odom_m_s2(), Vec3::Zero());
  EXPECT_EQ(estimator.observe(at(1), swing.pose(1), swing.force(1)).verdict,
            GravityEstimator::Verdict::kTooEarly);
}

}  // namespace
}  // namespace hm
