#include "hm/evaluation/trajectory_error.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

/// A walk in a figure of eight that climbs and turns, at 20 Hz.
Trajectory walk(int poses = 400) {
  Trajectory path;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.05 * i;
    const Vec3 position(3 * std::sin(0.4 * t), 2 * std::sin(0.8 * t), 0.1 * t + 0.3 * std::cos(t));
    path.push_back(
        {Time::from_seconds(100 + t), SE3(so3_exp(Vec3(0.2 * std::sin(t), 0.1 * t, 0.4 * t)), position)});
  }
  return path;
}

Trajectory moved(const Trajectory& path, const SE3& T_new_old, double scale = 1) {
  Trajectory out;
  for (const StampedPose& pose : path) {
    const SE3 T = T_new_old * pose.T_world_base;
    out.push_back({pose.stamp, SE3(T.rotation(), scale * T.translation())});
  }
  return out;
}

TrajectoryErrorParams with(TrajectoryAlignment alignment) {
  TrajectoryErrorParams params;
  params.alignment = alignment;
  return params;
}

TEST(TrajectoryError, IdentityIsZeroUnderEveryAlignment) {
  for (const auto kind : {TrajectoryAlignment::kNone, TrajectoryAlignment::kSe3, TrajectoryAlignment::kSim3,
                          TrajectoryAlignment::kYaw}) {
    const auto error = evaluate_trajectory(walk(), walk(), with(kind));
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->pairs, 400u);
    EXPECT_LT(error->position_m.max, 1e-9);
    EXPECT_LT(error->rotation_rad.max, 1e-7);
    EXPECT_LT(error->relative.translation_m.max, 1e-9);
    EXPECT_LT(error->relative.rotation_rad.max, 1e-7);
    EXPECT_NEAR(error->alignment.scale, 1, 1e-12);
    EXPECT_FALSE(error->rotation_undetermined);
    EXPECT_TRUE(is_of_one_source(*error));
  }
}

TEST(TrajectoryError, KnownOffsetWithoutAlignment) {
  const auto error = evaluate_trajectory(walk(), moved(walk(), SE3(Mat3::Identity(), Vec3(0.3, -0.4, 1.2))),
                                         with(TrajectoryAlignment::kNone));
  ASSERT_TRUE(error.has_value());
  EXPECT_NEAR(error->position_m.rmse, 1.3, 1e-12);
  EXPECT_NEAR(error->position_m.median, 1.3, 1e-12);
  EXPECT_LT(error->relative.translation_m.max, 1e-9);
}

TEST(TrajectoryError, AlignmentRemovesExactlyWhatItMay) {
  const SE3 rigid(so3_exp(Vec3(0.5, -1.0, 2.0)), Vec3(10, -20, 3));
  const SE3 turn(so3_exp(Vec3(0, 0, 2.5)), Vec3(-4, 5, 6));
  const auto rmse = [](const Trajectory& estimate, TrajectoryAlignment kind) {
    const auto error = evaluate_trajectory(walk(), estimate, with(kind));
    return error ? error->position_m.rmse : -1.0;
  };
  EXPECT_LT(rmse(moved(walk(), rigid), TrajectoryAlignment::kSe3), 1e-9);
  EXPECT_GT(rmse(moved(walk(), rigid), TrajectoryAlignment::kYaw), 0.1);
  EXPECT_LT(rmse(moved(walk(), turn), TrajectoryAlignment::kYaw), 1e-9);
  EXPECT_LT(rmse(moved(walk(), rigid, 0.4), TrajectoryAlignment::kSim3), 1e-9);
  EXPECT_GT(rmse(moved(walk(), rigid, 0.4), TrajectoryAlignment::kSe3), 0.1);
  const auto similarity =
      evaluate_trajectory(walk(), moved(walk(), rigid, 0.4), with(TrajectoryAlignment::kSim3));
  ASSERT_TRUE(similarity.has_value());
  EXPECT_NEAR(similarity->alignment.scale, 2.5, 1e-9);
  EXPECT_TRUE(similarity->alignment.rotation.isApprox(rigid.rotation().transpose(), 1e-9));
  EXPECT_LT(similarity->rotation_rad.max, 1e-7);
  EXPECT_LT(similarity->relative.translation_m.max, 1e-8);
}

