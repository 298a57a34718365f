#include "hm/estimation/delayed_fusion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <numeric>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/core/testing/drawn_vector.hpp"
#include "hm/estimation/testing/dense_kalman.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

Time at_ms(double ms) { return Time::from_seconds(ms * 1e-3); }

FusionInput input_at(int ms) {
  const Vec3 acceleration(0.1 * std::sin(0.01 * ms), 0.05 * std::cos(0.02 * ms), 0.2);
  return {at_ms(ms), acceleration, 0.1 * std::cos(0.05 * ms), true};
}

PoseReading<double> pose_at(double ms, double x, double y, double yaw) {
  PoseReading<double> pose;
  pose.stamp = at_ms(ms);
  pose.x_y_yaw = {x, y, wrap_angle(yaw)};
  Mat3 covariance;
  covariance << 4e-4, 1e-4, 0, 1e-4, 3e-4, 0, 0, 0, 1e-4;
  pose.covariance = covariance;
  return pose;
}

/// Measurement with its time of arrival, later than its stamp.
struct Arrival {
  double arrives_ms = 0, stamp_ms = 0;
  bool is_pose = true;
  Vec3 value;
};

std::vector<Arrival> random_arrivals(int until_ms, double max_delay_ms) {
  Rng rng(11);
  std::vector<Arrival> arrivals;
  for (double ms = 3.3; ms < until_ms - max_delay_ms - 5; ms += rng.uniform(4, 40)) {
    const Vec3 value = Vec3(0.03, 0.03, 0.02).cwiseProduct(test::drawn<3>([&] { return rng.normal(); }));
    // Some stamps exactly on an IMU sample, most between two.
    const double stamp_ms = rng.below(4) == 0 ? std::round(ms) : ms;
    arrivals.push_back({stamp_ms + rng.uniform(0, max_delay_ms), stamp_ms, rng.below(3) != 0, value});
  }
  // Everybody starts from the same first two.
  arrivals[0] = {4, 4, true, Vec3::Zero()};
  arrivals[1] = {5, 5, false, Vec3::Zero()};
  for (std::size_t i = 2; i < arrivals.size(); ++i)
    arrivals[i].stamp_ms = std::max(arrivals[i].stamp_ms, 6.0);
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.arrives_ms < b.arrives_ms; });
  return arrivals;
}

void deliver(DelayedFusion& fusion, const Arrival& arrival) {
  if (arrival.is_pose)
    fusion.add_pose(pose_at(arrival.stamp_ms, arrival.value.x(), arrival.value.y(), arrival.value.z()));
  else
    fusion.add_height({at_ms(arrival.stamp_ms), 1 + arrival.value.x(), 0.02});
}

/// Arrivals in the given order, each as soon as the IMU has reached its arrival.
std::unique_ptr<DelayedFusion> run(const FusionParams& params, const std::vector<Arrival>& arrivals,
                                   int until_ms) {
  auto fusion = std::make_unique<DelayedFusion>(params);
  std::size_t next = 0;
  for (int ms = 1; ms <= until_ms; ++ms) {
    fusion->add_input(input_at(ms));
    for (; next < arrivals.size() && arrivals[next].arrives_ms <= ms; ++next)
      deliver(*fusion, arrivals[next]);
  }
  EXPECT_EQ(next, arrivals.size());
  return fusion;
}

void expect_same(const DelayedFusion& one, const DelayedFusion& other, double tolerance) {
  const FusionState &a = one.state(), &b = other.state();
  EXPECT_LE((a.planar.position - b.planar.position).norm(), tolerance);
  EXPECT_LE((a.planar.velocity - b.planar.velocity).norm(), tolerance);
  EXPECT_LE((a.planar.bias - b.planar.bias).norm(), tolerance);
  EXPECT_LE((a.planar.pp - b.planar.pp).norm(), tolerance);
  EXPECT_LE((a.planar.vb - b.planar.vb).norm(), tolerance);
  EXPECT_LE(std::abs(a.vertical.position(0) - b.vertical.position(0)), tolerance);
  EXPECT_LE(std::abs(a.vertical.vv(0) - b.vertical.vv(0)), tolerance);
  EXPECT_LE(std::abs(a.yaw.yaw_rad - b.yaw.yaw_rad), tolerance);
  EXPECT_LE(std::abs(a.yaw.bias_rad_s - b.yaw.bias_rad_s), tolerance);
  EXPECT_EQ(one.pose_counts().accepted, other.pose_counts().accepted);
  EXPECT_EQ(one.pose_counts().rejected, other.pose_counts().rejected);
  EXPECT_EQ(one.height_counts().accepted, other.height_counts().accepted);
  EXPECT_EQ(one.height_counts().rejected, other.height_counts().rejected);
}

