#include "hm/odometry/registration/ransac.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <set>

#include "hm/odometry/published/frame_to_frame.hpp"
#include "hm/odometry/testing/point_scenes.hpp"

namespace hm {
namespace {

/// `share` of the pairs are outliers; these come first.
std::vector<PointPair> mixed_pairs(const SE3& truth, int count, double share, Rng& rng) {
  const int outliers = static_cast<int>(count * share);
  std::vector<PointPair> pairs = outlier_pairs(outliers, rng);
  const std::vector<PointPair> good = noisy_pairs(truth, count - outliers, rng);
  pairs.insert(pairs.end(), good.begin(), good.end());
  return pairs;
}

RansacParams by_covariance() {
  RansacParams params;
  params.inlier_test = InlierTest::kMahalanobis;
  params.max_distance_m = 0.15;
  return params;
}

TEST(Ransac, FindsTheMotionThroughUpTo60PercentOutliers) {
  for (const double share : {0.0, 0.3, 0.6}) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      Rng rng(seed);
      const SE3 truth = random_motion(rng, 0.3, 0.4);
      const std::vector<PointPair> pairs = mixed_pairs(truth, 250, share, rng);
      Rng draws(seed + 1000);
      const RansacMotion found = ransac_registration(pairs, by_covariance(), draws);
      ASSERT_TRUE(found.found) << found.reason;
      EXPECT_LT((found.T_a_b.inverse() * truth).translation().norm(), 0.02) << share << " " << seed;
      EXPECT_LT((found.T_a_b.inverse() * truth).angle(), 0.01) << share << " " << seed;
      const auto outliers = static_cast<int>(250 * share);
      const auto wrong =
          std::count_if(found.inliers.begin(), found.inliers.end(), [&](int i) { return i < outliers; });
      EXPECT_LE(wrong, 3);
      // 99 % of the inliers pass the test with the true motion
      EXPECT_GT(static_cast<double>(found.inliers.size()), 0.93 * (250 - outliers));
    }
  }
}

TEST(Ransac, CovarianceIsConsistentOverSeeds) {
  double nees = 0;
  constexpr int kSeeds = 200;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Rng rng(seed);
    const SE3 truth = random_motion(rng, 0.1, 0.1);
    const RansacMotion found = ransac_registration(mixed_pairs(truth, 150, 0.3, rng), by_covariance(), rng);
    ASSERT_TRUE(found.found);
    const Vec6 error = (found.T_a_b * truth.inverse()).log();
    nees += error.dot(found.covariance.inverse() * error);
  }
  EXPECT_GT(nees / kSeeds, 4.8);
  EXPECT_LT(nees / kSeeds, 7.8);  // truncated tails and a few wrong pairs make it slightly more than 6
}

TEST(Ransac, InliersAreAscendingAndCountedOnce) {
  Rng rng(1);
  const SE3 truth = random_motion(rng, 0.1, 0.1);
  // 27 correct pairs only: counting the three pairs of a sample twice would give 30.
  const std::vector<PointPair> pairs = [&] {
    std::vector<PointPair> all = exact_pairs(truth, 27, rng);
    const auto outliers = outlier_pairs(20, rng);
    all.insert(all.end(), outliers.begin(), outliers.end());
    return all;
  }();
  RansacParams params;
  params.max_iterations = 2000;
  const RansacMotion refused = ransac_registration(pairs, params, rng);
  EXPECT_FALSE(refused.found);
  EXPECT_EQ(refused.inliers.size(), 27U);
  EXPECT_NE(refused.reason.find("27 of 47"), std::string::npos) << refused.reason;
  params.min_inliers = 27;
  const RansacMotion found = ransac_registration(pairs, params, rng);
  EXPECT_TRUE(found.found);
  EXPECT_TRUE(std::is_sorted(found.inliers.begin(), found.inliers.end()));
  EXPECT_EQ(std::set<int>(found.inliers.begin(), found.inliers.end()).size(), found.inliers.size());
}

TEST(Ransac, EndsEarlyWhenMostAgreeAndNeverAfterItsLimit) {
  Rng rng(2);
  const SE3 truth = random_motion(rng, 0.1, 0.1);
  EXPECT_LE(ransac_registration(exact_pairs(truth, 100, rng), {}, rng).iterations, 5);
  EXPECT_EQ(ransac_registration(outlier_pairs(200, rng), {}, rng).iterations, 200);
}

TEST(Ransac, TheSeedAloneDecides) {
  Rng rng(3);
  const std::vector<PointPair> pairs = mixed_pairs(random_motion(rng, 0.2, 0.2), 200, 0.6, rng);
  Rng first(5), again(5);
  const RansacMotion a = ransac_registration(pairs, {}, first);
  const RansacMotion b = ransac_registration(pairs, {}, again);
  EXPECT_EQ(a.inliers, b.inliers);
  EXPECT_EQ(a.T_a_b.matrix(), b.T_a_b.matrix());
  EXPECT_EQ(a.iterations, b.iterations);
}