TEST(TrajectoryError, AlignmentIsTheLeastSquaresOne) {
  Rng rng(3);
  Trajectory noisy = walk();
  for (StampedPose& pose : noisy)
    pose.T_world_base = {pose.T_world_base.rotation(),
                         pose.T_world_base.translation() + Vec3(rng.normal(), rng.normal(), rng.normal())};
  for (const auto kind : {TrajectoryAlignment::kSe3, TrajectoryAlignment::kYaw}) {
    const auto best = evaluate_trajectory(walk(), noisy, with(kind));
    ASSERT_TRUE(best.has_value());
    for (int i = 0; i < 60; ++i) {  // no small motion of the kind makes it better
      Vec6 twist;
      for (int k = 0; k < 6; ++k) twist[k] = rng.normal(0, 0.05);
      if (kind == TrajectoryAlignment::kYaw) twist[3] = twist[4] = 0;
      const SE3 nudge = SE3::exp(twist);
      double sum = 0;
      for (const PosePair& pair : best->matched)
        sum += (nudge * pair.T_world_estimate.translation() - pair.T_world_truth.translation()).squaredNorm();
      EXPECT_GE(std::sqrt(sum / 400), best->position_m.rmse);
    }
  }
}

TEST(TrajectoryError, MirroredPointsAreNotMirroredBack) {
  std::vector<Vec3> from, to;
  Rng rng(5);
  for (int i = 0; i < 50; ++i) {
    from.emplace_back(rng.normal(), rng.normal(), rng.normal());
    to.emplace_back(-from.back().x(), from.back().y(), from.back().z());
  }
  EXPECT_NEAR(align_points(from, to, TrajectoryAlignment::kSe3).rotation.determinant(), 1, 1e-12);
}

TEST(TrajectoryError, NoiseStatistics) {
  constexpr double kSigma = 0.02;
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    Trajectory noisy = walk();
    for (StampedPose& pose : noisy)
      pose.T_world_base = {
          pose.T_world_base.rotation(),
          pose.T_world_base.translation() + kSigma * Vec3(rng.normal(), rng.normal(), rng.normal())};
    const auto error = evaluate_trajectory(walk(), noisy, with(TrajectoryAlignment::kNone));
    ASSERT_TRUE(error.has_value());
    // The relative error of neighbours holds the noise of two poses.
    EXPECT_NEAR(error->relative.translation_m.rmse, std::sqrt(6.0) * kSigma, 0.1 * kSigma * std::sqrt(6.0));
    sum += error->position_m.rmse;
  }
  EXPECT_NEAR(sum / 20, std::sqrt(3.0) * kSigma, 0.02 * kSigma);
}

/// Straight path along x at 1 m/s and 10 Hz, and the same drifting by `ratio` of the way and turning.
Trajectory straight(double drift_ratio, double turn_rad_s) {
  Trajectory path;
  for (int i = 0; i < 101; ++i) {
    const double t = 0.1 * i;
    path.push_back(
        {Time::from_seconds(t), SE3(so3_exp(Vec3(turn_rad_s * t, 0, 0)), Vec3((1 + drift_ratio) * t, 0, 0))});
  }
  return path;
}

TEST(TrajectoryError, DriftOverFramesSecondsAndMetres) {
  const Trajectory truth = straight(0, 0), drifting = straight(0.05, 0.01);
  struct Case {
    RpeUnit unit;
    double delta, span_s;
    std::size_t spans;
  };
  for (const Case& c : {Case{RpeUnit::kFrames, 1, 0.1, 100}, Case{RpeUnit::kFrames, 10, 1.0, 91},
                        Case{RpeUnit::kSeconds, 1, 1.0, 91}, Case{RpeUnit::kMetres, 2, 2.0, 81}}) {
    TrajectoryErrorParams params = with(TrajectoryAlignment::kNone);
    params.rpe_unit = c.unit;
    params.rpe_delta = c.delta;
    const auto error = evaluate_trajectory(truth, drifting, params);
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->relative.spans.size(), c.spans);
    EXPECT_NEAR(error->relative.translation_m.rmse, 0.05 * c.span_s, 1e-9);
    EXPECT_NEAR(error->relative.rotation_rad.rmse, 0.01 * c.span_s, 1e-9);
    EXPECT_NEAR(error->truth_path_m, 10, 1e-9);
  }
}