TEST(DelayedFusion, LateAndShuffledIsTheSameAsInOrder) {
  FusionParams params;
  params.pose_gate_chi2 = 8;  // so that the gates have work, in either order the same
  params.height_gate_chi2 = 5;
  const auto late = random_arrivals(3000, 120);
  auto in_order = late;
  for (Arrival& arrival : in_order) arrival.arrives_ms = arrival.stamp_ms;
  std::stable_sort(in_order.begin(), in_order.end(),
                   [](const Arrival& a, const Arrival& b) { return a.stamp_ms < b.stamp_ms; });
  const auto a = run(params, late, 3000), b = run(params, in_order, 3000);
  EXPECT_GT(a->pose_counts().accepted, 50u);
  EXPECT_GT(a->pose_counts().rejected + a->height_counts().rejected, 0u);
  EXPECT_EQ(a->pose_counts().too_old, 0u);
  expect_same(*a, *b, 0);  // to the last bit
}

TEST(DelayedFusion, IsTheTextbookFilterInOrderOfStamps) {
  FusionParams params;
  params.pose_gate_chi2 = params.height_gate_chi2 = 1e9;
  params.added_position_std_m = params.added_yaw_std_rad = 0;
  const auto late = random_arrivals(2000, 100);
  const auto fusion = run(params, late, 2000);

  std::vector<Arrival> sorted = late;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Arrival& a, const Arrival& b) { return a.stamp_ms < b.stamp_ms; });
  // Height alone: three states, the same for all of this run.
  DenseKalman dense{Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(4e-4, 1.0, 0.09).asDiagonal()};
  Eigen::MatrixXd f = Eigen::MatrixXd::Zero(3, 3), density = Eigen::MatrixXd::Zero(3, 3), h(1, 3);
  f(0, 1) = 1;
  f(1, 2) = -1;
  density(1, 1) = std::pow(params.acceleration_density_m_s2_sqrt_hz, 2);
  density(2, 2) = std::pow(params.kAccelerationBiasWalk_m_s3_sqrt_hz, 2);
  h << 1, 0, 0;
  std::vector<double> heights_ms, values;
  for (const Arrival& arrival : sorted)
    if (!arrival.is_pose && arrival.stamp_ms > 5)
      heights_ms.push_back(arrival.stamp_ms), values.push_back(arrival.value.x());
  double now_ms = 5;
  const auto go_to = [&](double ms) {
    if (ms <= now_ms) return;
    const double dt_s = (at_ms(ms) - at_ms(now_ms)).seconds();
    const auto discrete = van_loan(f, density, dt_s);
    dense.predict(discrete.a, Eigen::Vector3d(0.5 * dt_s * dt_s * 0.2, dt_s * 0.2, 0), discrete.q);
    now_ms = ms;
  };
  for (std::size_t i = 0; i < heights_ms.size(); ++i) {
    go_to(heights_ms[i]);
    dense.correct(h, Eigen::VectorXd::Constant(1, 1 + values[i] - dense.x(0)),
                  Eigen::MatrixXd::Constant(1, 1, 4e-4));
  }
  go_to(2000);
  const auto& vertical = fusion->state().vertical;
  EXPECT_NEAR(vertical.position(0), dense.x(0), 1e-9);
  EXPECT_NEAR(vertical.velocity(0), dense.x(1), 1e-9);
  EXPECT_NEAR(vertical.bias(0), dense.x(2), 1e-9);
  EXPECT_NEAR(vertical.pp(0), dense.p(0, 0), 1e-11);
  EXPECT_NEAR(vertical.vb(0), dense.p(1, 2), 1e-11);
}

TEST(DelayedFusion, OnArrivalIsSomethingElse) {
  FusionParams params;
  const auto late = random_arrivals(2000, 100);
  const auto a = run(params, late, 2000);
  params.delay_compensation = false;
  const auto b = run(params, late, 2000);
  EXPECT_GT((a->state().planar.position - b->state().planar.position).norm(), 1e-4);
}

