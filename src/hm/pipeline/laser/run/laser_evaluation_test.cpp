#include "hm/pipeline/laser/run/laser_evaluation.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

/// Poses every tenth of a second of a vehicle whose yaw is `yaw_of` the time.
template <class YawOf>
Trajectory turning(double duration_s, const YawOf& yaw_of) {
  Trajectory trajectory;
  for (double t = 0; t < duration_s; t += 0.1)
    trajectory.push_back({Time::from_seconds(t), SE3(so3_exp(Vec3(0, 0, yaw_of(t))), Vec3(0.5 * t, 0, 0))});
  return trajectory;
}
double swaying(double t) { return 1.2 * std::sin(0.4 * t); }

TEST(TurnRatio, IsOneWhereBothTurnAlike) {
  const auto ratio =
      turn_ratio(turning(60, swaying), turning(60, [](double t) { return swaying(t) + 0.02 * t; }));
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(*ratio, 1, 0.05);
}

TEST(TurnRatio, ShowsBeamsSpreadOverAnotherAngleAndMirroredOnes) {
  for (const double factor : {0.5, 1.9, -1.0}) {
    const auto ratio =
        turn_ratio(turning(60, [&](double t) { return factor * swaying(t); }), turning(60, swaying));
    ASSERT_TRUE(ratio);
    EXPECT_NEAR(*ratio, factor, 0.05);
  }
}

TEST(TurnRatio, IsNotGivenWhereLittleIsTurnedOrNothingIsAlike) {
  const auto straight = [](double t) { return 0.01 * std::sin(t); };
  EXPECT_FALSE(turn_ratio(turning(60, straight), turning(60, straight)));
  EXPECT_FALSE(turn_ratio(turning(60, swaying), turning(60, [](double t) { return std::sin(1.7 * t + 1); })));
  EXPECT_FALSE(turn_ratio({}, turning(60, swaying)));
  EXPECT_FALSE(turn_ratio(turning(60, swaying), {}));
}

TEST(TurnRatio, LeavesOutWhereOdometryHasAGap) {
  Trajectory odometry = turning(60, swaying);
  std::erase_if(odometry, [](const StampedPose& pose) {
    return pose.stamp.seconds() > 20 && pose.stamp.seconds() < 40;
  });
  for (StampedPose& pose : odometry)  // after the gap it begins anew
    if (pose.stamp.seconds() >= 40)
      pose.T_world_base = SE3(so3_exp(Vec3(0, 0, 2)), Vec3::Zero()) * pose.T_world_base;
  const auto ratio = turn_ratio(turning(60, swaying), odometry);
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(*ratio, 1, 0.02);
}

TEST(JudgeLaserRun, DoubtsALengthThatWasGuessed) {
  LaserSummary summary;
  summary.guessed_m = 20, summary.longest_guess_m = 4;
  EXPECT_EQ(judge_laser_run({}, summary, {}, {}).value, MapVerdict::kOk);
  summary.longest_guess_m = 12;
  const RunVerdict verdict = judge_laser_run({}, summary, {}, {});
  EXPECT_EQ(verdict.value, MapVerdict::kDoubtful);
  ASSERT_EQ(verdict.reasons.size(), 1U);
  EXPECT_NE(verdict.reasons[0].find("the length of 12 m between bare walls"), std::string::npos)
      << verdict.reasons[0];
}

TEST(JudgeLaserRun, DoubtsAPathThatScansBendInTwoWaysAndNoLoopChecks) {
  LaserSummary summary;
  summary.trajectory_odom = turning(60, swaying);
  summary.map_frame.registration.unchecked = {0.04, Time::from_seconds(10), Time::from_seconds(30)};
  EXPECT_EQ(judge_laser_run({}, summary, {}, {}).value, MapVerdict::kOk);
  summary.map_frame.registration.unchecked.angle_rad = 0.1;
  const RunVerdict verdict = judge_laser_run({}, summary, {}, {});
  EXPECT_EQ(verdict.value, MapVerdict::kDoubtful);
  ASSERT_EQ(verdict.reasons.size(), 1U);
  EXPECT_NE(verdict.reasons[0].find("between 10.0 and 30.0 s"), std::string::npos) << verdict.reasons[0];
  EXPECT_NE(verdict.reasons[0].find("5.7 degrees"), std::string::npos) << verdict.reasons[0];
}

TEST(JudgeLaserRun, DoubtsARunWhoseScansShowNoMotionAlongWalls) {
  LaserSummary summary;
  summary.scans_matched = 100, summary.scans_length_unobserved = 40;
  EXPECT_EQ(judge_laser_run({}, summary, {}, {}).value, MapVerdict::kOk);
  summary.scans_length_unobserved = 60;
  EXPECT_EQ(judge_laser_run({}, summary, {}, {}).value, MapVerdict::kDoubtful);
  // Both are said: a vehicle that began between bare walls guessed a few of many metres.
  summary.guessed_m = summary.longest_guess_m = 7;
  const RunVerdict verdict = judge_laser_run({}, summary, {}, {});
  ASSERT_EQ(verdict.reasons.size(), 2U);
  EXPECT_NE(verdict.reasons[1].find("60 % of the scans show nothing"), std::string::npos)
      << verdict.reasons[1];
}

}  // namespace
}  // namespace hm