TEST(TrajectoryError, RelativeErrorIgnoresWhereTheWorldIs) {
  Rng rng(11);
  Trajectory noisy = walk();
  for (StampedPose& pose : noisy)
    pose.T_world_base =
        pose.T_world_base * SE3(so3_exp(0.01 * Vec3(rng.normal(), rng.normal(), rng.normal())),
                                0.01 * Vec3(rng.normal(), rng.normal(), rng.normal()));
  const SE3 elsewhere(so3_exp(Vec3(1, 2, 0.3)), Vec3(7, 8, 9));
  const auto here = evaluate_trajectory(walk(), noisy, with(TrajectoryAlignment::kNone));
  const auto there = evaluate_trajectory(walk(), moved(noisy, elsewhere), with(TrajectoryAlignment::kNone));
  ASSERT_TRUE(here && there);
  EXPECT_NEAR(here->relative.translation_m.rmse, there->relative.translation_m.rmse, 1e-9);
  EXPECT_NEAR(here->relative.rotation_rad.rmse, there->relative.rotation_rad.rmse, 1e-9);
  // Swapping the roles changes neither the aligned position error nor the number of pairs.
  const auto swapped = evaluate_trajectory(moved(noisy, elsewhere), walk(), with(TrajectoryAlignment::kSe3));
  const auto straight_on =
      evaluate_trajectory(walk(), moved(noisy, elsewhere), with(TrajectoryAlignment::kSe3));
  ASSERT_TRUE(swapped && straight_on);
  EXPECT_NEAR(swapped->position_m.rmse, straight_on->position_m.rmse, 1e-9);
  EXPECT_EQ(swapped->pairs, straight_on->pairs);
}

TEST(TrajectoryError, HolesAreNotSpans) {
  Trajectory truth = straight(0, 0);
  Trajectory holed = truth;
  holed.erase(holed.begin() + 30, holed.begin() + 70);  // 4 s without poses
  TrajectoryErrorParams params = with(TrajectoryAlignment::kNone);
  params.rpe_unit = RpeUnit::kSeconds;
  params.rpe_delta = 1;
  const auto error = evaluate_trajectory(truth, holed, params);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->relative.spans.size(), 20u + 21u);
}

TEST(Associate, NearestOneToOne) {
  const auto at = [](std::initializer_list<double> stamps) {
    Trajectory path;
    for (const double t : stamps)
      path.push_back({Time::from_seconds(t), SE3(Mat3::Identity(), Vec3(t, 0, 0))});
    return path;
  };
  TrajectoryErrorParams params;
  params.association = TrajectoryAssociation::kNearest;
  params.max_stamp_difference_s = 0.1;
  const auto pairs = associate(at({1.0, 2.0, 3.0, 4.0}), at({0.95, 1.01, 2.05, 3.2, 4.1}), params);
  ASSERT_EQ(pairs.size(), 3u);
  EXPECT_DOUBLE_EQ(pairs[0].T_world_estimate.translation().x(), 1.01);  // the nearer of two
  EXPECT_DOUBLE_EQ(pairs[1].T_world_estimate.translation().x(), 2.05);
  EXPECT_DOUBLE_EQ(pairs[2].T_world_estimate.translation().x(), 4.1);  // exactly at the limit
  EXPECT_DOUBLE_EQ(pairs[2].T_world_truth.translation().x(), 4.0);
}

TEST(Associate, InterpolatesTruthBetweenStamps) {
  Trajectory truth = straight(0, 0.3);
  Trajectory estimate;
  for (int i = 0; i < 50; ++i) {
    const double t = 0.13 + 0.17 * i;
    estimate.push_back({Time::from_seconds(t), SE3(so3_exp(Vec3(0.3 * t, 0, 0)), Vec3(t, 0, 0))});
  }
  TrajectoryErrorParams params = with(TrajectoryAlignment::kNone);
  params.max_stamp_difference_s = 0.06;
  const auto interpolated = evaluate_trajectory(truth, estimate, params);
  ASSERT_TRUE(interpolated.has_value());
  EXPECT_EQ(interpolated->pairs, 50u);
  EXPECT_LT(interpolated->position_m.max, 1e-8);
  EXPECT_LT(interpolated->rotation_rad.max, 1e-7);
  params.max_truth_gap_s = 0.09;
  const auto exact = evaluate_trajectory(truth, estimate, params);
  ASSERT_TRUE(exact.has_value());
  EXPECT_EQ(exact->pairs, 5u);  // a gap of 0.1 s is too long; these are at the stamp of a true pose
  params.association = TrajectoryAssociation::kNearest;
  EXPECT_GT(evaluate_trajectory(truth, estimate, params)->position_m.max, 0.02);
}

TEST(TrajectoryError, SaysWhyNothingMatches) {
  Trajectory late = walk();
  for (StampedPose& pose : late) pose.stamp.ns += 3'600'000'000'000;
  const auto error = evaluate_trajectory(walk(), late);
  ASSERT_FALSE(error.has_value());
  EXPECT_THAT(error.error().message, testing::HasSubstr("0 of at least 3 poses match"));
  EXPECT_THAT(error.error().message, testing::HasSubstr("100.000 s to 119.950 s"));
  EXPECT_THAT(error.error().message, testing::HasSubstr("overlap by 0.000 s"));
  EXPECT_THAT(evaluate_trajectory({}, walk()).error().message, testing::HasSubstr("no pose"));
}