/// A vehicle that stands at (1, 2), facing 3 rad, for a second.
std::unique_ptr<DelayedFusion> standing(const FusionParams& params) {
  auto fusion = std::make_unique<DelayedFusion>(params);
  for (int ms = 1; ms <= 1000; ++ms) {
    fusion->add_input({at_ms(ms), Vec3::Zero(), 0, true});
    if (ms % 25 == 0) fusion->add_pose(pose_at(ms, 1, 2, 3));
    if (ms % 25 == 10) fusion->add_height({at_ms(ms), 1.5, 0.01});
  }
  return fusion;
}

TEST(DelayedFusion, OutliersAreRefusedAndCounted) {
  const auto fusion = standing({});
  EXPECT_EQ(fusion->pose_counts().accepted, 40u);
  EXPECT_EQ(fusion->add_pose(pose_at(990, 1.5, 2, 3)), FusionStatus::kRejected);
  EXPECT_EQ(fusion->add_pose(pose_at(991, 1, 2, 3.5)), FusionStatus::kRejected);
  EXPECT_EQ(fusion->add_height({at_ms(992), 1.8, 0.01}), FusionStatus::kRejected);
  EXPECT_EQ(fusion->add_pose(pose_at(993, 1.005, 2, 3.0 - 2 * 3.14159265358979)),
            FusionStatus::kOk);  // wraps
  EXPECT_EQ(fusion->pose_counts().rejected, 2u);
  EXPECT_EQ(fusion->height_counts().rejected, 1u);
  EXPECT_LT((fusion->state().planar.position - Vec2(1, 2)).norm(), 0.01);
}

TEST(DelayedFusion, RecoversWhenTheWorldInsists) {
  FusionParams params;
  params.recover_after_rejections = 5;
  const auto fusion = standing(params);
  const Vec2 bias = fusion->state().planar.bias;
  FusionStatus status = FusionStatus::kOk;
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(status, i == 0 ? FusionStatus::kOk : FusionStatus::kRejected);
    status = fusion->add_pose(pose_at(950 + i, 4, 4, 1));
  }
  EXPECT_EQ(status, FusionStatus::kRecovered);
  EXPECT_EQ(fusion->pose_counts().recovered, 1u);
  EXPECT_EQ(fusion->pose_counts().rejected, 5u + 2u);  // the old place at 975 and 1000 are now the outliers
  EXPECT_LT((fusion->state().planar.position - Vec2(4, 4)).norm(), 0.1);
  EXPECT_LT((fusion->state().planar.bias - bias).norm(), 0.1);
}

TEST(DelayedFusion, TimesThatCannotBeUsedSaySo) {
  const auto fusion = standing({});
  EXPECT_EQ(fusion->add_pose(pose_at(700, 1, 2, 3)), FusionStatus::kTooOld);
  EXPECT_EQ(fusion->add_pose(pose_at(1200, 1, 2, 3)), FusionStatus::kFromFuture);
  EXPECT_EQ(fusion->add_height({at_ms(100), 1.5, {}}), FusionStatus::kTooOld);
  EXPECT_EQ(fusion->add_input({at_ms(1000), Vec3::Zero(), 0, true}), FusionStatus::kTimeBackwards);
  EXPECT_EQ(fusion->add_input({at_ms(10), Vec3::Zero(), 0, true}), FusionStatus::kTimeBackwards);
  EXPECT_EQ(fusion->pose_counts().too_old, 1u);
  EXPECT_EQ(fusion->pose_counts().from_future, 1u);
  EXPECT_EQ(fusion->height_counts().too_old, 1u);
  EXPECT_EQ(fusion->pose_counts().accepted, 40u);
}

TEST(DelayedFusion, AMeasurementAheadOfTheImuWaits) {
  const auto fusion = standing({});
  EXPECT_EQ(fusion->add_pose(pose_at(1010.5, 1, 2, 3)), FusionStatus::kWaiting);
  for (int ms = 1001; ms <= 1010; ++ms) fusion->add_input({at_ms(ms), Vec3::Zero(), 0, true});
  EXPECT_EQ(fusion->pose_counts().accepted, 40u);
  fusion->add_input({at_ms(1011), Vec3::Zero(), 0, true});
  EXPECT_EQ(fusion->pose_counts().accepted, 41u);
}

