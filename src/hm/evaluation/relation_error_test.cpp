#include "hm/evaluation/relation_error.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

using ::testing::HasSubstr;

Time at(double seconds) { return Time::from_seconds(100 + seconds); }

/// A curve driven at 10 Hz.
Trajectory drive(int poses = 200) {
  Trajectory path;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.1 * i;
    path.push_back({at(t), SE2(5 * std::sin(0.3 * t), 2 * t, 0.4 * std::sin(t)).to_se3()});
  }
  return path;
}

std::vector<PoseRelation> true_relations(const Trajectory& path, int count) {
  Rng rng(7);
  std::vector<PoseRelation> relations;
  for (int i = 0; i < count; ++i) {
    const StampedPose& from = path[rng.below(static_cast<std::uint32_t>(path.size()))];
    const StampedPose& to = path[rng.below(static_cast<std::uint32_t>(path.size()))];
    relations.push_back({from.stamp, to.stamp, from.T_world_base.inverse() * to.T_world_base});
  }
  return relations;
}

TEST(RelationError, TruthHasNoneInAnyFrame) {
  Trajectory path = drive();
  const auto relations = true_relations(path, 300);
  for (StampedPose& pose : path) pose.T_world_base = SE2(4, -3, 2).to_se3(1.5) * pose.T_world_base;
  const auto errors = evaluate_relations(path, relations);
  ASSERT_TRUE(errors);
  EXPECT_EQ(errors->errors.size(), 300U);
  EXPECT_EQ(errors->unmatched, 0U);
  EXPECT_LT(errors->translation_m.max, 1e-12);
  EXPECT_LT(errors->rotation_rad.max, 1e-7);
}

/// Known errors: a relation off by (3, 4) cm and one by a turn of 0.1 rad.
TEST(RelationError, MeanAndDeviationInClosedForm) {
  const Trajectory path = drive();
  const SE3 motion = path[10].T_world_base.inverse() * path[50].T_world_base;
  const std::vector<PoseRelation> relations = {
      {path[10].stamp, path[50].stamp, motion * SE2(0.03, 0.04, 0).to_se3()},
      {path[50].stamp, path[10].stamp, (motion * SE2(0, 0, 0.1).to_se3()).inverse()},
      {at(-5), path[3].stamp, {}}};
  const auto errors = evaluate_relations(path, relations);
  ASSERT_TRUE(errors);
  ASSERT_EQ(errors->errors.size(), 2U);
  EXPECT_EQ(errors->unmatched, 1U);
  EXPECT_NEAR(errors->errors[0].translation_m, 0.05, 1e-12);
  EXPECT_NEAR(errors->errors[0].rotation_rad, 0, 1e-7);
  // T_true^-1 T_estimate = (M E) M^-1: the turn, and the lever of the motion swung by it.
  const double lever_m = 2 * std::sin(0.05) * motion.translation().norm();
  EXPECT_NEAR(errors->errors[1].translation_m, lever_m, 1e-12);
  EXPECT_NEAR(errors->errors[1].rotation_rad, 0.1, 1e-9);
  EXPECT_NEAR(errors->translation_m.mean, (0.05 + lever_m) / 2, 1e-12);
  EXPECT_NEAR(errors->translation_std_m, std::abs(0.05 - lever_m) / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(errors->rotation_rad.mean, 0.05, 1e-7);
  EXPECT_NEAR(errors->rotation_std_rad, 0.1 / std::sqrt(2.0), 1e-7);
}

TEST(RelationError, InterpolatesWithinTheGapOnly) {
  Trajectory path = {
      {at(0), SE2(0, 0, 0).to_se3()}, {at(1), SE2(1, 0, 0).to_se3()}, {at(4), SE2(4, 0, 0).to_se3()}};
  const std::vector<PoseRelation> relations = {{at(0.25), at(0.75), SE2(0.5, 0, 0).to_se3()},
                                               {at(0.5), at(2), SE2(1.5, 0, 0).to_se3()}};
  auto errors = evaluate_relations(path, relations);
  ASSERT_TRUE(errors);
  ASSERT_EQ(errors->errors.size(), 1U);
  EXPECT_LT(errors->translation_m.max, 1e-12);
  RelationErrorParams params;
  params.max_gap_s = 3;
  errors = evaluate_relations(path, relations, params);
  ASSERT_TRUE(errors);
  EXPECT_EQ(errors->errors.size(), 2U);
  EXPECT_LT(errors->translation_m.max, 1e-12);
}

TEST(RelationError, NothingToCompareIsAnError) {
  const std::vector<PoseRelation> relations = {{at(-5), at(1), {}}};
  const auto errors = evaluate_relations(drive(), relations);
  ASSERT_FALSE(errors);
  EXPECT_THAT(errors.error().message, HasSubstr("none of 1 relations"));
  EXPECT_FALSE(evaluate_relations({}, relations));
  EXPECT_FALSE(evaluate_relations(drive(), {}));
}

}  // namespace
}  // namespace hm