TEST(TrajectoryError, ClocksThatHaveNothingInCommonAreToldApartByANumber) {
  Trajectory late = walk();
  for (StampedPose& pose : late) pose.stamp = pose.stamp + Duration::from_seconds(1305031000);
  const auto error = evaluate_trajectory(late, walk());
  ASSERT_FALSE(error);
  EXPECT_THAT(error.error().message, testing::HasSubstr("the estimate begins 1305031000.000 s earlier"));
  EXPECT_THAT(error.error().message,
              testing::HasSubstr("add 1305031000.000 s to the stamps of the estimate"));
  EXPECT_EQ(error.error().message.find("larger gap"), std::string::npos);
}

TEST(TrajectoryError, AWrongSizeIsToldFromAnEstimateThatHasLittleToDoWithTheTruth) {
  const auto scaled = evaluate_trajectory(walk(), moved(walk(), SE3(), 0.2));
  ASSERT_TRUE(scaled);
  EXPECT_TRUE(scaled->wrong_size);
  EXPECT_NEAR(scaled->size_ratio.value_or(0), 0.2, 1e-9);
  EXPECT_NEAR(scaled->estimate_path_m, 0.2 * scaled->truth_path_m, 0.005);  // counted by steps of 2 cm
  EXPECT_FALSE(evaluate_trajectory(walk(), moved(walk(), SE3(), 1.05))->wrong_size);
  Rng rng(4);
  Trajectory random = walk();
  for (StampedPose& pose : random)
    pose.T_world_base = {pose.T_world_base.rotation(), Vec3(rng.normal(), rng.normal(), rng.normal())};
  EXPECT_FALSE(evaluate_trajectory(walk(), random)->wrong_size);
  for (StampedPose& pose : random) pose.T_world_base = {pose.T_world_base.rotation(), Vec3::Ones()};
  EXPECT_FALSE(evaluate_trajectory(walk(), random)->size_ratio);
}

TEST(TrajectoryError, DegeneratePathsAreNamed) {
  const auto line = evaluate_trajectory(straight(0, 0), straight(0.1, 0), with(TrajectoryAlignment::kSe3));
  ASSERT_TRUE(line.has_value());
  EXPECT_TRUE(line->rotation_undetermined);
  EXPECT_TRUE(std::isinf(line->alignment_uncertainty_rad));
  EXPECT_FALSE(rotation_rmse_rad(*line).has_value());
  EXPECT_LT(line->rotation_own_rad.rmse, 1e-9);
  EXPECT_TRUE(std::isfinite(line->position_m.rmse));
  Trajectory still = walk(10);
  for (StampedPose& pose : still) pose.T_world_base = SE3();
  const auto scale = evaluate_trajectory(walk(10), still, with(TrajectoryAlignment::kSim3));
  ASSERT_FALSE(scale.has_value());
  EXPECT_THAT(scale.error().message, testing::HasSubstr("scale cannot be found"));
}

/// A path along x with a bend of this radius about it; its estimate has noise in position and orientation,
/// and another world frame.
struct NearlyStraight {
  Trajectory truth, estimate;
};
NearlyStraight nearly_straight(double radius_m, double position_noise_m, double rotation_noise_rad,
                               std::uint64_t seed) {
  Rng rng(seed);
  const auto noise = [&rng] { return Vec3(rng.normal(), rng.normal(), rng.normal()); };
  const SE3 elsewhere(so3_exp(Vec3(1, -2, 0.3)), Vec3(7, 8, 9));
  NearlyStraight paths;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i;
    const SE3 T(so3_exp(Vec3(0.1 * t, 0.2, 0.05 * t)),
                Vec3(0.4 * t, radius_m * std::cos(t), radius_m * std::sin(t)));
    paths.truth.push_back({Time::from_seconds(t), T});
    const SE3 off(T.rotation() * so3_exp(rotation_noise_rad * noise()),
                  T.translation() + position_noise_m * noise());
    paths.estimate.push_back({Time::from_seconds(t), elsewhere * off});
  }
  return paths;
}

TEST(TrajectoryError, OrientationOfANearlyStraightPathIsMeasuredByOrientations) {
  // 2 mm of position noise turn the alignment of a path 4 m long and 1 mm wide by many degrees.
  double largest_rad = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const NearlyStraight paths = nearly_straight(0.001, 0.002, 0.002, seed);
    const auto error = evaluate_trajectory(paths.truth, paths.estimate);
    ASSERT_TRUE(error.has_value());
    largest_rad = std::max(largest_rad, error->rotation_rad.rmse);
    EXPECT_TRUE(error->rotation_undetermined) << seed;
    EXPECT_NEAR(error->rotation_own_rad.rmse, std::sqrt(3.0) * 0.002, 0.0004) << seed;
  }
  EXPECT_GT(largest_rad, 0.08);  // what would have been reported
}