TEST(DelayedFusion, BadNumbersAreRefused) {
  const auto fusion = standing({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fusion->add_input({at_ms(1001), Vec3(nan, 0, 0), 0, true}), FusionStatus::kInvalid);
  EXPECT_EQ(fusion->add_input({at_ms(1001), Vec3::Zero(), nan, true}), FusionStatus::kInvalid);
  PoseReading<double> pose = pose_at(995, 1, 2, 3);
  (*pose.covariance)(0, 0) = -1;
  EXPECT_EQ(fusion->add_pose(pose), FusionStatus::kInvalid);
  pose = pose_at(995, 1, 2, 3);
  (*pose.covariance)(0, 1) = (*pose.covariance)(1, 0) = 1;  // correlation above one
  EXPECT_EQ(fusion->add_pose(pose), FusionStatus::kInvalid);
  pose.covariance = Mat3::Constant(nan);
  EXPECT_EQ(fusion->add_pose(pose), FusionStatus::kInvalid);
  EXPECT_EQ(fusion->add_height({at_ms(995), nan, {}}), FusionStatus::kInvalid);
  EXPECT_EQ(fusion->add_height({at_ms(995), 1.5, 0.0}), FusionStatus::kInvalid);
  EXPECT_EQ(fusion->pose_counts().invalid, 3u);
  EXPECT_TRUE(fusion->state().planar.position.allFinite());
}

TEST(DelayedFusion, AFreeDirectionIsLeftAlone) {
  // A corridor along x: x is unobservable for the matcher.
  const auto fusion = standing({});
  const Vec2 before = fusion->state().planar.position;
  PoseReading<double> pose = pose_at(995, 5, 2.01, 3);
  pose.covariance = Vec3(1e8, 1e-5, 1e-4).asDiagonal();
  EXPECT_EQ(fusion->add_pose(pose), FusionStatus::kOk);
  EXPECT_NEAR(fusion->state().planar.position.x(), before.x(), 0.01);  // not a metre towards 5
  EXPECT_GT(fusion->state().planar.position.y(), before.y() + 1e-4);
}

TEST(DelayedFusion, AGapIsBridgedAndMakesUncertain) {
  const auto fusion = standing({});
  const double before = fusion->state().planar.pp.trace();
  EXPECT_EQ(fusion->add_input({at_ms(2000), Vec3(50, 0, 0), 3, true}), FusionStatus::kGap);
  EXPECT_LT((fusion->state().planar.position - Vec2(1, 2)).norm(), 0.05);  // not 25 m away
  EXPECT_GT(fusion->state().planar.pp.trace(), 100 * before);
  EXPECT_EQ(fusion->add_pose(pose_at(1999, 1.5, 2, 3)), FusionStatus::kOk);  // now within the gate
}

TEST(DelayedFusion, MoreMeasurementsThanFitAreStillConsistent) {
  // 300 poses within the horizon of 200 ms, in random order: the oldest fall out, nothing is applied twice.
  FusionParams params;
  params.pose_gate_chi2 = 1e9;
  DelayedFusion fusion(params);
  for (int ms = 1; ms <= 300; ++ms) fusion.add_input({at_ms(ms), Vec3::Zero(), 0, true});
  fusion.add_pose(pose_at(110, 1, 2, 3));
  std::vector<int> order(150);
  std::iota(order.begin(), order.end(), 120);
  Rng rng(9);
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[rng.below(static_cast<std::uint32_t>(i))]);
  std::size_t used = 1;
  for (const int ms : order) used += fusion.add_pose(pose_at(ms, 1, 2, 3)) == FusionStatus::kOk;
  EXPECT_EQ(fusion.pose_counts().accepted, used);
  EXPECT_EQ(fusion.pose_counts().accepted + fusion.pose_counts().too_old, order.size() + 1);
  EXPECT_GE(used, DelayedFusion::kMaxMeasurements);
}

TEST(DelayedFusion, TheLaserMayStartBeforeTheImu) {
  DelayedFusion fusion{FusionParams{}};
  EXPECT_EQ(fusion.add_pose(pose_at(10, 1, 2, 3)), FusionStatus::kStarted);
  EXPECT_EQ(fusion.add_height({at_ms(12), 1.5, {}}), FusionStatus::kWaiting);
  fusion.add_input({at_ms(20), Vec3::Zero(), 0, true});
  EXPECT_TRUE(fusion.state().planar.ready);
  EXPECT_TRUE(fusion.state().vertical.ready);
  EXPECT_NEAR(fusion.state().vertical.position(0), 1.5, 1e-12);
}

}  // namespace
}  // namespace hm
