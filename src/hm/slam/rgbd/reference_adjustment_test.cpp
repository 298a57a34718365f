#include "hm/slam/rgbd/reference_adjustment.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "hm/core/rng.hpp"
#include "hm/slam/rgbd/reference_keyframes.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

constexpr std::size_t kSpots = 5;

/// Along five spots, 0.3 m apart, again and again.
SE3 true_pose(std::size_t keyframe) {
  return test::level_camera(0.1 + 0.3 * static_cast<double>(keyframe % kSpots), 0.5, 0);
}

/// A room's points as each round sees them anew: by its own five keyframes and by six references of other
/// rounds. Keyframes are a centimetre off.
Bundle rounds(std::size_t count, std::vector<bool>& is_reference) {
  Rng rng(3);
  Bundle bundle{test::landmark_camera(), {}, {}, {0}, {}};
  std::vector<SE3> truth;
  for (std::size_t k = 0; k < kSpots * count; ++k) {
    truth.push_back(true_pose(k));
    const Vec6 error = 0.01 * Vec6::NullaryExpr([&rng] { return rng.normal(); });
    bundle.T_map_camera.push_back(k == 0 ? truth[0] : truth[k] * SE3::exp(error));
    if (k > 0)
      bundle.edges.push_back(
          {k - 1, k, truth[k - 1].inverse() * truth[k], 100 * Mat6::Identity(), PoseEdgeKind::kOdometry});
  }
  is_reference = reference_keyframes(truth);
  const auto sight = [&](std::size_t k, const Vec3& p_map) {
    const Vec3 p = truth[k].inverse() * p_map;
    return BundleObservation{static_cast<std::uint32_t>(k),
                             bundle.camera.project(p) + 0.5 * Vec2(rng.normal(), rng.normal()),
                             0.25 * Eigen::Matrix2d::Identity(), p.z() + 0.005 * rng.normal(), 0.005};
  };
  for (std::size_t round = 0; round < count; ++round)
    for (int point = 0; point < 40; ++point) {
      const Vec3 p_map(rng.uniform(4, 6), rng.uniform(-0.5, 1.5), rng.uniform(0.6, 2));
      BundleLandmark landmark{p_map + 0.02 * Vec3::Ones(), {}};
      for (std::size_t k = 0; k < truth.size(); ++k) {
        const bool is_own = k / kSpots == round;
        if (is_own || (is_reference[k] && rng.uniform() < 0.3))
          landmark.observations.push_back(sight(k, p_map));
      }
      bound_covisibility(landmark.observations, is_reference);
      bundle.landmarks.push_back(std::move(landmark));
    }
  return bundle;
}

double error_m(const Bundle& bundle, const std::vector<bool>& is_reference, bool of_references) {
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < is_reference.size(); ++k) {
    if (is_reference[k] != of_references) continue;
    sum += (bundle.T_map_camera[k].translation() - true_pose(k).translation()).norm();
    ++count;
  }
  return sum / count;
}

TEST(ReferenceAdjustment, IsThatOfAllWhereAllAreReferences) {
  std::vector<bool> is_reference;
  Bundle bundle = rounds(2, is_reference), same = bundle;
  ASSERT_EQ(std::ranges::count(is_reference, false), 0);
  ASSERT_TRUE(adjust_by_references(bundle, is_reference).converged);
  ASSERT_TRUE(adjust_bundle(same).converged);
  for (std::size_t k = 0; k < bundle.T_map_camera.size(); ++k)
    EXPECT_EQ(bundle.T_map_camera[k].matrix(), same.T_map_camera[k].matrix());
}

/// References and others come as near to the truth as when all are adjusted together.
TEST(ReferenceAdjustment, IsAsGoodAsAllTogether) {
  std::vector<bool> is_reference;
  Bundle bundle = rounds(12, is_reference), together = bundle;
  const Bundle before = bundle;
  ASSERT_GT(std::ranges::count(is_reference, false), 30);
  ASSERT_GT(std::ranges::count(is_reference, true), 10);
  const BundleResult result = adjust_by_references(bundle, is_reference);
  ASSERT_TRUE(result.converged);
  EXPECT_LT(result.final_cost, 0.5 * result.initial_cost);
  ASSERT_TRUE(adjust_bundle(together).converged);
  for (const bool of_references : {true, false}) {
    EXPECT_LT(error_m(bundle, is_reference, of_references),
              1.2 * error_m(together, is_reference, of_references) + 5e-4);
    EXPECT_LT(error_m(bundle, is_reference, of_references),
              0.5 * error_m(before, is_reference, of_references));
  }
}

/// What the others do does not move references; keyframes that nothing holds go with the reference before
/// them.
TEST(ReferenceAdjustment, OthersThatSeeNothingAreCarried) {
  std::vector<bool> is_reference;
  Bundle bundle = rounds(12, is_reference), alone = bundle;
  for (BundleLandmark& landmark : alone.landmarks)
    std::erase_if(landmark.observations,
                  [&](const BundleObservation& o) { return !is_reference[o.keyframe]; });
  std::erase_if(alone.landmarks, [](const BundleLandmark& l) { return l.observations.size() < 2; });
  alone.edges.clear();
  bundle.edges.clear();
  const Bundle before = alone;
  ASSERT_TRUE(adjust_by_references(bundle, is_reference).converged);
  ASSERT_TRUE(adjust_by_references(alone, is_reference).converged);
  std::size_t reference = 0;
  for (std::size_t k = 0; k < is_reference.size(); ++k) {
    if (is_reference[k]) {
      reference = k;
      EXPECT_EQ(bundle.T_map_camera[k].matrix(), alone.T_map_camera[k].matrix());
      continue;
    }
    const SE3 carried =
        alone.T_map_camera[reference] * (before.T_map_camera[reference].inverse() * before.T_map_camera[k]);
    EXPECT_LT((carried.inverse() * alone.T_map_camera[k]).log().norm(), 1e-9);
  }
}

}  // namespace
}  // namespace hm