TEST(TrajectoryError, OrientationOfAWidePathIsMeasuredByPositionsToo) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const NearlyStraight paths = nearly_straight(1, 0.002, 0.01, seed);
    const auto error = evaluate_trajectory(paths.truth, paths.estimate);
    ASSERT_TRUE(error.has_value());
    EXPECT_FALSE(error->rotation_undetermined) << seed;
    EXPECT_LT(error->alignment_uncertainty_rad, 0.006);
    EXPECT_NEAR(*rotation_rmse_rad(*error), std::sqrt(3.0) * 0.01, 0.002) << seed;
    EXPECT_NEAR(error->rotation_own_rad.rmse, std::sqrt(3.0) * 0.01, 0.002) << seed;
    EXPECT_FALSE(is_of_one_source(*error));
  }
}

TEST(TrajectoryError, OrientationsThatDisagreeWithThePositionsAreReported) {
  // Poses of another body frame: no error of the alignment explains this, also on a small path.
  NearlyStraight paths = nearly_straight(0.1, 0.002, 0.002, 1);
  const SE3 body(so3_exp(Vec3(1.5, 0, 0)), Vec3::Zero());
  for (StampedPose& pose : paths.estimate)
    pose.T_world_base = {pose.T_world_base.rotation() * body.rotation(), pose.T_world_base.translation()};
  const auto error = evaluate_trajectory(paths.truth, paths.estimate);
  ASSERT_TRUE(error.has_value());
  ASSERT_FALSE(error->rotation_undetermined);
  EXPECT_NEAR(*rotation_rmse_rad(*error), 1.5, 0.1);
}

TEST(TrajectoryError, UncertaintyBoundsTheTurnThatPositionErrorsCause) {
  for (const auto kind : {TrajectoryAlignment::kSe3, TrajectoryAlignment::kYaw})
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      NearlyStraight paths = nearly_straight(0.05, 0.005, 0, seed);
      for (std::size_t i = 0; i < paths.truth.size(); ++i)
        paths.estimate[i].T_world_base = SE3(paths.truth[i].T_world_base.rotation(),
                                             SE3(so3_exp(Vec3(1, -2, 0.3)), Vec3(7, 8, 9)).inverse() *
                                                 paths.estimate[i].T_world_base.translation());
      const auto error = evaluate_trajectory(paths.truth, paths.estimate, with(kind));
      ASSERT_TRUE(error.has_value());
      EXPECT_LE(error->rotation_rad.max, error->alignment_uncertainty_rad) << seed;
    }
}

TEST(TrajectoryError, TheSamePosesInAnotherFrameAreOfOneSource) {
  const SE3 elsewhere(so3_exp(Vec3(0.5, -1.0, 2.0)), Vec3(10, -20, 3));
  const auto same = evaluate_trajectory(walk(), moved(walk(), elsewhere));
  ASSERT_TRUE(same.has_value());
  EXPECT_TRUE(is_of_one_source(*same));
  Trajectory noisy = walk();
  for (std::size_t i = 0; i < noisy.size(); ++i)
    noisy[i].T_world_base =
        SE3(Mat3::Identity(), Vec3(0, 0, i % 2 == 0 ? 1e-4 : -1e-4)) * noisy[i].T_world_base;
  const auto estimated = evaluate_trajectory(walk(), noisy);
  ASSERT_TRUE(estimated.has_value());
  EXPECT_FALSE(is_of_one_source(*estimated));
}

TEST(TrajectoryError, PosesThatAreNotRigidAreRefused) {
  Trajectory broken = walk(10);
  broken[4].T_world_base = SE3(Mat3::Identity(), Vec3(0, std::nan(""), 0));
  const auto of_estimate = evaluate_trajectory(walk(10), broken),
             of_truth = evaluate_trajectory(broken, walk(10));
  ASSERT_FALSE(of_estimate);
  ASSERT_FALSE(of_truth);
  EXPECT_EQ(of_estimate.error().where, "the estimated trajectory");
  EXPECT_EQ(of_truth.error().where, "the true trajectory");
  for (const auto* error : {&of_estimate.error(), &of_truth.error()})
    EXPECT_THAT(error->message, testing::HasSubstr("is not a rigid motion"));
}

}  // namespace
}  // namespace hm