TEST(Ransac, TooFewLinesAndRandomPairsGiveNothing) {
  Rng rng(4);
  EXPECT_FALSE(ransac_registration({}, {}, rng).found);
  EXPECT_FALSE(ransac_registration(exact_pairs({}, 29, rng), {}, rng).found);
  EXPECT_FALSE(ransac_registration(outlier_pairs(300, rng), {}, rng).found);
  std::vector<PointPair> line;
  for (int i = 0; i < 60; ++i) {
    const Vec3 p = Vec3(0.1, 0, 1) * rng.uniform(1, 4);
    line.push_back({p, p, kinect_covariance(p), kinect_covariance(p)});
  }
  EXPECT_FALSE(ransac_registration(line, {}, rng).found);
  EXPECT_FALSE(ransac_registration(line, by_covariance(), rng).found);
}

Feature random_feature(Rng& rng, const Vec3& p_camera) {
  Feature feature;
  for (auto& word : feature.descriptor) {
    word = (static_cast<std::uint64_t>(rng.next_u32()) << 32U) | rng.next_u32();
  }
  feature.has_depth = true;
  feature.p_camera = p_camera;
  feature.covariance = kinect_covariance(p_camera);
  return feature;
}

TEST(MatchDescriptors, AgreesWithASlowSearch) {
  Rng rng(6);
  FeatureSet a, b;
  for (int i = 0; i < 80; ++i) a.push_back(random_feature(rng, Vec3(0, 0, 1)));
  for (int i = 0; i < 60; ++i) {
    b.push_back(a[rng.below(80)]);
    for (int flips = 0; flips < 60; ++flips) b.back().descriptor[rng.below(4)] ^= 1ULL << rng.below(64);
    b.back().has_depth = rng.uniform() < 0.8;
  }
  const MatchLimits limits{0.8, 60, false, true};
  const std::vector<FeatureMatch> matches = match_descriptors(a, b, limits);
  std::size_t expected = 0;
  for (int i = 0; i < 60; ++i) {
    const Feature& f = b[static_cast<std::size_t>(i)];
    std::vector<std::pair<int, int>> order;
    for (int j = 0; j < 80; ++j) {
      order.emplace_back(hamming_distance(f.descriptor, a[static_cast<std::size_t>(j)].descriptor), j);
    }
    std::sort(order.begin(), order.end());
    if (!f.has_depth || order[0].first > 60 || order[0].first >= 0.8 * order[1].first) continue;
    ASSERT_LT(expected, matches.size());
    EXPECT_EQ(matches[expected].b, i);
    EXPECT_EQ(matches[expected].a, order[0].second);
    EXPECT_EQ(matches[expected].distance_bits, order[0].first);
    ++expected;
  }
  EXPECT_EQ(matches.size(), expected);
  EXPECT_GT(expected, 20U);
}

TEST(MatchDescriptors, MutualMatchesAreOneToOne) {
  Rng rng(7);
  FeatureSet a, b;
  for (int i = 0; i < 20; ++i) a.push_back(random_feature(rng, Vec3(0, 0, 1)));
  for (int i = 0; i < 40; ++i) b.push_back(a[static_cast<std::size_t>(i % 20)]);  // each twice
  EXPECT_EQ(match_descriptors(a, b, {2, 256, false, true}).size(), 40U);
  EXPECT_EQ(match_descriptors(a, b, {2, 256, true, true}).size(), 20U);
  EXPECT_TRUE(match_descriptors({}, b, {}).empty());
  EXPECT_TRUE(match_descriptors(a, {}, {}).empty());
}

TEST(MatchFrames, GivesTheMotionInTheCamerasFrame) {
  Rng rng(8);
  const SE3 T_odom_a = random_motion(rng, 3, 2), T_odom_b = T_odom_a * random_motion(rng, 0.1, 0.2);
  FeatureSet a, b;
  for (int i = 0; i < 100; ++i) {
    a.push_back(random_feature(rng, point_in_view(rng)));
    b.push_back(a.back());
    b.back().p_camera = T_odom_b.inverse() * T_odom_a * a.back().p_camera;
  }
  const FrameMotion found = match_frames(a, b, {}, rng);
  ASSERT_TRUE(found.motion.found) << found.motion.reason;
  EXPECT_EQ(found.matches, 100);
  EXPECT_LT(((T_odom_a * found.motion.T_a_b).inverse() * T_odom_b).log().norm(), 1e-6);
}

}  // namespace
}  // namespace hm
